"""The whole registration on a phantom whose truth the product's model did not make."""

import itertools

import numpy as np
import pytest
from phantom_study import case, study

from PolyPoseLib.data.result import Result
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.evaluation.score import score_result
from PolyPoseLib.pipeline import register
from PolyPoseLib.simulation.truth import truth_of


@pytest.fixture(scope="module")
def simulated():
    return case()


@pytest.fixture(scope="module")
def reports() -> list:
    return []


@pytest.fixture(scope="module")
def result(simulated, reports, tmp_path_factory) -> Result:
    preview = str(tmp_path_factory.mktemp("preview") / "preview.h5")
    return register(study(simulated, {"preview": preview}), progress=reports.append)


def test_bones_are_found(simulated, result: Result) -> None:
    scores = score_result(result, truth_of(simulated))
    assert not result.distrust
    assert scores["summary"]["mean_pose_tre_mm"] < 1.5
    assert scores["summary"]["mean_pose_tre_mm"] < 0.35 * scores["summary"]["mean_rest_tre_mm"]
    assert scores["summary"]["folds_percent"] == 0


def test_the_anchor_defines_the_cameras(simulated, result: Result) -> None:
    np.testing.assert_array_equal(result.structures["pelvis"].fixed_to_moving, np.eye(4))
    for found, true in zip(result.cameras, simulated.cameras, strict=True):
        assert np.abs(found.extrinsic - true.extrinsic)[:3, :3].max() < 0.02


def test_the_label_maps_numbers_are_told(simulated, result: Result) -> None:
    assert result.segmentation_labels == tuple(range(1, len(simulated.structures.names) + 1))


def test_progress_goes_forward_and_previews_come(reports, result: Result) -> None:
    assert all(0 <= each.iteration <= each.of for each in reports)
    assert all(a.seconds <= b.seconds for a, b in itertools.pairwise(reports))
    assert reports[-1].stage == "done"
    assert any(each.preview for each in reports)


def test_same_study_same_result_bit_for_bit(simulated, result: Result) -> None:
    again = register(study(simulated))
    for name, structure in result.structures.items():
        np.testing.assert_array_equal(structure.fixed_to_moving, again.structures[name].fixed_to_moving)
    np.testing.assert_array_equal(result.warped_ct.voxels, again.warped_ct.voxels)


@pytest.mark.long
def test_the_default_is_not_worse_than_the_published_method(simulated, result: Result) -> None:
    truth = truth_of(simulated)
    published = register(study(simulated, {"preset": "paper", "uncertainty": False}))
    ours, theirs = (score_result(each, truth)["structures"] for each in (result, published))
    for name in ("femur_left", "vertebra_L5"):
        assert ours[name]["pose_tre_mean_mm"] <= theirs[name]["pose_tre_mean_mm"], name


@pytest.mark.parametrize("after", [1, 4, 15])
def test_cancelling_stops_at_the_next_iteration(simulated, after: int) -> None:
    asked = []

    def cancel() -> bool:
        asked.append(True)
        return len(asked) >= after

    with pytest.raises(CancelledError):
        register(study(simulated, {"preset": "fast"}), cancel=cancel)
    assert len(asked) == after


def test_known_cameras_are_left_alone(simulated) -> None:
    result = register(study(simulated, {"preset": "fast"}, camera="known"))
    for found, true in zip(result.cameras, simulated.cameras, strict=True):
        np.testing.assert_allclose(found.extrinsic, true.extrinsic, atol=1e-9)


@pytest.mark.long
def test_wrong_x_rays_are_not_trusted(simulated) -> None:
    given = study(simulated, {"preset": "fast"})
    rng = np.random.default_rng(5)
    noise = [
        x.__class__(**{**x.__dict__, "image": rng.normal(3, 1, x.image.shape).astype(np.float32)})
        for x in given.xrays
    ]
    wrong = given.__class__(given.ct, given.structures, given.anchor, tuple(noise), given.options)
    assert register(wrong).distrust


def test_x_rays_that_show_the_anchor_alone_leave_wide_intervals(simulated) -> None:
    given = study(simulated, {"preset": "fast"}, camera="known")
    bare = [
        x.__class__(
            **{**x.__dict__, "intrinsics": x.intrinsics + np.array([[0, 0, 500.0], [0, 0, 0], [0, 0, 0]])}
        )
        for x in given.xrays[:1]
    ]
    aside = given.__class__(given.ct, given.structures, given.anchor, (*bare, given.xrays[1]), given.options)
    result = register(aside)
    for name in ("femur_left", "vertebra_L5"):
        assert np.isfinite(result.structures[name].uncertainty["along_mm"])
    assert result.distrust  # the anchor is out of the first X-ray


def test_the_anchor_alone_with_known_cameras_is_a_study_too(simulated) -> None:
    given = study(simulated, {"preset": "fast"}, camera="known")
    pelvis = Structures(("pelvis",), np.where(given.structures.labels == 1, 1, 0).astype(np.int16))
    result = register(given.__class__(given.ct, pelvis, "pelvis", given.xrays, given.options))
    np.testing.assert_array_equal(result.structures["pelvis"].fixed_to_moving, np.eye(4))


@pytest.mark.parametrize("name", ["preview.txt", "nowhere/preview.h5"])
def test_a_preview_that_cannot_be_written_is_refused_at_once(simulated, tmp_path, name: str) -> None:
    steps = []
    with pytest.raises(InputError, match=r"ends in \.h5, in a folder that exists"):
        register(study(simulated, {"preview": str(tmp_path / name)}), progress=steps.append)
    assert not steps
