"""The pages on file formats say what the program reads and writes, no less and no more."""

from __future__ import annotations

import dataclasses
import json
import re

import pytest
from pages import DOCS, PAGES, ROOT, code_blocks, name_of, table_names

from PolyPoseLib.data.options import Options
from PolyPoseLib.data.paper_options import PaperOptions
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.cohort.bids_layout import SOURCE_IGNORED
from PolyPoseLib.io.cohort.rows import COLUMNS as COHORT_COLUMNS
from PolyPoseLib.io.tracking import schema as track_schema
from PolyPoseLib.io.tracking.corrected_poses import poses_of
from PolyPoseLib.io.tracking.poses_table import COLUMNS
from PolyPoseLib.io.xray.fields import FIELDS
from PolyPoseLib.io.xray.intensity import INTENSITIES

STUDY = DOCS / "study-format.md"
RESULT = DOCS / "result-format.md"
TRACK = DOCS / "tracking.md"
COHORTS = DOCS / "cohorts.md"


def test_the_columns_of_a_cohorts_table() -> None:
    section = COHORTS.read_text(encoding="utf-8").split("### The table\n", 1)[1]
    rows = re.search(r"(?:^\|.*\n)+", section, re.M)[0].splitlines()[2:]
    assert [re.match(r"\| `(\w+)` \|", row)[1] for row in rows] == list(COHORT_COLUMNS)


def test_the_page_on_cohorts_lists_what_bids_does_not_know() -> None:
    assert "\n".join(SOURCE_IGNORED) in [block.strip() for block in code_blocks(COHORTS, "text")]


def test_the_fields_of_a_study() -> None:
    assert sorted(table_names(STUDY, "Fields of a study")) == sorted(
        (*study_schema.REQUIRED, *study_schema.OPTIONAL)
    )


def test_the_fields_of_an_xray() -> None:
    known = (*FIELDS, *study_schema.MORE_XRAY_FIELDS)
    assert sorted(table_names(STUDY, "Fields of an X-ray")) == sorted(known)


def test_the_options() -> None:
    known = [field.name for field in dataclasses.fields(Options)]
    assert sorted(table_names(STUDY, "Options")) == sorted(known)


def test_the_options_of_the_preset_paper() -> None:
    defaults = {field.name: field.default for field in dataclasses.fields(PaperOptions)}
    section = STUDY.read_text(encoding="utf-8").split("### Options of the preset `paper`\n", 1)[1]
    rows = re.search(r"(?:^\|.*\n)+", section, re.M)[0].splitlines()[2:]
    told = dict(re.match(r"\| `(\w+)` \| (\S+) \|", row).groups() for row in rows)
    assert told == {
        name: f"`{value}`"
        if isinstance(value, str)
        else str(value).lower()
        if isinstance(value, bool)
        else f"{value:g}"
        for name, value in defaults.items()
    }


def names_in_first_column(heading: str, level: str = "###") -> list[str]:
    """All names in code type in the first column of the first table under a heading of the page on tracking."""
    section = TRACK.read_text(encoding="utf-8").split(f"{level} {heading}\n", 1)[1].split("\n##", 1)[0]
    rows = re.search(r"(?:^\|.*\n)+", section, re.M)[0].splitlines()[2:]
    return [name for row in rows for name in re.findall(r"`(\w+)`", row.split(" | ")[0])]


def test_the_fields_of_a_sequence_and_of_its_cameras() -> None:
    assert sorted(names_in_first_column("Fields of a sequence")) == sorted(
        (*track_schema.REQUIRED, *track_schema.OPTIONAL)
    )
    assert sorted(names_in_first_column("Fields of a camera")) == sorted(track_schema.CAMERA_FIELDS)


def test_the_options_of_a_tracking() -> None:
    known = [field.name for field in dataclasses.fields(TrackOptions)]
    assert sorted(names_in_first_column("Options of a tracking")) == sorted(known)


def test_the_columns_of_poses() -> None:
    text = TRACK.read_text(encoding="utf-8").split("| columns of `poses.csv` |")[1].split("\n\n")[0]
    for name in re.findall(r"`([a-z]\w+)`", text):
        assert name in COLUMNS


def test_the_meanings_of_pixel_values() -> None:
    section = STUDY.read_text(encoding="utf-8").split("Values of `intensity`:")[1].split("## ")[0]
    assert all(f"| `{meaning}` |" in section for meaning in INTENSITIES)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_studies_on_pages_are_valid(page) -> None:
    for text in code_blocks(page, "json"):
        fields = json.loads(text)
        if set(fields) == {"version", "poses"}:
            assert poses_of(fields, list(fields["poses"]), name_of(page))
            continue
        check = track_schema.check if "cameras" in fields else study_schema.check
        check(fields, name_of(page))


def test_the_citation_is_valid() -> None:
    yaml = pytest.importorskip("yaml")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert str(citation["cff-version"]) == "1.2.0"
    assert {"message", "title", "authors", "version"} <= set(citation)
    paper = citation["preferred-citation"]
    assert [author["family-names"] for author in paper["authors"]] == ["Gopalakrishnan", "Dey", "Golland"]
    assert paper["title"] in (ROOT / "README.md").read_text(encoding="utf-8").replace("\n", " ")


def test_the_versions_agree() -> None:
    from PolyPoseLib import __version__

    assert f"version: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## {__version__} - " in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
