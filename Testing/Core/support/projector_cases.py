"""Cameras, grids and bodies with closed forms, shared by the projector's tests."""

import numpy as np
import torch

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.rendering.projector import render

VIEWS = {
    "anterior": ((0, -800, 0), (0, 0, 1)),
    "lateral": ((800, 0, 0), (0, 0, 1)),
    "oblique": ((300, -700, 250), (0, 0, 1)),
    "tilted": ((-500, -600, -150), (0.3, 0.1, 1)),
}


def camera_at(view, height=40, width=50, field_mm=200, target=(1.0, -2.0, 3.0)):
    """A camera 1000 mm from its detector, with a principal point off the centre."""
    offset, up = VIEWS[view]
    pitch = 1.25 * field_mm / max(height, width)
    intrinsics = intrinsics_matrix(1000, pitch, height, width)
    intrinsics[:2, 2] += (1.3, -0.7)
    target = np.asarray(target, float)
    return Camera(intrinsics, look_at(target + offset, target, up), height, width)


def drr(voxels, affine, *cameras, dtype=torch.float64, **options):
    intrinsics = torch.tensor(np.stack([camera.intrinsics for camera in cameras]))
    extrinsics = torch.tensor(np.stack([camera.extrinsic for camera in cameras]))
    images = render(
        torch.as_tensor(voxels).to(dtype),
        torch.as_tensor(affine),
        intrinsics,
        extrinsics,
        cameras[0].height,
        cameras[0].width,
        **options,
    )
    return images.numpy() if len(cameras) > 1 else images[0].numpy()


def grid_affine(shape, spacing, rotation=None, flip=(1, 1, 1), center=(0, 0, 0)):
    """A grid whose box is centred at `center`, of any direction matrix and handedness."""
    affine = np.eye(4)
    affine[:3, :3] = (np.eye(3) if rotation is None else rotation) @ np.diag(np.multiply(spacing, flip))
    affine[:3, 3] = center - affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    return affine


def grid_points(shape, affine):
    index = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1)[..., ::-1]
    return index @ affine[:3, :3].T + affine[:3, 3]


def unit_rays(camera):
    directions = camera.pixel_directions()
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def relative_l2(found, expected):
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


SIGMAS = np.array([22.0, 15.0, 30.0])


def gaussian(points):
    """A smooth body of attenuation 0.02 / mm at its centre."""
    return 0.02 * np.exp(-0.5 * ((points / SIGMAS) ** 2).sum(-1))


def gaussian_integral(camera):
    source, rays = camera.source / SIGMAS, unit_rays(camera) / SIGMAS
    squared = (rays**2).sum(-1)
    along = rays @ source
    exponent = source @ source - along**2 / squared
    return 0.02 * np.sqrt(2 * np.pi / squared) * np.exp(-0.5 * exponent)


def random_case(seed=0, shape=(20, 24, 28)):
    rng = np.random.default_rng(seed)
    return torch.tensor(rng.random(shape), dtype=torch.float32), torch.tensor(
        grid_affine(shape, (3.0, 2.5, 2.0))
    )


def matrices(*cameras):
    return (
        torch.tensor(np.stack([camera.intrinsics for camera in cameras])),
        torch.tensor(np.stack([camera.extrinsic for camera in cameras])),
    )
