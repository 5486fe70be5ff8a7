"""Files of corrected poses: number for number what was written, or one sentence."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from json_values import assert_one_sentence, changed
from result_case import random_pose

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.corrected_poses import read_corrected_poses, write_corrected_poses

NAMES = ("tibia", "talus")
POSES = {name: random_pose(np.random.default_rng(n), 90, 300) for n, name in enumerate(NAMES)}
FIELDS = {"version": 1, "poses": {name: pose.tolist() for name, pose in POSES.items()}}


def test_what_is_read_is_what_was_written(tmp_path):
    write_corrected_poses(tmp_path / "poses.json", POSES)
    found = read_corrected_poses(tmp_path / "poses.json", NAMES)
    assert list(found) == list(NAMES) and all(np.array_equal(found[name], POSES[name]) for name in NAMES)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"poses": {}}, '"poses" is empty'),
        ({"poses": {"femur": np.eye(4).tolist()}}, 'structure "femur"'),
        ({"poses": {"talus": [[1, 0], [0, 1]]}}, '"poses"."talus"'),
        ({"version": 2}, "version 2 is not 1"),
        ({"pose": {}}, 'field "pose"'),
    ],
)
def test_what_is_wrong_is_named(tmp_path, changes, says):
    path = tmp_path / "poses.json"
    path.write_text(json.dumps({**FIELDS, **changes}))
    with pytest.raises(InputError) as error:
        read_corrected_poses(path, NAMES)
    assert says in str(error.value) and str(path) in str(error.value)
    assert_one_sentence(error)


@given(changed(FIELDS))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_file_ends_in_poses_or_one_sentence(tmp_path, fields):
    path = tmp_path / "poses.json"
    path.write_text(json.dumps(fields))
    try:
        poses = read_corrected_poses(path, NAMES)
    except InputError as error:
        assert_one_sentence(error)
    else:
        assert poses and set(poses) <= set(NAMES)
        assert all(np.linalg.det(pose) == pytest.approx(1) for pose in poses.values())
