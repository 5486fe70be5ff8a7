"""Two boxes as bones, with landmarks, and tracks of poses that a test chooses."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at

CAMERA = Camera(intrinsics_matrix(1000, 2.0, 40, 50), look_at((0, -800, 0), (0, 0, 0)), 40, 50)
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
"""The sagittal plane's, in LPS."""


class BlankImages:
    """Images of nothing."""

    def __init__(self, count):
        self.count = count

    def read(self, index):
        return np.zeros((40, 50), np.float32), np.ones((40, 50), bool)


def rigid(rotation, translation):
    pose = np.eye(4)
    pose[:3, :3] = rotation.as_matrix()
    pose[:3, 3] = translation
    return pose


def random_rigid(rng, degrees=40.0, mm=30.0):
    return rigid(Rotation.from_rotvec(np.radians(rng.uniform(-degrees, degrees, 3))), rng.uniform(-mm, mm, 3))


def bones(mirrored=False):
    """A CT (k, j, i) with an upper and a lower box, neither symmetric; mirrored: left and right exchanged."""
    labels = np.zeros((40, 20, 24), np.int16)
    labels[22:38, 6:12, 8:18] = 1
    labels[24:28, 12:16, 8:11] = 1
    labels[3:20, 7:12, 9:17] = 2
    labels[4:8, 4:7, 14:17] = 2
    if mirrored:
        labels = labels[:, :, ::-1]
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, 3] = -np.array([23.0, 19.0, 39.0])
    return Volume(np.where(labels > 0, 700, -1000).astype(np.float32), affine), labels


def sequence_of(joints=(), landmarks=None, mirrored=False, frames=5, names=("upper", "lower")):
    """A sequence of these bones that nothing can be seen in."""
    ct, labels = bones(mirrored)
    views = (TrackView("ap", CAMERA, BlankImages(frames)),)
    return Sequence(
        ct, Structures(names, labels), views, 50.0, names[0], landmarks=landmarks or {}, joints=tuple(joints)
    )


def track_of(sequence, poses, covariances=None, doubts=None, sources=None):
    """A track of poses (F, K, 4, 4), with covariances (F, K, 6, 6) or (6, 6) for all."""
    poses = np.asarray(poses)
    count, bones_count = poses.shape[:2]
    covariances = np.zeros((6, 6)) if covariances is None else covariances
    covariances = np.broadcast_to(covariances, (count, bones_count, 6, 6))
    frames = tuple(
        TrackedFrame(
            n,
            poses[n],
            covariances[n],
            np.full(bones_count, 0.1),
            doubts[n] if doubts else ((),) * bones_count,
            sources[n] if sources else ("forward",) * bones_count,
        )
        for n in range(count)
    )
    return Track(
        sequence.structures.names,
        sequence.reference,
        sequence.structures.centroids(sequence.ct.affine),
        frames,
        sequence.frames_per_second,
        {view.name: view.camera for view in sequence.views},
    )
