"""Small anatomy is registered as if it were larger; nobody sees that in the result."""

from dataclasses import replace

import numpy as np
import pytest
from result_case import make_result

from PolyPoseLib.data.options import USUAL_EPSILON, Options
from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.pipeline import _soft_tissue, register
from PolyPoseLib.registration.magnification import LARGEST, at_true_size, magnification_of, magnified
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.simulation.case_study import case_to_study

SMALL = 0.3


@pytest.fixture(scope="module")
def study(simulated):
    """Of a phantom so large that it is taken as it is, with a quick preset."""
    plain = replace(case_to_study(simulated), options={"preset": "fast"})
    return magnified(plain, 1.05 * magnification_of(plain))


@pytest.mark.parametrize("factor", [0.2, 0.4, 0.7])
def test_anatomy_is_magnified_to_one_size(study, factor):
    assert magnification_of(study) == 1
    small = magnified(study, factor)
    needed = magnification_of(small)
    assert needed > 1
    assert magnification_of(magnified(small, needed)) == pytest.approx(1)
    assert magnification_of(magnified(small, needed / 1.2)) == pytest.approx(1.2)
    assert magnification_of(magnified(study, 1e-3)) == LARGEST


def test_epsilon_is_in_the_patients_millimetres_stated_or_not(study):
    small = magnified(study, 0.5)
    usual, stated = (
        _soft_tissue(small, Options(weights="epsilon", epsilon=epsilon), PRESETS["default"], 2.0, None)
        for epsilon in (None, USUAL_EPSILON)
    )
    assert usual.epsilon == stated.epsilon == USUAL_EPSILON / 4


@pytest.mark.parametrize("factor", [0.25, 3.0])
def test_projections_stay_where_they_were(study, simulated, factor):
    points = np.random.default_rng(0).uniform(-50, 50, (20, 3))
    for xray, other in zip(study.xrays, magnified(study, factor).xrays, strict=True):
        cameras = (simulated.cameras[0].with_extrinsic(each.extrinsic) for each in (xray, other))
        plain, scaled = (
            camera.project(p) for camera, p in zip(cameras, (points, factor * points), strict=True)
        )
        np.testing.assert_allclose(scaled, plain, atol=1e-6)
        np.testing.assert_allclose(other.image, factor * xray.image, rtol=1e-5)
        np.testing.assert_allclose(other.intrinsics, xray.intrinsics)
        assert other.source_to_detector_mm == pytest.approx(factor * xray.source_to_detector_mm)


def test_a_result_comes_back_in_millimetres():
    fields = {
        "covariance": np.diag(np.random.default_rng(0).random(6)).tolist(),
        "level": 0.95,
        "along_mm": 4.0,
        "across_mm": [1.0, 2.0],
        "rotation_about_view_deg": 3.0,
    }
    one = StructureResult.from_pose(np.eye(4), np.array([1.0, 2.0, 3.0]), fields)
    large = replace(make_result(), structures={"bone": one})
    small = at_true_size(large, 4.0)
    stated = small.structures["bone"].uncertainty
    assert stated is not None and stated["along_mm"] == 1.0 and stated["across_mm"] == [0.25, 0.5]
    assert stated["rotation_about_view_deg"] == 3.0
    scale = np.r_[np.ones(3), np.full(3, 16.0)]
    np.testing.assert_allclose(np.diag(fields["covariance"]), scale * np.diag(stated["covariance"]))
    np.testing.assert_allclose(small.structures["bone"].centroid, [0.25, 0.5, 0.75])
    np.testing.assert_allclose(4 * small.transform.vectors, large.transform.vectors, rtol=1e-6)
    np.testing.assert_allclose(4 * small.transform.affine[:3], large.transform.affine[:3])
    np.testing.assert_allclose(4 * small.warped_ct.affine[:3], large.warped_ct.affine[:3])
    np.testing.assert_allclose(small.soft_tissue_deviation_mm, [0.2, 0.4, 1.0])
    for camera, other in zip(small.cameras, large.cameras, strict=True):
        np.testing.assert_allclose(camera.extrinsic[:3, :3], other.extrinsic[:3, :3])
        np.testing.assert_allclose(4 * camera.extrinsic[:3, 3], other.extrinsic[:3, 3])


def test_small_anatomy_is_found_as_exactly_for_its_size(study):
    """At the size at which it is registered anyway it takes the same steps, but for rounding.

    Rounding decides when the solver stops: it ends well within the stated intervals, of 4 mm and 3 to 6 degrees.
    """
    small = magnified(study, SMALL)
    factor = magnification_of(small)
    assert factor > 2
    right, found = register(magnified(small, factor)), register(small)
    for name, expected in right.structures.items():
        pose, scaled = found.structures[name].fixed_to_moving, expected.fixed_to_moving
        np.testing.assert_allclose(pose[:3, :3], scaled[:3, :3], atol=1.2e-2)
        np.testing.assert_allclose(factor * pose[:3, 3], scaled[:3, 3], atol=1.2)
        stated, reference = found.structures[name].uncertainty, expected.uncertainty
        assert (stated is None) is (reference is None) is (name == study.anchor)
        if stated is not None and reference is not None:
            assert factor * stated["along_mm"] == pytest.approx(reference["along_mm"], rel=0.3)
    np.testing.assert_allclose(found.warped_ct.affine, small.ct.affine, atol=1e-9)
