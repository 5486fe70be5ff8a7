"""Detector model and independent projector: laws they must obey."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.simulation import independent_projector
from PolyPoseLib.simulation.simulate import view_cameras
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

PERFECT = XrayPhysics(photons=1e12, scatter_to_primary=0, blur_px=0, saturation=0, bits=0)


def ramp(height=40, width=50, top=6.0):
    return np.broadcast_to(np.linspace(0, top, width), (height, width)).copy()


def test_a_perfect_detector_returns_the_line_integrals():
    assert np.allclose(measure(ramp(), PERFECT, np.random.default_rng(0)), ramp(), atol=1e-3)


def test_noise_has_the_variance_of_its_photons():
    line, photons = 3.0, 1e4
    physics = XrayPhysics(photons=photons, scatter_to_primary=0, blur_px=0, saturation=0, bits=0)
    noisy = measure(np.full((300, 300), line), physics, np.random.default_rng(1))
    assert noisy.std() == pytest.approx(np.exp(line / 2) / np.sqrt(photons), rel=0.03)


def test_the_same_seed_gives_the_same_image():
    first, second = (measure(ramp(), XrayPhysics(), np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(first, second)


def test_scatter_lowers_contrast_and_has_the_ratio_asked_for():
    from dataclasses import replace

    line = gaussian_filter(np.random.default_rng(0).random((80, 80)), 6) * 30
    scattered = measure(line, replace(PERFECT, scatter_to_primary=0.8), np.random.default_rng(0))
    ratio = np.exp(-scattered) / np.exp(-line) - 1
    assert np.median(ratio) == pytest.approx(0.8, rel=0.02)
    assert np.ptp(scattered) < np.ptp(line)


@pytest.mark.parametrize("encoding", ["log", "linear"])
@pytest.mark.parametrize("bits", [8, 12])
def test_stored_levels_are_no_more_than_the_bits_allow(encoding, bits):
    noisy = measure(ramp(200, 300), XrayPhysics(bits=bits, encoding=encoding), np.random.default_rng(0))
    assert len(np.unique(noisy)) <= 2**bits
    assert noisy.min() >= XrayPhysics().saturation - 1e-5 and np.isfinite(noisy).all()


def test_saturation_burns_out_thin_parts_only():
    from dataclasses import replace

    burnt = measure(ramp(), replace(PERFECT, saturation=1.0), np.random.default_rng(0))
    assert np.allclose(burnt, np.maximum(ramp(), 1.0), atol=1e-3)


@pytest.mark.parametrize(
    "wrong", [{"photons": 0}, {"bits": 17}, {"encoding": "cubic"}, {"blur_px": -1}, {"saturation": np.nan}]
)
def test_impossible_detectors_are_refused(wrong):
    with pytest.raises(InputError):
        XrayPhysics(**wrong)


def oblique_volume(handedness):
    rng = np.random.default_rng(3)
    voxels = gaussian_filter(np.pad(rng.random((30, 26, 22)), 6), 1.5).astype(np.float32) * 0.02
    affine = np.eye(4)
    affine[:3, :3] = Rotation.random(random_state=3).as_matrix() @ np.diag([handedness * 2.0, 2.5, 3.0])
    affine[:3, 3] = [30, -20, 400]
    return Volume(voxels, affine)


def lopsided_camera(volume, angle):
    camera = view_cameras(volume, (angle,), pixels=40, detector_mm=240)[0]
    intrinsics = camera.intrinsics.copy()
    intrinsics[0, 2] += 5
    intrinsics[1, 2] -= 7.3
    intrinsics[1, 1] *= 1.2
    return Camera(intrinsics, camera.extrinsic, 33, 45)


@pytest.mark.parametrize("handedness", [1, -1])
@pytest.mark.parametrize("angle", [0, 37])
def test_rtk_and_the_ray_sum_agree(handedness, angle):
    if not independent_projector.rtk_available():
        pytest.skip("itk-rtk is not installed")
    volume = oblique_volume(handedness)
    camera = lopsided_camera(volume, angle)
    joseph = independent_projector.project(volume, camera, "rtk")
    plain = independent_projector.project(volume, camera, "sum")
    assert np.linalg.norm(joseph - plain) < 2e-3 * np.linalg.norm(plain)


def test_the_ray_sum_measures_a_box():
    voxels = np.zeros((41, 41, 41), np.float32)
    voxels[10:31, 10:31, 10:31] = 0.02
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    volume = Volume(voxels, affine)
    camera = view_cameras(volume, (0.0,), pixels=41, detector_mm=100)[0]
    image = independent_projector.project(volume, camera, "sum")
    assert image[20, 20] == pytest.approx(0.02 * 42, rel=1e-3)


def test_the_marker_appears_where_the_camera_says():
    voxels = np.zeros((40, 44, 48), np.float32)
    voxels[31, 12, 7] = 1.0
    volume = Volume(voxels, np.diag([2.0, -2.0, 3.0, 1.0]))
    for camera in view_cameras(volume, (0.0, 30.0, 90.0), pixels=200, detector_mm=300):
        image = independent_projector.project(volume, camera, "sum")
        row, column = np.indices(image.shape)
        centre = np.array([(column * image).sum(), (row * image).sum()]) / image.sum()
        assert np.allclose(centre, camera.project(volume.to_world(np.array([7, 12, 31]))), atol=0.3)


def test_a_source_inside_the_volume_is_refused():
    volume = oblique_volume(1)
    with pytest.raises(InputError, match="source"):
        independent_projector.project(volume, view_cameras(volume, source_to_isocenter_mm=10)[0])
