"""A BIDS-like data set of small studies, laid out as docs/cohorts.md says."""

import json
from pathlib import Path

from small_study import write_small_study

from PolyPoseLib.io.cohort.bids_layout import SOURCE_IGNORED

DESCRIPTION = {
    "Name": "Hips",
    "BIDSVersion": "1.10.0",
    "DatasetType": "raw",
    "DatasetDOI": "doi:10.5281/zenodo.1",
}


def write_data_set(
    folder: Path, studies: tuple[str, ...] = ("sub-01", "sub-02_ses-a", "sub-02_ses-b")
) -> Path:
    """Write studies named after their subject and session."""
    folder.mkdir()
    (folder / "dataset_description.json").write_text(json.dumps(DESCRIPTION))
    (folder / "README").write_text(
        "Small studies of random numbers, for tests of a folder's layout alone.\n" * 5
    )
    (folder / ".bidsignore").write_text("\n".join(SOURCE_IGNORED))
    subjects = sorted({each.split("_")[0] for each in studies})
    (folder / "participants.tsv").write_text("\n".join(["participant_id", *subjects]) + "\n")
    for name in studies:
        parts = [part for part in name.split("_") if part.startswith(("sub-", "ses-"))]
        write_bids_study(folder.joinpath(*parts), name)
    return folder


def write_bids_study(place: Path, name: str) -> None:
    """One study: the study's file, the CT with its labels, and an X-ray with a sidecar."""
    place.mkdir(parents=True, exist_ok=True)
    given = write_small_study(place / "given")
    fields = json.loads(given.read_text())
    for kind in ("ct", "xray"):
        (place / kind).mkdir(exist_ok=True)
    names = {"ct": f"ct/{name}_ct.nii.gz", "segmentation": f"ct/{name}_dseg.nii.gz"}
    image = f"xray/{name}_acq-ap_xray.nii.gz"
    for field, target in names.items():
        (given.parent / fields[field]).rename(place / target)
        fields[field] = target
    (given.parent / fields["xrays"][0]["image"]).rename(place / image)
    fields["xrays"][0]["image"] = image
    (place / f"{name}_study.json").write_text(json.dumps(fields))
    given.unlink()
    given.parent.rmdir()
