"""The motion of every joint of a tracked sequence."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.tracking.joint_motion import JointMotion
from PolyPoseLib.data.tracking.joints import Joint, joints_to
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.kinematics.bone_axes import JointAxes, joint_axes, require_known_landmarks
from PolyPoseLib.kinematics.conventions import CONVENTION_TABLE
from PolyPoseLib.kinematics.helical import helical_axes
from PolyPoseLib.kinematics.joint_coordinates import joint_coordinates
from PolyPoseLib.kinematics.relative_motion import BonePoses, relative_motion


def axes_of_joints(sequence: Sequence) -> tuple[JointAxes, ...]:
    """Axes of the bones of every joint, so that landmarks are checked before anything is tracked.

    Without joints, every structure is described relative to the reference, by axes of inertia. Raises InputError for
    landmarks that are not known, and for those that name no axes.
    """
    require_known_landmarks(sequence)
    joints = sequence.joints or joints_to(sequence.reference, sequence.structures.names)
    return tuple(joint_axes(sequence, joint) for joint in joints)


def joint_motions(track: Track, sequence: Sequence) -> tuple[JointMotion, ...]:
    """Angles, translations and helical axes of every joint.

    Parameters
    ----------
    track : Track
        What tracking found.
    sequence : Sequence
        What was tracked; its joints and landmarks say what is reported.

    Returns
    -------
    tuple of JointMotion
        In the order of ``sequence.joints``. A structure that is lost in a frame ("none" in its sources) has no motion
        there: NaN.

    Raises
    ------
    InputError
        Landmarks name no axes.

    """
    return tuple(_motion(track, axes) for axes in axes_of_joints(sequence))


def _motion(track: Track, axes: JointAxes) -> JointMotion:
    joint = axes.joint
    motion = relative_motion(
        _bone(track, joint.proximal, axes.proximal.matrix), _bone(track, joint.distal, axes.distal.matrix)
    )
    convention = CONVENTION_TABLE[joint.convention]
    coordinates = joint_coordinates(motion, convention)
    index = np.arange(len(track.frames))
    known = np.flatnonzero(np.isfinite(motion.poses).all(axis=(1, 2)))
    first = np.full_like(index, known[0] if known.size else 0)
    return JointMotion(
        joint,
        axes.proximal,
        axes.distal,
        track.numbers,
        track.numbers / track.frames_per_second,
        convention.angles,
        convention.translations,
        coordinates.angles_deg,
        coordinates.translations_mm,
        coordinates.angles_95_deg,
        coordinates.translations_95_mm,
        coordinates.locked,
        _doubtful(track, joint),
        helical_axes(motion, first),
        helical_axes(motion, np.maximum(index - 1, 0)),
        axes.warnings,
    )


def _bone(track: Track, name: str, axes: np.ndarray) -> BonePoses:
    """One structure's poses, NaN where it is lost."""
    k = track.names.index(name)
    lost = np.array([frame.sources[k] == "none" for frame in track.frames])
    poses, covariances = track.poses[:, k].copy(), track.covariances[:, k].copy()
    poses[lost], covariances[lost] = np.nan, np.nan
    return BonePoses(poses, covariances, track.centroids[k], axes)


def _doubtful(track: Track, joint: Joint) -> np.ndarray:
    places = [track.names.index(name) for name in (joint.proximal, joint.distal)]
    return np.any(track.doubtful[:, places], axis=1)
