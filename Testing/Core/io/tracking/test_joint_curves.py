"""joints.json read back for plots, and refused where it is damaged."""

import json

import numpy as np
import pytest
from joint_case import random_rigid, sequence_of, track_of

from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.joint_curves import load_joint_curves
from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
from PolyPoseLib.kinematics.joint_motions import joint_motions

DOUBTS = [((), ()), ((), ("unsure",)), ((), ()), (("unsure",), ())]


def written(folder):
    """Motions of two joints over four frames, in the third of which a bone is lost."""
    rng = np.random.default_rng(3)
    poses = np.array([[random_rigid(rng), random_rigid(rng)] for _ in range(4)])
    poses[2, 1] = np.nan
    sequence = sequence_of(
        [Joint("knee", "upper", "lower", "grood_suntay", "right"), Joint("j", "lower", "upper")]
    )
    found = track_of(sequence, poses, np.eye(6) * 1e-4, doubts=DOUBTS)
    motions = joint_motions(found, sequence)
    write_joint_tables(found, motions, folder)
    return motions


def test_every_number_comes_back(tmp_path):
    motions = written(tmp_path)
    read = load_joint_curves(tmp_path)
    assert [each.name for each in read] == ["knee", "j"]
    for motion, joint in zip(motions, read, strict=True):
        np.testing.assert_array_equal(joint.frames, motion.frames)
        np.testing.assert_allclose(joint.seconds, motion.seconds, atol=1e-6)
        np.testing.assert_array_equal(joint.doubtful, motion.doubtful)
        for curves, values, halves in (
            (joint.angles, motion.angles_deg, motion.angles_95_deg),
            (joint.translations, motion.translations_mm, motion.translations_95_mm),
        ):
            np.testing.assert_allclose(np.stack([each.values for each in curves], 1), values, atol=1e-6)
            np.testing.assert_allclose(
                np.stack([each.half_widths_95 for each in curves], 1), halves, atol=1e-6
            )
    assert [each.name for each in read[0].angles] == ["flexion", "adduction", "external_rotation"]
    assert np.isnan(read[0].angles[0].values[2]) and np.isfinite(read[0].angles[0].values[3])


def test_a_track_without_joints_has_none(tmp_path):
    assert load_joint_curves(tmp_path) == ()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda record: record.update(version=9), "version"),
        (lambda record: record.update(frame=[0, 2, 1, 3]), "order of time"),
        (lambda record: record.update(time_s=[0.0]), "time_s"),
        (lambda record: record["joints"][1].update(doubtful=[True]), "doubtful"),
        (lambda record: record["joints"][0]["angles"][2].update(deg=[1.0, 2.0]), "deg"),
        (lambda record: record["joints"][0]["translations"][0].pop("half_width_95_mm"), "half_width_95_mm"),
        (lambda record: record["joints"][0].update(name=""), "name"),
    ],
)
def test_a_damaged_file_is_refused_in_one_sentence_that_names_it(tmp_path, change, told):
    written(tmp_path)
    path = tmp_path / "joints.json"
    record = json.loads(path.read_text("utf-8"))
    change(record)
    path.write_text(json.dumps(record), "utf-8")
    with pytest.raises(InputError, match=told) as refused:
        load_joint_curves(tmp_path)
    assert str(path) in str(refused.value) and "\n" not in str(refused.value)
