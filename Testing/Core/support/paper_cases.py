"""A small body with three bones in a known posture, and X-rays of it, for the tests of the paper's method."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.ndimage import gaussian_filter

from PolyPoseLib.baselines.published.method import attenuation_grid
from PolyPoseLib.baselines.published.projector import Sampling
from PolyPoseLib.baselines.published.projectors import polyrigid_projector
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.rigid import about
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.warp.weights import distance_maps

ANCHOR = "pelvis"


@dataclass(frozen=True)
class Phantom:
    """study: with initial cameras; cameras: the true ones; poses: (K, 4, 4) true, fixed to moving."""

    study: Study
    cameras: list
    poses: np.ndarray

    def scene(self):
        return Scene(self.study.ct, self.study.structures, ANCHOR)

    def observations(self, cameras=None):
        cameras = cameras or self.cameras
        return [Observation(x.image, x.mask, c) for x, c in zip(self.study.xrays, cameras, strict=True)]

    def bone_error(self, poses):
        """Mean distance (mm) of each structure's voxels from where they belong in the CT."""
        errors = []
        for n in range(len(self.study.structures.names)):
            index = np.argwhere(self.study.structures.labels == n + 1)[:, ::-1]
            moving = index @ self.study.ct.affine[:3, :3].T + self.study.ct.affine[:3, 3]
            difference = poses[n] @ np.linalg.inv(self.poses[n])
            moved = moving @ difference[:3, :3].T + difference[:3, 3]
            errors.append(np.linalg.norm(moved - moving, axis=1).mean())
        return np.array(errors)


def phantom(seed=0, pixels=48, turn=0.12, shift=5.0, camera_error=(0.04, 6.0), frame="fixed", form="mass"):
    """Bones moved as the product's own warp has it; the X-rays are its own renderings with a little noise."""
    rng = np.random.default_rng(seed)
    shape = (34, 30, 40)
    labels = np.zeros(shape, np.int16)
    labels[18:28, 8:22, 10:30] = 1
    labels[20:26, 12:18, 14:26] = 0
    labels[3:17, 11:18, 9:15] = 2
    labels[3:17, 11:18, 26:32] = 3
    hu = np.where(labels > 0, 900.0, 20.0) + gaussian_filter(rng.normal(0, 600, shape), 1.5)
    hu[:, :3] = hu[:, -3:] = hu[..., :3] = hu[..., -3:] = -1000
    affine = np.diag([5.0, 5.0, 5.0, 1.0])
    affine[:3, 3] = [-100.0, -75.0, 900.0]
    ct = Volume(hu.astype(np.float32), affine)
    structures = Structures((ANCHOR, "femur_left", "femur_right"), labels)
    scene = Scene(ct, structures, ANCHOR)
    vectors = np.concatenate([rng.normal(0, turn / 3**0.5, (3, 3)), rng.normal(0, shift / 3**0.5, (3, 3))], 1)
    vectors[0] = 0
    motions = se3.exp(torch.as_tensor(vectors)).numpy()
    poses = np.stack([about(m, c) for m, c in zip(motions, scene.centres, strict=True)])
    target = scene.anchor_centre - [0, 0, 30.0]
    cameras, xrays = [], []
    warp = SoftTissue(scene, frame, form, 0.02).warp(distance_maps(structures, affine), poses)
    grid = attenuation_grid(ct, None)
    for n, angle in enumerate((0.0, 1.0)):
        source = target + 700 * np.array([np.sin(angle), -np.cos(angle), 0.1])
        intrinsics = intrinsics_matrix(1000, 320 / pixels, pixels, pixels)
        camera = Camera(intrinsics, look_at(source, target), pixels, pixels)
        render = polyrigid_projector(grid, warp, camera, Sampling(2.0), select_backend())
        image = render.image(warp.logs.numpy())
        image = image + rng.normal(0, 0.004, image.shape).astype(np.float32)
        axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
        delta = torch.as_tensor(np.concatenate([axis * camera_error[0], direction * camera_error[1]]))
        initial = camera.extrinsic @ about(se3.exp(delta).numpy(), scene.anchor_centre)
        xrays.append(
            Xray(
                image,
                np.ones(image.shape, bool),
                intrinsics,
                initial,
                "initial",
                (320 / pixels, 320 / pixels),
                1000.0,
                f"view {n + 1}",
            )
        )
        cameras.append(camera)
    return Phantom(Study(ct, structures, ANCHOR, tuple(xrays)), cameras, poses)


def fastest_backend():
    return select_backend()


def has_numba():
    return isinstance(select_backend(), NumbaBackend)


def projection_error_px(camera, true, points):
    """Mean distance (px) between the projections of points (N, 3) by two cameras."""
    return float(np.linalg.norm(camera.project(points) - true.project(points), axis=1).mean())
