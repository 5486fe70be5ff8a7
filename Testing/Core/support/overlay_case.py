"""The phantom pelvis filmed while its femur swings: a sequence, its true track, and images made as they are read."""

import numpy as np
from joint_case import track_of
from phantom_study import HEAD, phantom
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.geometry.rigid import about, rigid_inverse
from PolyPoseLib.simulation.simulate import view_cameras

SWING_DEG = 25.0


def true_poses(count):
    """(F, 3, 4, 4) fixed to moving: the femur swings about its head, the pelvis shifts, the vertebra stands."""
    poses = np.tile(np.eye(4), (count, 3, 1, 1))
    for n in range(count):
        angle = np.radians(SWING_DEG) * np.sin(2 * np.pi * n / max(count, 2))
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec([0.3 * angle, angle, 0.0]).as_matrix()
        poses[n, 1] = rigid_inverse(about(turn, HEAD))
        poses[n, 0, 0, 3] = 3.0 * np.sin(2 * np.pi * n / max(count, 2))
    return poses


class FilmedImages:
    """Line integrals to about a tenth: every bone's voxels laid onto the pixels that they project to."""

    def __init__(self, camera, bones, poses):
        self.camera, self.bones, self.poses = camera, bones, poses
        self.count = len(poses)
        self.reads = []

    def read(self, index):
        self.reads.append(index)
        image = np.zeros((self.camera.height, self.camera.width))
        edges = [np.arange(n + 1) - 0.5 for n in image.shape]
        for points, pose in zip(self.bones, self.poses[index], strict=True):
            inverse = rigid_inverse(pose)
            pixels = self.camera.project(points @ inverse[:3, :3].T + inverse[:3, 3])
            image += np.histogram2d(pixels[:, 1], pixels[:, 0], bins=edges)[0]
        image = gaussian_filter(image, self.camera.width / 120)
        noise = np.random.default_rng(index).normal(0, 0.02, image.shape)
        return (image / image.max() + noise).astype(np.float32), np.ones(image.shape, bool)


def overlay_case(count=6, pixels=120, angles=(0.0, 60.0), first=0, **track):
    """A sequence of so many frames and its true track."""
    ct, structures = phantom()
    bones = [
        ct.to_world(np.argwhere(structures.labels == n + 1)[:, ::-1]) for n in range(len(structures.names))
    ]
    poses = true_poses(count)
    cameras = view_cameras(ct, angles, pixels, detector_mm=330.0)
    shown = np.concatenate([np.repeat(poses[:1], first, axis=0), poses])
    views = tuple(
        TrackView(f"view {n + 1}", camera, FilmedImages(camera, bones, shown), first)
        for n, camera in enumerate(cameras)
    )
    sequence = Sequence(ct, structures, views, 20.0, "pelvis")
    return sequence, track_of(sequence, poses, **track)
