"""Random cameras of a calibrated stand, which several tests write and read."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera


def camera(seed):
    rng = np.random.default_rng(seed)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    extrinsic[:3, 3] = [*rng.uniform(-50, 50, 2), rng.uniform(500, 900)]
    focal = rng.uniform(1500, 3000, 2)
    intrinsics = np.array([[focal[0], 0, 510.5], [0, focal[1], 489.0], [0, 0, 1]])
    return Camera(intrinsics, extrinsic, 1000, 1024)
