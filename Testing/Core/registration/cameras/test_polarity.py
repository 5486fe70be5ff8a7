"""X-rays whose gray levels run the other way than stated are found out, with a warning."""

from dataclasses import replace

import numpy as np
import pytest
from quiet_run import quiet_run

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import UntrustedResultError
from PolyPoseLib.registration.cameras.multistart import find_camera_near
from PolyPoseLib.registration.cameras.polarity import found_in_better_polarity, inverted
from PolyPoseLib.registration.cameras.study import CameraStage, find_study_cameras
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.simulation.case_study import case_to_study


class Camera:
    """What was found, reduced to its similarity."""

    def __init__(self, similarity: float) -> None:
        self.similarity = similarity


def xray(image: np.ndarray) -> Xray:
    return Xray(image, image > -1, np.diag([900.0, 900.0, 1.0]), None, "absent", (1.0, 1.0), 1000.0)


def finder(right: float, wrong: float, original: np.ndarray):
    """Finds cameras that are as similar as told for the image as it is, and inverted."""

    def find(xrays, search):
        similarity = right if np.array_equal(xrays[0].image, original) else wrong
        if similarity < 0:
            raise UntrustedResultError("no view shows the anchor")
        return [Camera(similarity)]

    return find


@pytest.mark.parametrize(
    ("as_given", "other", "turned"),
    [
        (0.9, 0.95, False),  # certain as it is: the other one is not even tried
        (0.5, 0.7, True),
        (0.5, 0.55, False),  # not clearly better
        (0.1, 0.35, False),  # better, and still not plausible
        (-1.0, 0.6, True),  # nothing was found as given
        (float("nan"), 0.9, False),  # nothing is known of the similarity
    ],
)
def test_the_other_polarity_is_taken_where_it_is_clearly_better(as_given, other, turned):
    image = np.arange(12.0, dtype=np.float32).reshape(3, 4)
    used, found = found_in_better_polarity([xray(image)], finder(as_given, other, image))
    assert np.array_equal(used[0].image, image) is not turned
    assert any("inverted" in line for line in used[0].warnings) is turned
    assert found[0].similarity == pytest.approx(other if turned else as_given, nan_ok=True)


def test_where_neither_shows_the_anchor_it_is_not_trusted():
    image = np.arange(12.0, dtype=np.float32).reshape(3, 4)
    with pytest.raises(UntrustedResultError, match="shows the anchor"):
        found_in_better_polarity([xray(image)], finder(-1.0, -1.0, image))


def test_pixels_outside_the_mask_do_not_set_the_new_zero():
    image = np.array([[1.0, 2.0], [5.0, 99.0]], np.float32)
    other = inverted(replace(xray(image), mask=np.array([[True, True], [True, False]])))
    np.testing.assert_array_equal(other.image, [[4.0, 3.0], [0.0, 0.0]])


@pytest.mark.parametrize("similarity", [0.5, 0.6])
def test_a_search_far_off_needs_more_than_a_plausible_match(similarity):
    """Among many directions some match plausibly by chance, in either polarity."""
    image = np.arange(12.0, dtype=np.float32).reshape(3, 4)

    def find(xrays, search):
        return [Camera(similarity if search and not np.array_equal(xrays[0].image, image) else 0.1)]

    used, _ = found_in_better_polarity([xray(image)], find)
    assert np.array_equal(used[0].image, image)


def test_the_cameras_of_inverted_pictures_are_those_of_the_right_ones(simulated, scene):
    """Known cameras stay, an initial one is refined; both notice."""
    plain = case_to_study(simulated)
    known = replace(plain.xrays[1], extrinsic=simulated.cameras[1].extrinsic, camera="known")
    xrays = [plain.xrays[0], known]
    turned = [replace(each, image=each.image.max() - each.image) for each in xrays]
    levels = PRESETS["fast"].camera_levels[:1]

    def refine(run, observation, source_to_detector_mm, search):
        return find_camera_near(run, observation, levels, source_to_detector_mm, search)

    stage = CameraStage(refine, levels)
    right, found = (find_study_cameras(quiet_run(scene), each, stage) for each in (xrays, turned))
    assert not any("inverted" in line for each in right.xrays for line in each.warnings)
    assert all(any("inverted" in line for line in each.warnings) for each in found.xrays)
    for one, other in zip(right.refined, found.refined, strict=True):
        np.testing.assert_allclose(one.camera.extrinsic, other.camera.extrinsic, atol=0.3)
        assert np.corrcoef(one.image.ravel(), other.image.ravel())[0, 1] > 0.999
