"""A process that is killed while it saves: the place holds the old or the new result, whole, and nothing else is left.

The default run hits every moment of a save with every signal. ``pytest -m kill Testing/Core/io`` hits each ten times
over, and 300 moments at random.
"""

import json
import os
import random
import sys

import numpy as np
import pytest
from killed_saves import (
    FILE_MOMENTS,
    FOLDER_MOMENTS,
    NEW_MOMENTS,
    SIGNALS,
    TWO_STEP_MOMENTS,
    Saver,
    file_fields,
)
from result_case import make_result

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.results import load_result

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="forks and signals are POSIX")

REPEATS = [pytest.param(1, id="once"), pytest.param(10, id="ten times", marks=pytest.mark.kill)]
OLD, NEW, NEXT = 1, 2, 3

ONE_OF_ALL = [SIGNALS[0], *(pytest.param(number, marks=pytest.mark.kill) for number in SIGNALS[1:])]
"""At chosen moments the kill that nothing can answer; the others come at random moments, and here with -m kill."""


@pytest.fixture(scope="module")
def saver():
    saver = Saver()
    yield saver
    saver.close()


@pytest.fixture(scope="module")
def expected():
    return {seed: make_result(seed) for seed in (OLD, NEW, NEXT)}


def seed_of(folder, expected) -> int:
    """Which result a folder holds; all of it is compared."""
    found = load_result(folder)
    for seed, result in expected.items():
        if np.array_equal(found.transform.vectors, result.transform.vectors):
            assert np.array_equal(found.warped_ct.voxels, result.warped_ct.voxels)
            assert np.array_equal(found.warped_labels.voxels, result.warped_labels.voxels)
            assert np.allclose(found.renderings_after, result.renderings_after)
            pose = result.structures["femur"].fixed_to_moving
            assert np.allclose(found.structures["femur"].fixed_to_moving, pose)
            return seed
    raise AssertionError("this is neither the old nor the new result")


def check_and_save_again(saver, folder, expected, status, number, may_be_absent=False, two_steps=False):
    """The properties that hold after every kill, and after the next save."""
    assert status in (0, -number, 130) and (status >= 0) == (number != SIGNALS[0])
    try:
        assert seed_of(folder, expected) in (OLD, NEW)
    except InputError:
        assert may_be_absent and not folder.exists()
    assert saver.save(folder, NEXT, two_steps=two_steps) == 0
    assert seed_of(folder, expected) == NEXT
    assert os.listdir(folder.parent) == [folder.name]


@pytest.mark.parametrize("repeats", REPEATS)
@pytest.mark.parametrize("number", ONE_OF_ALL)
@pytest.mark.parametrize("moment", FOLDER_MOMENTS)
def test_an_earlier_result_survives_or_is_replaced(saver, expected, tmp_path, moment, number, repeats):
    folder = tmp_path / "out"
    for _ in range(repeats):
        assert saver.save(folder, OLD) == 0
        status = saver.save(folder, NEW, moment, number)
        check_and_save_again(saver, folder, expected, status, number)


@pytest.mark.parametrize("repeats", REPEATS)
@pytest.mark.parametrize("number", ONE_OF_ALL)
@pytest.mark.parametrize("moment", TWO_STEP_MOMENTS)
def test_likewise_where_folders_cannot_be_exchanged(saver, expected, tmp_path, moment, number, repeats):
    folder = tmp_path / "out"
    for _ in range(repeats):
        assert saver.save(folder, OLD, two_steps=True) == 0
        status = saver.save(folder, NEW, moment, number, two_steps=True)
        check_and_save_again(saver, folder, expected, status, number, two_steps=True)


@pytest.mark.parametrize("repeats", REPEATS)
@pytest.mark.parametrize("number", ONE_OF_ALL)
@pytest.mark.parametrize("moment", NEW_MOMENTS)
def test_a_new_result_is_whole_or_absent(saver, expected, tmp_path, moment, number, repeats):
    for n in range(repeats):
        folder = tmp_path / str(n) / "out"
        folder.parent.mkdir()
        status = saver.save(folder, NEW, moment, number, overwrite=False)
        check_and_save_again(saver, folder, expected, status, number, may_be_absent=True)


@pytest.mark.parametrize("repeats", REPEATS)
@pytest.mark.parametrize("number", ONE_OF_ALL)
@pytest.mark.parametrize("moment", FILE_MOMENTS)
def test_a_file_is_the_old_or_the_new_one(saver, tmp_path, moment, number, repeats):
    path = tmp_path / "study.json"
    for _ in range(repeats):
        assert saver.save(path, OLD) == 0
        status = saver.save(path, NEW, moment, number)
        assert status in (0, -number, 130)
        assert json.loads(path.read_text()) in (file_fields(OLD), file_fields(NEW))
        assert saver.save(path, NEXT) == 0
        assert json.loads(path.read_text()) == file_fields(NEXT)
        assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize(
    "kills", [pytest.param(5, id="few"), pytest.param(100, id="many", marks=pytest.mark.kill)]
)
@pytest.mark.parametrize("number", SIGNALS)
def test_kills_at_random_moments(saver, expected, tmp_path, number, kills):
    folder, rng = tmp_path / "out", random.Random(int(number))
    for _ in range(kills):
        assert saver.save(folder, OLD) == 0
        status = saver.save(folder, NEW, number=number, after_seconds=rng.uniform(0, 0.12))
        assert status in (0, -number, 130)
        assert seed_of(folder, expected) in (OLD, NEW)
        assert saver.save(folder, NEXT) == 0
        assert os.listdir(tmp_path) == [folder.name]
