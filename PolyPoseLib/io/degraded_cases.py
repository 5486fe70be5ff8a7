"""A degraded case as a folder: a study like any other, the truth, and what was done to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cases import STUDY_FILE, TRUTH_FOLDER
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, array, json_text, list_of, parse_object, real, string
from PolyPoseLib.io.truths import save_truth
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom
from PolyPoseLib.simulation.truth import truth_of

if TYPE_CHECKING:
    from PolyPoseLib.data.truth import Truth
    from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, View

DEGRADATION_FILE = "degradation.json"


@dataclass(frozen=True)
class DegradationRecord:
    """What was done to a case, as its truth folder keeps it.

    Attributes
    ----------
    names : tuple of str
        The degradations.
    given_to_true : ndarray (4, 4)
        From the world of the given CT to that of the true one.
    size_factor : float
        Size of the anatomy relative to the original.

    """

    names: tuple[str, ...]
    given_to_true: np.ndarray
    size_factor: float


def write_degraded_case(
    degraded: DegradedCase,
    folder: str | Path,
    label_ids: Mapping[str, Sequence[int]] | None = None,
    organ_names: Mapping[int, str] | None = None,
) -> Path:
    """Write the study of a degraded case, and its truth with the record in the folder "truth" beside it.

    Parameters and Raises as :func:`write_degraded_study`; organ_names: {label: name} of the source segmentation, for
    the scores of soft organs. Returns the path of study.json.
    """
    path = write_degraded_study(degraded, folder, label_ids)
    save_degraded_truth(degraded, Path(folder) / TRUTH_FOLDER, organ_names)
    return path


def write_degraded_study(
    degraded: DegradedCase,
    folder: str | Path,
    label_ids: Mapping[str, Sequence[int]] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Path:
    """Write the study of a degraded case, without the truth.

    X-rays that hold line integrals are XA files; those that hold grey levels are PNG pictures of 8 or 16 bits with
    bright bone, of which the study says nothing more.

    Parameters
    ----------
    degraded : DegradedCase
        What to write.
    folder : path
        Made when it does not exist; it must be empty.
    label_ids : mapping or None
        {structure: labels of the source segmentation}; None writes the structures' own numbers.
    options : mapping or None
        The study's options.

    Returns
    -------
    Path
        Of study.json.

    Raises
    ------
    InputError
        The folder is not empty or cannot be written.

    """
    folder = Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is not an empty folder; choose another one.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_volume(
            degraded.ct.with_voxels(np.rint(degraded.ct.voxels).astype(np.int16)), folder / "ct.nii.gz"
        )
        fields = {
            "version": 1,
            "ct": "ct.nii.gz",
            "segmentation": "labels.nii.gz",
            "structures": _write_labels(degraded, folder / "labels.nii.gz", label_ids),
            "anchor": degraded.case.anchor,
            "xrays": [_write_xray(degraded, number, folder) for number in range(len(degraded.views))],
            "options": dict(options or {}),
        }
        path = folder / STUDY_FILE
        path.write_text(json_text(fields), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); choose another folder.") from error
    return path


def save_degraded_truth(
    degraded: DegradedCase, folder: Path, organ_names: Mapping[int, str] | None = None
) -> None:
    """Write the truth, with the cameras that really took the X-rays, and the record of what was done."""
    save_truth(degraded_truth(degraded, organ_names), folder)
    record = {
        "degradations": list(degraded.names),
        "given_to_true": degraded.given_to_true,
        "size_factor": degraded.size_factor,
    }
    (folder / DEGRADATION_FILE).write_text(json_text(record), encoding="utf-8")


def degraded_truth(degraded: DegradedCase, organ_names: Mapping[int, str] | None = None) -> Truth:
    """The truth of a degraded case: that of the case, with the cameras that really took the X-rays."""
    truth = truth_of(degraded.case, dict(organ_names or {}))
    return replace(truth, cameras=[view.camera for view in degraded.views])


def load_degradation_record(truth_folder: str | Path) -> DegradationRecord:
    """The record in a truth folder; that of a sound case when there is none."""
    path = Path(truth_folder) / DEGRADATION_FILE
    if not path.is_file():
        return DegradationRecord((), np.eye(4), 1.0)
    record = Record(
        parse_object(read_text(path, "the truth folder of a degraded case"), str(path)), f"{path}: "
    )
    return DegradationRecord(
        tuple(record.required("degradations", list_of(string))),
        record.required("given_to_true", array(4, 4)),
        record.required("size_factor", real),
    )


def _write_labels(
    degraded: DegradedCase, path: Path, label_ids: Mapping[str, Sequence[int]] | None
) -> dict[str, list[int]]:
    """Write the segmentation and return the labels of each structure."""
    names = degraded.structures.names
    if label_ids is None or degraded.source_labels is None:
        write_volume(Volume(degraded.structures.labels, degraded.ct.affine), path)
        return {name: [number] for number, name in enumerate(names, start=1)}
    missing = [name for name in names if name not in label_ids]
    if missing:
        raise InputError(f"label_ids lacks the structure {missing[0]!r}: give the labels of every structure.")
    write_volume(degraded.source_labels, path)
    return {name: [int(label) for label in label_ids[name]] for name in names}


def _write_xray(degraded: DegradedCase, number: int, folder: Path) -> dict[str, Any]:
    """Write one view and return its entry in the study."""
    view = degraded.views[number]
    stated = view.stated
    entry: dict[str, Any] = {
        "name": f"view {number + 1}",
        "image": f"xray_{number + 1}.{'png' if view.grey_bits else 'dcm'}",
        "source_to_detector_mm": stated.source_to_detector_mm,
        "pixel_spacing_mm": list(stated.pixel_spacing_mm),
    }
    path = folder / entry["image"]
    _write_grey(view, path) if view.grey_bits else _write_dicom(degraded, view, path)
    if stated.principal_point_px is not None:
        entry["principal_point_px"] = list(stated.principal_point_px)
    if degraded.camera_state == "absent":
        return entry
    return entry | {"extrinsic": stated.extrinsic.tolist(), "camera": degraded.camera_state}


def _write_grey(view: View, path: Path) -> None:
    """A gray picture whose levels are those of the view's bits, in the upper part of 8 or 16."""
    import SimpleITK as sitk

    levels = np.rint(view.image.astype(np.float64) * (2**view.grey_bits - 1))
    stored = levels.astype(np.uint8) if view.grey_bits <= 8 else levels.astype(np.uint16)
    sitk.WriteImage(sitk.GetImageFromArray(stored), str(path))


def _write_dicom(degraded: DegradedCase, view: View, path: Path) -> None:
    """An XA file in the bits that were measured; its distances and angles are those that the study states."""
    physics, stated = degraded.physics, view.stated
    stand = Stand(
        source_to_detector_mm=stated.source_to_detector_mm,
        pixel_spacing_mm=stated.pixel_spacing_mm,
        extrinsic=stated.extrinsic,
    )
    storage = Storage(
        bits=max(physics.bits, 8) if physics.bits else 16,
        encoding=physics.encoding,
        saturation=physics.saturation,
    )
    study = f"simulated case {degraded.case.seed}"
    write_xray_dicom(path, view.image, stand, storage, description=path.stem, study=study)
