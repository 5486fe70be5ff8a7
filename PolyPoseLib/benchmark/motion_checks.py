"""What a system's answer must be before it is scored."""

from __future__ import annotations

import itertools

import numpy as np

from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import require_rigid

COARSEST_MM = 4.0
"""Of a field's grid: all systems are scored at one resolution or a finer one."""

_SLACK_MM = 1e-3


def require_motion(motion: Motion, study: Study) -> None:
    """Raise InputError when a motion is no answer to a study; the sentence says why."""
    if not isinstance(motion, Motion) or not isinstance(motion.field, DisplacementField):
        raise InputError(f"it gave a {type(motion).__name__}, not a Motion with a DisplacementField.")
    spacing = motion.field.spacing.max()
    if spacing > COARSEST_MM + _SLACK_MM:
        raise InputError(f"its field has nodes {spacing:.2f} mm apart, more than {COARSEST_MM:g} mm.")
    missed = _missed_mm(motion.field, study)
    if missed > _SLACK_MM:
        raise InputError(f"its field ends {missed:.1f} mm before the CT's outermost voxels.")
    for name, pose in motion.poses.items():
        if name not in study.structures.names:
            raise InputError(f'it gave a pose of "{name}", which is no structure of the study.')
        require_rigid(pose, f'its pose of "{name}"')


def _missed_mm(field: DisplacementField, study: Study) -> float:
    """How far the CT's outermost voxel centres are from the field's nodes, 0 where these enclose them."""
    ends = [(0, size - 1) for size in study.ct.shape[::-1]]
    corners = study.ct.to_world(np.array(list(itertools.product(*ends)), dtype=np.float64))
    inverse = np.linalg.inv(field.affine)
    index = corners @ inverse[:3, :3].T + inverse[:3, 3]
    last = np.array(field.shape[::-1]) - 1
    beyond = np.maximum(np.maximum(-index, index - last), 0) * field.spacing
    return float(beyond.max())
