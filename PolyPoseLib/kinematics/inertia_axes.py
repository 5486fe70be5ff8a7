"""Axes of a bone from its own shape: the principal axes of inertia of its voxels."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from PolyPoseLib.data.tracking.joint_motion import BoneAxes

ALIKE = 0.1
"""Variances of a bone along two principal axes that differ by less than this share do not tell the two apart."""

_LATERAL = {"left": 1.0, "right": -1.0, "none": -1.0}


def patient_axes(side: str) -> np.ndarray:
    """(3, 3) columns x (front), y (head) and z (to the side, or to the right) of the patient, in the CT's LPS."""
    return np.array([[0.0, 0.0, _LATERAL[side]], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def inertia_axes(points: np.ndarray, side: str) -> BoneAxes:
    """Principal axes through the centroid, each named and directed like the patient's axis that it is nearest to.

    Of all ways to name and direct them, the one is taken that lies closest to the patient's axes together. Axes that
    the bone's shape does not tell apart (a round shaft has no front) are turned as close to the patient's as possible.

    Parameters
    ----------
    points : (N, 3) ndarray
        Centres of the bone's voxels in the CT, LPS mm.
    side : {"left", "right", "none"}
        Of the joint.

    Returns
    -------
    BoneAxes
        Mirrored bones on both sides have mirrored axes.

    """
    centre = points.mean(axis=0)
    offsets = points - centre
    variances, principal = np.linalg.eigh(offsets.T @ offsets / len(points))
    patient = patient_axes(side)
    alike = np.diff(variances) <= ALIKE * variances[1:]
    matrix = np.eye(4)
    matrix[:3, 3] = centre
    note = ""
    if alike.all():
        matrix[:3, :3] = patient
        note = "the bone's shape has no axes of its own: the patient's axes in the CT"
    elif alike.any():
        matrix[:3, :3] = _nearest_with(principal[:, 2 if alike[0] else 0], patient)
        note = "two of the bone's axes are alike: they are turned like the patient's in the CT"
    else:
        matrix[:3, :3] = _nearest_arrangement(principal, patient)
    return BoneAxes(matrix, "inertia", note)


def _nearest_arrangement(principal: np.ndarray, patient: np.ndarray) -> np.ndarray:
    """Principal axes (3, 3, columns) in the order and with the signs that lie closest to the patient's."""
    hand = np.linalg.det(patient)
    ways = (
        principal[:, list(order)] * signs
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    )
    fitting = [way for way in ways if np.linalg.det(way) * hand > 0]
    return max(fitting, key=lambda way: float((way * patient).sum()))


def _nearest_with(axis: np.ndarray, patient: np.ndarray) -> np.ndarray:
    """The patient's axes, turned as little as possible so that one of them is the given axis."""
    along = axis @ patient
    which = int(np.abs(along).argmax())
    target = axis * np.sign(along[which])
    source = patient[:, which]
    # The smallest rotation between unit vectors: R = I + K + K^2 / (1 + cos), K the cross product's matrix.
    x, y, z = np.cross(source, target)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return (np.eye(3) + cross + cross @ cross / (1 + source @ target)) @ patient
