"""The cone-beam reconstruction: where, how bright, and for which cameras."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ball_views import orbit, xray_of_balls
from scipy.spatial.transform import Rotation

from PolyPoseLib.baselines.aligned_views import align_views, rotation_axis
from PolyPoseLib.baselines.fdk import reconstruct
from PolyPoseLib.baselines.packages import is_installed
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

pytestmark = pytest.mark.skipif(not is_installed("itk.RTKPython"), reason="itk-rtk is not installed")

BALL = (np.array([24.0, -15.0, 19.0]), 16.0, 0.02)
WATER = (np.zeros(3), 60.0, 0.01)


def grid(turned=(0.0, 0.0, 0.0), handedness=1, shape=(34, 36, 38), spacing=4.0):
    axes = Rotation.from_rotvec(turned, degrees=True).as_matrix() @ np.diag([handedness, 1, 1])
    affine = np.eye(4)
    affine[:3, :3] = axes * spacing
    affine[:3, 3] = -affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    return Volume(np.zeros(shape, np.float32), affine)


def points(volume):
    index = np.stack(np.meshgrid(*map(np.arange, volume.shape), indexing="ij"), axis=-1)
    return volume.to_world(index[..., ::-1])


def centre_of_ball(volume):
    """Weighted mean of what is denser than the water around the ball."""
    near = np.linalg.norm(points(volume) - BALL[0], axis=-1) < 1.6 * BALL[1]
    weight = np.where(near, np.clip(volume.voxels - 0.02, 0, None), 0.0)
    return (points(volume) * weight[..., None]).sum((0, 1, 2)) / weight.sum()


@pytest.mark.parametrize(
    "cameras, where",
    [
        (orbit(60, 360), grid()),
        (orbit(60, 180), grid(turned=(20, -30, 10), handedness=-1)),
        (orbit(60, 360, turned=(25, -15, 40)), grid()),
        (orbit(60, 360, rolls=(0, 90, 180, 17), pixels=(88, 80), centre=(30.5, 52.0)), grid()),
        (orbit(60, 360, pixels=(96, 60), pitch_mm=(3.0, 6.0)), grid()),
    ],
    ids=[
        "full circle",
        "half circle, oblique left-handed grid",
        "tilted orbit",
        "rolled, off-centre",
        "oblong pixels",
    ],
)
def test_a_ball_is_reconstructed_where_it_is_and_as_dense_as_it_is(cameras, where):
    found = reconstruct([xray_of_balls(each, (WATER, BALL)) for each in cameras], where)
    distance = np.linalg.norm(points(found) - BALL[0], axis=-1)
    from_middle = np.linalg.norm(points(found), axis=-1)
    assert np.linalg.norm(centre_of_ball(found) - BALL[0]) < 0.7
    assert found.voxels[distance < 10].mean() == pytest.approx(0.03, rel=0.08)
    assert found.voxels[(distance > 24) & (from_middle < 45)].mean() == pytest.approx(0.01, rel=0.12)


def test_the_order_of_the_views_does_not_matter():
    xrays = [xray_of_balls(each, (WATER, BALL)) for each in orbit(9, 180)]
    first = reconstruct(xrays, grid())
    second = reconstruct([xrays[i] for i in (4, 8, 0, 2, 7, 1, 6, 3, 5)], grid())
    np.testing.assert_allclose(first.voxels, second.voxels, atol=1e-5)


def test_more_views_resemble_the_body_more_and_all_have_its_density():
    where = grid()
    x = points(where)
    truth = sum(mu * (np.linalg.norm(x - centre, axis=-1) < radius) for centre, radius, mu in (WATER, BALL))
    alike = []
    for count in (2, 3, 9):
        found = reconstruct([xray_of_balls(each, (WATER, BALL)) for each in orbit(count, 180)], where).voxels
        alike.append(np.corrcoef(found.ravel(), truth.ravel())[0, 1])
        assert found[truth > 0].mean() == pytest.approx(truth[truth > 0].mean(), rel=0.15)
    assert 0.5 < alike[0] < alike[1] < alike[2] < 0.97


def test_a_body_wider_than_the_detector_has_no_bright_rim():
    """Rows that end abruptly would triple the density along the edge of what all views see."""
    wide = (np.zeros(3), 90.0, 0.01)
    cameras = orbit(45, 360, pixels=(60, 44), pitch_mm=(4.0, 4.0))
    found = reconstruct([xray_of_balls(each, (wide, BALL)) for each in cameras], grid())
    seen = np.linalg.norm(points(found)[..., :2], axis=-1)
    rim = (seen > 50) & (seen < 58) & (np.abs(points(found)[..., 2]) < 20)
    middle = (seen < 20) & (np.abs(points(found)[..., 2]) < 8)
    assert np.linalg.norm(centre_of_ball(found) - BALL[0]) < 1.5
    assert found.voxels[rim].mean() < 2 * found.voxels[middle].mean()
    assert found.voxels[middle].mean() == pytest.approx(0.01, rel=0.5)


def test_a_masked_corner_costs_little():
    cameras = orbit(24, 360)
    mask = np.ones((72, 80), bool)
    mask[:12] = mask[:, :10] = False
    whole = reconstruct([xray_of_balls(each, (WATER, BALL)) for each in cameras], grid())
    clean = [xray_of_balls(each, (WATER, BALL), mask=mask) for each in cameras]
    # What lies under the mask is not looked at: lead letters would be there.
    dirty = [dataclasses.replace(each, image=np.where(mask, each.image, 50.0)) for each in clean]
    found = reconstruct(dirty, grid())
    inside = np.linalg.norm(points(whole), axis=-1) < 50
    assert np.abs(found.voxels - whole.voxels)[inside].mean() < 0.001


def test_finer_pixels_are_averaged_and_stay_in_place():
    fine = orbit(30, 360, pixels=(288, 320), pitch_mm=(1.0, 1.0))
    found = reconstruct([xray_of_balls(each, (WATER, BALL)) for each in fine], grid())
    assert np.linalg.norm(centre_of_ball(found) - BALL[0]) < 0.7
    views = align_views([xray_of_balls(each, (BALL,)) for each in fine[:2]], np.zeros(3), 2.0)
    assert views.images.shape == (2, 144, 160)


def test_a_parallel_detector_is_not_interpolated():
    cameras = orbit(4, 180, rolls=(0, 180))
    xrays = [xray_of_balls(each, (BALL,)) for each in cameras]
    views = align_views(xrays, np.zeros(3), 1.0)
    for number, (image, given) in enumerate(zip(views.images, xrays, strict=True)):
        expected = given.image[::-1, ::-1] if number % 2 else given.image
        np.testing.assert_allclose(image, expected, atol=1e-4)


def test_aligned_images_are_those_of_their_cameras():
    """The formula for the aligned camera gives what resampling gave, wherever the detector was."""
    xrays = [xray_of_balls(each, (WATER,)) for each in orbit(5, 180, rolls=(3, 95, -40), centre=(33.0, 41.0))]
    views = align_views(xrays, np.zeros(3), 1.0)
    for image, camera in zip(views.images, views.cameras, strict=True):
        assert abs(camera.extrinsic[1, :3] @ views.axis) == pytest.approx(1)
        expected = xray_of_balls(camera, (WATER,)).image
        inside = expected > 0.6 * expected.max()
        np.testing.assert_allclose(image[inside], expected[inside], rtol=0.01)


def test_the_axis_of_one_view_is_superior():
    axis = rotation_axis(orbit(1, 180))
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-9)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_cameras_that_do_not_suit_are_refused_in_one_sentence(number):
    cameras = orbit(3, 180)
    xrays = [xray_of_balls(each, (BALL,), name=f"view {i}") for i, each in enumerate(cameras)]
    if number == 0:
        xrays[1] = dataclasses.replace(xrays[1], extrinsic=None, camera="absent")
        said = '"view 1" has no camera'
    elif number == 1:
        turned = np.eye(4)
        turned[:3, :3] = np.diag([-1, 1, -1])
        xrays[1] = dataclasses.replace(xrays[1], extrinsic=turned @ xrays[1].extrinsic)
        said = '"view 1": the CT lies behind the X-ray source'
    else:
        along = orbit(1, 180, turned=(90, 0, 0))[0]
        xrays = [*xrays, xray_of_balls(along, (BALL,), name="axial")]
        said = '"axial" looks along the axis'
    with pytest.raises(InputError, match=said):
        reconstruct(xrays, grid())


PERTURBED = """
import numpy as np
from ball_views import orbit, xray_of_balls
from PolyPoseLib.baselines.fdk import reconstruct
from test_fdk import BALL, WATER, grid

for pixels in ((80, 72), (61, 40)):
    xrays = [xray_of_balls(each, (WATER, BALL)) for each in orbit(3, 180, pixels=pixels)]
    assert np.isfinite(reconstruct(xrays, grid()).voxels).all()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the memory of glibc alone is filled on request")
def test_nothing_is_read_beside_the_images():
    """What glibc has freed is filled with bytes that are not a number where they are read."""
    here = Path(__file__).parent
    paths = [*map(str, (here.parents[2], here.parent / "support", here)), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "MALLOC_PERTURB_": "255", "PYTHONPATH": os.pathsep.join(paths)}
    done = subprocess.run(
        [sys.executable, "-c", PERTURBED], capture_output=True, text=True, timeout=300, env=environment
    )
    assert done.returncode == 0, done.stderr
