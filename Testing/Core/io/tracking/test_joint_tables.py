"""joints.csv and joints.json, read by others than wrote them."""

import csv
import json

import numpy as np
import pytest
from joint_case import random_rigid, sequence_of, track_of
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.joints import CONVENTIONS, Joint
from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
from PolyPoseLib.kinematics.conventions import CONVENTION_TABLE
from PolyPoseLib.kinematics.joint_motions import joint_motions

SPREAD = np.diag([1e-5] * 3 + [0.04] * 3)


def written(folder, frames=6, joints=None, **track):
    """Poses, motions, the table's rows and the record."""
    rng = np.random.default_rng(frames)
    poses = [[random_rigid(rng), random_rigid(rng)] for _ in range(frames)]
    joints = joints or [
        Joint("knee", "upper", "lower", "grood_suntay", "right"),
        Joint("=2,\n", "lower", "upper"),
    ]
    sequence = sequence_of(joints)
    found = track_of(sequence, poses, SPREAD, **track)
    motions = joint_motions(found, sequence)
    assert write_joint_tables(found, motions, folder) == ["joints.csv", "joints.json"]
    with (folder / "joints.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    return np.array(poses), motions, rows, json.loads((folder / "joints.json").read_text("utf-8"))


def test_the_table_has_a_line_for_each_frame_and_units_in_its_headers(tmp_path):
    _, (knee, _), rows, _ = written(tmp_path)
    assert [row["frame"] for row in rows] == ["0", "1", "2", "3", "4", "5"]
    np.testing.assert_allclose([float(row["time_s"]) for row in rows], np.arange(6) / 50, atol=1e-6)
    for place, name in enumerate(("flexion", "adduction", "external_rotation")):
        values = [float(row[f"knee.{name}_deg"]) for row in rows]
        halves = [float(row[f"knee.{name}_95_deg"]) for row in rows]
        np.testing.assert_allclose(values, knee.angles_deg[:, place], atol=1e-6)
        np.testing.assert_allclose(halves, knee.angles_95_deg[:, place], atol=1e-6)
    for place, name in enumerate(("lateral", "anterior", "distraction")):
        values = [float(row[f"knee.{name}_mm"]) for row in rows]
        np.testing.assert_allclose(values, knee.translations_mm[:, place], atol=1e-6)
    assert {row["knee.axes"] for row in rows} == {"inertia / inertia"}
    assert rows[0]["knee.helical_angle_deg"] == "0.000000" and rows[0]["knee.helical_point_x_mm"] == ""
    assert float(rows[1]["knee.helical_angle_deg"]) > 1
    units = ("frame", "time_s", "_deg", "_mm", "_x", "_y", "_z", ".gimbal_lock", ".doubtful", ".axes")
    assert all(header.endswith(units) and "\n" not in header for header in rows[0])
    assert any(header.startswith("=2, .about_z") for header in rows[0])  # one line, whatever the name holds


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_record_alone_gives_back_the_relative_pose(tmp_path, convention, side):
    """From angles, translations and axes as joints.json has them, to the motion from the CT: by scipy."""
    poses, _, _, record = written(tmp_path, joints=[Joint("j", "upper", "lower", convention, side)])
    (joint,) = record["joints"]
    table = CONVENTION_TABLE[convention]
    assert [each["name"] for each in joint["angles"]] == [each.name for each in table.angles]
    raw = np.stack([each["deg"] for each in joint["angles"]], axis=-1) * table.angle_signs
    turns = Rotation.from_euler(table.sequence.upper(), raw, degrees=True).as_matrix()
    shifts = np.stack([each["mm"] for each in joint["translations"]], axis=-1) * table.translation_signs
    if table.along_joint:  # components along three axes of which two are not perpendicular
        first = Rotation.from_euler("Z", raw[:, :1], degrees=True).apply([1, 0, 0])
        axes = np.stack([np.tile([0.0, 0, 1], (len(raw), 1)), first, turns[:, :, 1]], axis=1)
        shifts = np.linalg.solve(axes, shifts[:, :, None])[:, :, 0]
    near, far = (np.array(joint["axes"][bone]["axes_to_ct_lps_mm"]) for bone in ("proximal", "distal"))
    relative = np.tile(np.eye(4), (len(raw), 1, 1))
    relative[:, :3, :3], relative[:, :3, 3] = turns, shifts
    again = near @ relative @ np.linalg.inv(far)
    np.testing.assert_allclose(again, poses[:, 0] @ np.linalg.inv(poses[:, 1]), atol=1e-3)


def test_what_is_not_known_is_empty_and_null(tmp_path):
    sources = [("forward", "none" if n == 2 else "forward") for n in range(4)]
    doubts = [((), ("jump",) if n == 1 else ()) for n in range(4)]
    _, _, rows, record = written(tmp_path, 4, sources=sources, doubts=doubts)
    assert (
        rows[2]["knee.flexion_deg"]
        == rows[2]["knee.flexion_95_deg"]
        == rows[2]["knee.helical_angle_deg"]
        == ""
    )
    assert [row["knee.doubtful"] for row in rows] == ["no", "yes", "no", "no"]
    knee = record["joints"][0]
    assert knee["angles"][0]["deg"][2] is None and knee["angles"][0]["deg"][3] is not None
    assert knee["doubtful"] == [False, True, False, False]
    assert knee["axes"]["proximal"]["from"] == "inertia" and "inertia" in knee["warnings"][0]
    assert knee["helical_since_previous_frame"]["direction"][3] == [None, None, None]


def test_a_track_without_joints_has_no_tables(tmp_path):
    track = track_of(sequence_of(), [[np.eye(4), np.eye(4)]])
    assert write_joint_tables(track, (), tmp_path) == [] and not list(tmp_path.iterdir())
