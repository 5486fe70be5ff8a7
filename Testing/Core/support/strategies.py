"""Random motions, grids and cameras for the tests of properties (hypothesis)."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix

LARGEST_MM = 500.0

unit = st.floats(-1, 1)
shift_mm = st.floats(-LARGEST_MM, LARGEST_MM)


@st.composite
def logarithms(draw: st.DrawFn, largest_rad: float = np.pi - 1e-9) -> np.ndarray:
    """(6,) rotation vector rad and translation part mm; angles of 0 and beside 0 and the largest one are frequent."""
    axis = np.array([draw(unit), draw(unit), draw(unit)])
    length = np.linalg.norm(axis)
    axis = axis / length if length > 1e-3 else np.array([0.0, 0.0, 1.0])
    near = st.floats(1e-12, 1e-3)
    angle = draw(st.floats(0, largest_rad) | st.just(0.0) | near | near.map(lambda gap: largest_rad - gap))
    return np.concatenate([angle * axis, [draw(shift_mm), draw(shift_mm), draw(shift_mm)]])


@st.composite
def motions(draw: st.DrawFn, largest_rad: float = np.pi, largest_mm: float = LARGEST_MM) -> np.ndarray:
    """(4, 4) rigid motions in mm."""
    vector = draw(logarithms(largest_rad))
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(vector[:3]).as_matrix()
    motion[:3, 3] = vector[3:] * largest_mm / LARGEST_MM
    return motion


@st.composite
def affines(draw: st.DrawFn, least_mm: float = 0.5, largest_mm: float = 4.0) -> np.ndarray:
    """(4, 4) of grids: any orientation, either handedness, another spacing along every axis."""
    affine = draw(motions())
    spacing = [draw(st.floats(least_mm, largest_mm)) for _ in range(3)]
    affine[:3, :3] *= spacing * np.array([draw(st.sampled_from([1, -1])), 1, 1])
    return affine


@st.composite
def cameras(draw: st.DrawFn, smallest: int = 1, largest: int = 40) -> Camera:
    """Any pose, pixels that need not be square, and a principal point that may lie outside the image."""
    height, width = draw(st.integers(smallest, largest)), draw(st.integers(smallest, largest))
    spacing = [draw(st.floats(0.1, 2)), draw(st.floats(0.1, 2))]
    principal_point = [draw(st.floats(-20, 60)), draw(st.floats(-20, 60))]
    intrinsics = intrinsics_matrix(draw(st.floats(500, 2000)), spacing, height, width, principal_point)
    return Camera(intrinsics, draw(motions()), height, width)
