"""Truths and uncertainties that were changed are refused in one sentence, and those that are whole are scored."""

import copy
import json
from types import SimpleNamespace

import numpy as np
import pytest
from simulation_phantom import NAMES, phantom

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.io.truths import load_truth, save_truth
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras
from PolyPoseLib.simulation.truth import truth_of

STATED = {
    "covariance": np.eye(6).tolist(), "level": 0.95, "along_mm": 1.0, "across_mm": [0.5, 0.5],
    "rotation_about_view_deg": 1.0, "rotation_across_deg": [1.0, 1.0],
    "directions": {"along": [0, 1, 0], "across": [[1, 0, 0], [0, 0, 1]]},
}  # fmt: skip


@pytest.fixture(scope="module")
def truth():
    ct, structures, source = phantom(spacing=(6.0, 6.0, 6.0))
    cameras = view_cameras(ct, pixels=16, detector_mm=350)
    still = dict.fromkeys(NAMES[1:], np.eye(4))
    quick = SimulationOptions(projector="sum", node_mm=6.0, pad_mm=10.0)
    return truth_of(simulate_case(ct, structures, still, cameras, 1, quick, NAMES[0], source))


@pytest.fixture(scope="module")
def folder(truth, tmp_path_factory):
    """A truth's folder, and the text of its truth.json."""
    folder = save_truth(truth, tmp_path_factory.mktemp("saved") / "truth")
    return folder, (folder / "truth.json").read_text()


def perfect(truth, uncertainty):
    """A result that is the truth, with an uncertainty stated for the second structure."""
    structures = {
        name: SimpleNamespace(fixed_to_moving=truth.fixed_to_moving[name], uncertainty=None) for name in NAMES
    }
    structures[NAMES[1]].uncertainty = uncertainty
    return SimpleNamespace(
        structures=structures,
        cameras=truth.cameras,
        transform=truth.field,
        seconds={},
        warnings=[],
        distrust=(),
    )


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("anchor",), "nobody", '"anchor" is "nobody"; give one of'),
        (("anchor",), [], r'"anchor" is \[\]; give one of'),
        (("structures",), {}, "is {}; give at least one structure"),
        (("structures", "more"), np.eye(4).tolist(), '"moving_labels" shows nothing of "more"'),
        (("structures", NAMES[1]), [[10**400] * 4] * 4, "401 digits"),
        (("structures", NAMES[1]), np.diag([-1, 1, 1, 1]).tolist(), "reflection"),
        (("cameras",), 5, "truth.json"),
        (("cameras", 0, "extrinsic"), [[10**400] * 4] * 4, "401 digits"),
        (("cameras", 0, "extrinsic"), [[0] * 4] * 4, r'"cameras"\[0\]."extrinsic"'),
        (("cameras", 0, "intrinsics"), [[0] * 3] * 3, r'"cameras"\[0\]."intrinsics"'),
        (("cameras", 0, "height"), "x", r'"cameras"\[0\]."height" is "x"'),
    ],
)
def test_a_changed_truth_is_refused(folder, place, value, words):
    folder, text = folder
    fields = inner = json.loads(text)
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = value
    (folder / "truth.json").write_text(json.dumps(fields))
    with pytest.raises(InputError, match=words) as caught:
        load_truth(folder)
    assert str(folder) in str(caught.value)


@pytest.mark.parametrize("text", ["[]", "null", "[" * 100_000, '{"version": ' + "1" * 5000 + "}"])
def test_a_truth_that_is_no_object_is_refused(folder, text):
    (folder[0] / "truth.json").write_text(text)
    with pytest.raises(InputError, match=r"truth\.json"):
        load_truth(folder[0])


def test_volumes_of_different_grids_are_refused(folder, truth):
    folder, text = folder
    (folder / "truth.json").write_text(text)
    write_volume(Volume(np.ones((5, 6, 7), np.uint8), np.eye(4)), folder / "fixed_labels.nii.gz")
    with pytest.raises(InputError, match="differ in grid"):
        load_truth(folder)


def test_a_whole_uncertainty_is_scored_and_one_of_infinite_numbers_left_out(truth):
    row = score_result(perfect(truth, STATED), truth)["structures"][NAMES[1]]
    assert max(row["interval_ratios"].values()) < 1e-6
    row = score_result(perfect(truth, {**STATED, "along_mm": None}), truth)["structures"][NAMES[1]]
    assert "interval_ratios" not in row and row["uncertainty"]["along_mm"] is None


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        ((), {}, "lacks"),
        (("covariance",), np.zeros((6, 6)).tolist(), "not positive definite"),
        (("covariance",), np.diag([1, 1, 1, 1, 1, -1]).tolist(), "not positive definite"),
        (("covariance",), [[0]], 'lacks "covariance"'),
        (("covariance",), [[1], [1, 2]], 'lacks "covariance"'),
        (("covariance",), "x", 'lacks "covariance"'),
        (("along_mm",), 0, '"along_mm" that is not above 0'),
        (("across_mm",), [1.0, -1.0], '"across_mm" that is not above 0'),
        (("rotation_across_deg",), 10**400, 'lacks "rotation_across_deg"'),
        (("directions",), None, 'lacks "along"'),
        (("directions", "across"), [[1, 0, 0]], 'lacks "across"'),
    ],
)
def test_a_changed_uncertainty_is_refused(truth, place, value, words):
    stated = copy.deepcopy(STATED) if place else value
    inner = stated
    for name in place[:-1]:
        inner = inner[name]
    if place:
        inner[place[-1]] = value
    with pytest.raises(InputError, match=words) as caught:
        score_result(perfect(truth, stated), truth)
    assert NAMES[1] in str(caught.value)
