"""The page on joint angles names every convention, quantity, landmark and field that there is, and no others."""

import dataclasses
import json
import re

from pages import DOCS, code_blocks

from PolyPoseLib.data.tracking.joint_motion import SOURCES_OF_AXES
from PolyPoseLib.data.tracking.joints import CONVENTIONS, SIDES, Joint
from PolyPoseLib.io.tracking.joint_schema import FIELDS, check_landmark_names, joints
from PolyPoseLib.kinematics.conventions import CONVENTION_TABLE
from PolyPoseLib.kinematics.landmark_axes import GIVEN, LANDMARK_NAMES, RECIPES

PAGE = DOCS / "joint-angles.md"


def section(title: str) -> list[list[str]]:
    """Rows of a section's tables, each a list of cells."""
    text = PAGE.read_text(encoding="utf-8").split(f"## {title}\n")[1].split("\n## ")[0]
    rows = [
        line.strip("| ").split(" | ")
        for line in text.splitlines()
        if line.startswith("| `") or "any convention" in line
    ]
    return [[cell.strip() for cell in row] for row in rows]


def codes(text: str) -> list[str]:
    return re.findall(r"`([^`]+)`", text)


def test_the_fields_of_a_joint() -> None:
    assert [codes(row[0])[0] for row in section("Ask for a joint")] == list(FIELDS)
    assert list(FIELDS) == [field.name for field in dataclasses.fields(Joint)]
    side = next(row for row in section("Ask for a joint") if row[0] == "`side`")
    assert set(SIDES) <= set(codes(side[1]))


def test_the_example_is_read() -> None:
    (block,) = code_blocks(PAGE, "js")
    example = json.loads(block)
    bones = ("femur_left", "tibia_left")
    (joint,) = joints(bones)(example["joints"], '"joints"')
    check_landmark_names(example["landmarks"], bones, '"landmarks"')
    assert joint.convention == "grood_suntay"


def test_angles_and_translations() -> None:
    rows = section("Angles and translations")
    angles = {codes(row[0])[0]: [codes(cell)[0] for cell in row[1:]] for row in rows if len(row) == 4}
    shifts = {name: codes(row[1]) for row in rows if len(row) == 3 for name in codes(row[0])}
    along = {name: row[2] for row in rows if len(row) == 3 for name in codes(row[0])}
    for name, table in CONVENTION_TABLE.items():
        assert angles[name] == [each.name for each in table.angles]
        assert shifts[name] == [each.name for each in table.translations]
        assert ("joint's" in along[name]) == table.along_joint
    assert set(angles) == set(shifts) == set(CONVENTIONS)


def test_landmarks() -> None:
    named = {name for row in section("Landmarks") for name in codes(row[1])}
    assert named == set(LANDMARK_NAMES)
    for convention, sides in RECIPES.items():
        own = {name for row in section("Landmarks") if convention in codes(row[0]) for name in codes(row[1])}
        assert own == {name for side in sides for entry in side for name in entry.landmarks}
    (any_bone,) = (row for row in section("Landmarks") if row[0].startswith("any convention"))
    assert set(codes(any_bone[1])) == set(GIVEN.landmarks)


def test_sources_of_axes() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"- **`{source}`**" in text for source in SOURCES_OF_AXES)
