"""A CT of tilted slices on a straight grid.

Only displacements within the slices are interpolated: the straight grid keeps their planes and two of their axes.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.volume import Volume


def straight_grid(volume: Volume) -> tuple[np.ndarray, tuple[int, int, int]]:
    """The straight grid that holds a sheared one.

    Parameters
    ----------
    volume
        Any grid.

    Returns
    -------
    affine
        (4, 4) float64, index (i, j, k, 1) to LPS mm, of perpendicular axes.  Along the stack the step is the distance
        of the slices' planes.
    shape
        Voxels along (k, j, i), so many that every voxel of the volume is inside.

    """
    axes = volume.affine[:3, :3]
    directions, stepped = np.linalg.qr(axes[:, (order := _planes_first(axes))])
    straight = np.empty((3, 3))
    straight[:, order] = directions * np.diag(stepped)  # the product has the sign of the axis
    indices = (volume.corners() - volume.affine[:3, 3]) @ np.linalg.inv(straight).T
    first = np.floor(indices.min(0) + 1e-6)
    last = np.ceil(indices.max(0) - 1e-6)
    affine = np.eye(4)
    affine[:3, :3] = straight
    affine[:3, 3] = volume.affine[:3, 3] + straight @ first
    size = (last - first + 1).astype(int)
    return affine, (int(size[2]), int(size[1]), int(size[0]))


def resampled_straight(volume: Volume, outside: float) -> Volume:
    """The volume on its straight grid, by linear interpolation.

    Parameters
    ----------
    volume
        Numbers of any type, best on a sheared grid.
    outside
        Value of the voxels that no slice reaches.

    Returns
    -------
    Volume
        Of the same type of voxels.

    """
    import SimpleITK as sitk

    affine, shape = straight_grid(volume)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    image = sitk.Resample(
        volume.to_sitk(),
        shape[::-1],
        sitk.Transform(3, sitk.sitkIdentity),
        sitk.sitkLinear,
        affine[:3, 3].tolist(),
        spacing.tolist(),
        (affine[:3, :3] / spacing).ravel().tolist(),
        outside,
    )
    return Volume(sitk.GetArrayFromImage(image), affine)


def _planes_first(axes: np.ndarray) -> list[int]:
    """The axes (3, 3) in the order in which they are kept: two that are perpendicular, then that of the stack.

    A tilt leaves one axis perpendicular to both others; of these two the one of longer steps is the stack's.
    """
    steps = np.linalg.norm(axes, axis=0)
    cosines = np.abs((axes / steps).T @ (axes / steps)) * (1 - np.eye(3))
    sheared = divmod(int(np.argmax(cosines)), 3)
    stack = int(max(sheared, key=lambda axis: (round(float(steps[axis]), 6), axis)))
    return [*(axis for axis in range(3) if axis != stack), stack]
