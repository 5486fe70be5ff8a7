"""A trunk with a fixed and a moved bone, given by formulas, and X-rays of it in its new posture."""

import numpy as np
from ball_views import orbit, xray
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.simulation.independent_projector import project

HINGE = np.array([22.0, 4.0, 30.0])
"""LPS mm, about which the long bone turns."""


class FdkCase:
    """The study, and how far from the truth the bones' voxels are."""

    def __init__(self, count=9, arc_deg=180.0, spacing=4.0, degrees=9.0, shift_mm=(4.0, -5.0, 3.0)):
        shape = tuple(int(n) for n in np.round(np.array([150.0, 108.0, 132.0]) / spacing))
        # An oblique, left-handed grid, as CTs have them.
        axes = Rotation.from_rotvec([3, -5, 8], degrees=True).as_matrix() @ np.diag([-1, 1, 1])
        affine = np.eye(4)
        affine[:3, :3] = axes * spacing
        affine[:3, 3] = -affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
        empty = Volume(np.zeros(shape, np.float32), affine)
        index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)[..., ::-1]
        points = empty.to_world(index)
        self.turn = Rotation.from_rotvec([degrees, 0.4 * degrees, 0], degrees=True).as_matrix()
        self.shift = np.array(shift_mm)

        ct = empty.with_voxels(self._hu(points, points))
        # Where the bone has gone; soft tissue around it is the trunk's, which stays.
        posed = empty.with_voxels(self._hu(points, self._moving(points)))
        attenuation = posed.with_voxels(hounsfield_to_attenuation(posed.voxels))
        cameras = orbit(count, arc_deg, pixels=(64, 64), pitch_mm=(4.0, 4.0))
        labels = np.zeros(shape, np.int16)
        labels[self._anchor(points) > 0.5] = 1
        labels[self._long_bone(points) > 0.5] = 2
        self.study = Study(
            ct=ct,
            structures=Structures(("spine", "femur"), labels),
            anchor="spine",
            xrays=tuple(xray(each, project(attenuation, each)) for each in cameras),
            source_segmentation=Volume(labels, affine),
        )
        self._moving_points = empty.to_world(np.argwhere(labels == 2)[:, ::-1])
        self._anchor_points = empty.to_world(np.argwhere(labels == 1)[:, ::-1])

    def errors(self, field):
        """Mean distances in mm over both bones' voxels: of the field, and of no motion."""
        fixed = (self._moving_points - HINGE) @ self.turn + HINGE + self.shift
        fixed = np.concatenate([fixed, self._anchor_points])
        moving = np.concatenate([self._moving_points, self._anchor_points])
        return (
            np.linalg.norm(field(fixed) - moving, axis=1).mean(),
            np.linalg.norm(fixed - moving, axis=1).mean(),
        )

    def _moving(self, points):
        """CT points of the bone that now is at these points."""
        return (points - self.shift - HINGE) @ self.turn.T + HINGE

    def _hu(self, points, bone_points):
        trunk = 1 / (1 + np.exp((np.linalg.norm(points / [62.0, 48.0, 85.0], axis=-1) - 1) * 14))
        hu = -1000 + 1030 * trunk
        bone = np.maximum(self._anchor(points), self._long_bone(bone_points))
        return (hu * (1 - bone) + 900 * bone).astype(np.float32)

    @staticmethod
    def _anchor(points):
        """A column of vertebrae, 0 to 1."""
        x, y, z = np.moveaxis(points, -1, 0)
        radius = 11 + 3 * np.cos(z / 5)
        return 1 / (1 + np.exp((np.hypot(x + 24, y - 14) - radius) / 1.5)) * (np.abs(z) < 52)

    @staticmethod
    def _long_bone(points):
        """A shaft with a thick end, 0 to 1."""
        x, y, z = np.moveaxis(points - HINGE, -1, 0)
        shaft = np.maximum(np.hypot(x, y) - 8.5, np.maximum(z - 12, -z - 72))
        head = np.sqrt((x + 8) ** 2 + y**2 + (z - 4) ** 2) - 15
        return 1 / (1 + np.exp(np.minimum(shaft, head) / 1.5))
