"""The derivative along the rays: a hundredth of that across them, and lost in the samples unless it is made exact."""

import numpy as np
import pytest
from projector_cases import camera_at
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.torch_backend import TorchBackend

BACKENDS = {"numba": NumbaBackend, "torch": lambda: TorchBackend("cpu")}


def textured_body(seed: int) -> Body:
    """An ellipsoid of trabecular bone, voxels of 2 mm."""
    rng = np.random.default_rng(seed)
    index = np.stack(np.meshgrid(*[np.arange(34)] * 3, indexing="ij"), -1) - 16.5
    inside = np.clip(1 - np.linalg.norm(index / [14, 10, 12], axis=-1), 0, 0.15) / 0.15
    texture = gaussian_filter(rng.normal(size=inside.shape), 0.8)
    voxels = 0.02 * inside * (1 + 0.4 * texture / texture.std())
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix() @ affine[:3, :3]
    affine[:3, 3] = -affine[:3, :3] @ np.full(3, 16.5)
    return Body(voxels.astype(np.float32), affine, np.zeros(3))


@pytest.mark.parametrize("name", BACKENDS)
@pytest.mark.parametrize("seed", range(3))
def test_moving_along_the_beam_is_growing(name, seed):
    """A body nearer by a share of its distance is larger by that share, and as dense in line integral."""
    body, backend, rng = textured_body(seed), BACKENDS[name](), np.random.default_rng(seed + 50)
    camera = camera_at("oblique", 90, 100, 110)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.5, 3)).as_matrix()
    beam = pose[:3, :3] @ (pose[:3, :3].T @ (body.centre - pose[:3, 3]) - camera.source)
    depth = np.linalg.norm(beam)
    change = 0.01

    def grown(factor):
        affine = body.affine.copy()
        affine[:3] *= factor
        part = project_body(Body(body.voxels, affine, body.centre), camera, pose, 0.25, backend)
        image = np.zeros((camera.height, camera.width))
        image[part.slices] = part.image / factor
        return image

    expected = (grown(1 + change) - grown(1 - change)) / (2 * change)

    part = project_body(body, camera, pose, 2.0, backend, True)
    image = np.zeros((camera.height, camera.width))
    # A pose takes the X-ray's world to the body: pushed along the beam, the world carries the source nearer.
    image[part.slices] = np.einsum("a,ahw->hw", beam / depth, part.jacobian[3:]) * depth
    assert np.linalg.norm(image - expected) < 0.2 * np.linalg.norm(expected)


@pytest.mark.parametrize("name", BACKENDS)
@pytest.mark.parametrize("seed", range(3))
def test_all_six_derivatives_stay_those_of_the_image(name, seed):
    body, backend, rng = textured_body(seed), BACKENDS[name](), np.random.default_rng(seed)
    camera = camera_at("tilted", 60, 70, 110)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rng.normal(0, 0.5, 3)).as_matrix()
    part = project_body(body, camera, pose, 1.0, backend, True)
    for n in range(6):
        size = 0.002 if n < 3 else 0.1
        images = []
        for sign in (1, -1):
            moved = about(perturbation(sign * size * np.eye(6)[n]), body.centre) @ pose
            other = project_body(body, camera, moved, 0.25, backend)
            image = np.zeros((camera.height, camera.width))
            image[other.slices] = other.image
            images.append(image)
        numerical = (images[0] - images[1]) / (2 * size)
        found = np.zeros_like(numerical)
        found[part.slices] = part.jacobian[n]
        whole = np.linalg.norm(part.jacobian[:3] if n < 3 else part.jacobian[3:])
        assert np.linalg.norm(found - numerical) < 0.08 * whole
