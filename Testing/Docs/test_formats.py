"""The pages on file formats say what the program reads and writes, no less and no more."""

from __future__ import annotations

import dataclasses
import json

import pytest
from pages import DOCS, PAGES, ROOT, code_blocks, name_of, table_names

from PolyPoseLib.data.options import Options
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.xray.fields import FIELDS
from PolyPoseLib.io.xray.intensity import INTENSITIES

STUDY = DOCS / "study-format.md"
RESULT = DOCS / "result-format.md"


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


def test_the_meanings_of_pixel_values() -> None:
    section = STUDY.read_text(encoding="utf-8").split("Values of `intensity`:")[1].split("## ")[0]
    assert all(f"| `{meaning}` |" in section for meaning in INTENSITIES)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_studies_on_pages_are_valid(page) -> None:
    for text in code_blocks(page, "json"):
        study_schema.check(json.loads(text), name_of(page))


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
