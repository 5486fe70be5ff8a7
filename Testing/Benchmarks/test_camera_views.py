"""A small part of the benchmark of cameras: a view of the pelvis is found, and views are the same in every run."""

import cameras
import numpy as np
import pytest
from benchmark_cases import load_anatomy

from PolyPoseLib.evaluation.metrics import mask_points
from PolyPoseLib.io.samples import cached_sample
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.select import select_backend

PIXELS = 200
VIEW = 1


@pytest.fixture(scope="module")
def pelvis():
    if cached_sample("pelvis") is None:
        pytest.skip(
            "the pelvis sample is not in the cache (python -m PolyPoseLib sample pelvis --output DIR)"
        )
    ct, structures, _labels, _organs = load_anatomy("pelvis")
    anchor = structures.names[0]
    points = mask_points(structures.mask(anchor), ct.affine, 1000)
    return ct, structures, Scene(ct, structures, anchor), points


@pytest.mark.long
def test_a_view_is_found(pelvis):
    ct, structures, scene, points = pelvis
    ((number, view, true, image),) = cameras.random_views(ct, structures, structures.names[0], PIXELS, {VIEW})
    assert number == VIEW
    found = cameras.find(scene, image, true, view, points, select_backend())
    assert found["sure"] and found["error_mm"] < cameras.FOUND_MM, found


def test_the_same_views_come_in_every_run(pelvis):
    ct, structures, _scene, _points = pelvis
    centre = structures.centroids(ct.affine)[0]
    first, again = (
        cameras.random_camera(np.random.default_rng([3, 7]), centre, "AP", PIXELS) for _ in range(2)
    )
    np.testing.assert_array_equal(first.extrinsic, again.extrinsic)
    turned = first.extrinsic[:3, :3] @ cameras.standard_view_rotation("AP").T
    assert np.degrees(np.arccos((np.trace(turned) - 1) / 2)) <= 45
