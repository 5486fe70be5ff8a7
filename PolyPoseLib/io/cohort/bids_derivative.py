"""What makes a cohort's folder a BIDS derivative: its description, and a list of what BIDS does not know."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib import __version__
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.bids_layout import DESCRIPTION, RESULT_SUFFIX
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import json_text, parse_object
from PolyPoseLib.io.whole_files import replaced_whole

BIDS_VERSION = "1.10.0"
"""Whose rules the description follows."""

CODE_URL = "https://github.com/PolyPose/SlicerPolyPose"

IGNORED = (
    f"*{RESULT_SUFFIX}",
    "outcomes",
    "logs",
    "cohort.json",
    "index.html",
    "summary.csv",
    "summary.parquet",
)
"""Of a cohort's folder, that BIDS has no names for."""

README = """Registrations of each subject's CT to its X-rays by PolyPose, a derivative of the data set that
dataset_description.json names.

sub-XX/[ses-YY/]STUDY_polypose/ is a result's folder, whose README.txt says what its files are. index.html lists all
studies, the worst first. summary.csv and summary.parquet hold the motion of every structure of every study; outcomes/
and logs/ what became of each. Research software, not for clinical decisions.
"""


def write_description(folder: Path, source: Path) -> None:
    """Write the description, the list and the README of a derivative of the data set at ``source``.

    Only the source's name is taken over, no address and no path.
    """
    texts = {
        DESCRIPTION: json_text(_description(source)),
        ".bidsignore": "".join(f"{each}\n" for each in IGNORED),
        "README": README,
    }
    for name, text in texts.items():
        with replaced_whole(folder / name) as path:
            path.write_text(text, encoding="utf-8")


def _description(source: Path) -> dict[str, object]:
    given = parse_object(read_text(source / DESCRIPTION, "the data set's description"), str(source))
    links = {"SourceDatasets": [{"DOI": given["DatasetDOI"]}]} if given.get("DatasetDOI") else {}
    name = given.get("Name")
    if not isinstance(name, str):
        raise InputError(f'{source / DESCRIPTION}: "Name" is no text: give one.')
    return {
        "Name": f"PolyPose registrations of {name}",
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "derivative",
        "GeneratedBy": [{"Name": "PolyPose", "Version": __version__, "CodeURL": CODE_URL}],
        **links,
    }
