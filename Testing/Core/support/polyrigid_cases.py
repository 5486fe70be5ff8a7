"""Three bones in a soft body, and the oracle of the polyrigid projectors: float64, autograd, no kernel."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation
from torch.nn.functional import grid_sample

from PolyPoseLib.baselines.published.ray_samples import sample_rays
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.warp.polyrigid import PolyrigidWarp
from PolyPoseLib.warp.weights import DistanceMaps, distance_maps


@dataclass(frozen=True)
class Case:
    """A body (mu, padded with zeros), the warp of its three bones at rest, one camera, and some logarithms."""

    volume: Grid
    warp: PolyrigidWarp
    camera: Camera
    logs: np.ndarray

    def with_warp(self, **changes):
        """The case with another frame, form, epsilon or distance maps."""
        old = self.warp
        new = {"frame": old.frame, "form": old.form, "epsilon": old.epsilon, "distances": old.distances}
        new |= changes
        warp = PolyrigidWarp(share=old.share, poses=old.poses, center=old.center.numpy(), **new)
        return Case(self.volume, warp, self.camera, self.logs)


def make_case(seed=0, frame="fixed", form="mass", epsilon=0.02, pixels=(11, 9), rotation=0.15):
    rng = np.random.default_rng(seed)
    labels = np.zeros((24, 30, 34), np.int16)
    labels[3:21, 12:18, 4:11] = 1
    labels[4:20, 11:18, 21:26] = 2
    labels[9:12, 20:24, 8:20] = 3
    mu = np.where(labels > 0, 0.05, 0.02).astype(np.float32) + 0.004 * rng.random(labels.shape)
    mu[:, :2] = mu[:, -2:] = 0
    mu = gaussian_filter(mu, 0.7).astype(np.float32)
    axes = Rotation.from_rotvec(rng.normal(0, 0.3, 3)).as_matrix() * (4.0, 3.0, 5.0)
    if seed % 2:
        axes[:, 1] *= -1  # a left-handed grid
    affine = np.eye(4)
    affine[:3, :3] = axes
    affine[:3, 3] = rng.uniform(-100, 100, 3)
    voxels = np.pad(mu, 1)
    padded = affine.copy()
    padded[:3, 3] -= axes @ np.ones(3)
    structures = Structures(("spine", "limb", "rib"), labels)
    maps = distance_maps(structures, affine)
    centre = affine[:3, :3] @ np.array([17.0, 15.0, 12.0]) + affine[:3, 3]
    share = structures.volume_share()
    warp = PolyrigidWarp(maps, share, np.stack([np.eye(4)] * 3), frame, form, epsilon, centre)
    source = centre + Rotation.from_rotvec(rng.normal(0, 0.3, 3)).apply([60.0, -700.0, 40.0])
    height, width = pixels
    camera = Camera(intrinsics_matrix(1000, 18.0, height, width), look_at(source, centre), height, width)
    logs = np.concatenate([rng.normal(0, rotation, (3, 3)), rng.normal(0, 6, (3, 3))], axis=1)
    logs[0] = 0
    return Case(Grid(voxels, padded), warp, camera, logs)


def oracle(case, step_mm, logs=None, margin_mm=0.0):
    """Image (H, W) in float64 as a function of logarithms (K, 6), differentiable."""
    logs = torch.as_tensor(case.logs if logs is None else logs, dtype=torch.float64)
    centre = case.warp.center
    rays = sample_rays(case.camera, case.volume, centre.numpy(), step_mm, margin_mm)
    number = np.arange(rays.count.max())
    points = rays.first[:, None] + number[:, None] * rays.step[:, None] + centre.numpy()
    inside = torch.as_tensor(number < rays.count[:, None]).double()
    back, forth = torch.eye(4, dtype=torch.float64), torch.eye(4, dtype=torch.float64)
    back[:3, 3], forth[:3, 3] = -centre, centre
    poses = forth @ se3.exp(logs) @ back
    old = case.warp
    maps = DistanceMaps(old.distances.signed.double(), old.distances.affine)
    warp = PolyrigidWarp(maps, old.share, poses, old.frame, old.form, old.epsilon, centre.numpy())
    flat = torch.as_tensor(points).reshape(-1, 3)
    moved = warp(flat)
    to_index = torch.as_tensor(np.linalg.inv(case.volume.affine))
    index = moved @ to_index[:3, :3].T + to_index[:3, 3]
    place = 2 * index / (torch.tensor(case.volume.voxels.shape[::-1]) - 1) - 1
    volume = torch.as_tensor(case.volume.voxels).double()[None, None]
    values = grid_sample(volume, place[None, None, None], align_corners=True)[0, 0, 0, 0]
    sums = (values.reshape(inside.shape) * inside).sum(1) * step_mm
    image = torch.zeros(case.camera.height * case.camera.width, dtype=torch.float64)
    image = image.index_put((torch.as_tensor(rays.pixels),), sums)
    return image.reshape(case.camera.height, case.camera.width)


def oracle_jacobian(case, step_mm):
    """(K, 6, H, W) by reverse-mode differentiation, pixel by pixel."""
    logs = torch.as_tensor(case.logs, dtype=torch.float64)
    jacobian = torch.autograd.functional.jacobian(lambda v: oracle(case, step_mm, v), logs)
    return jacobian.permute(2, 3, 0, 1).numpy()


def relative_l2(found, expected):
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))
