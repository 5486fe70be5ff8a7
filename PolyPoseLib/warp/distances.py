"""Exact Euclidean distances to one structure: at every voxel, or only at the nodes of a coarser parallel grid.

Distances are signed: 0 at voxels on the structure's border, negative inside, positive outside, in mm between
voxel centres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from PolyPoseLib.warp.parts import connected_parts


def distance_at_voxels(mask: np.ndarray, spacing: np.ndarray, pad: np.ndarray) -> np.ndarray:
    """Signed distance at every voxel and up to pad voxels beyond.

    C. Maurer et al., "A linear time algorithm for computing exact Euclidean distance transforms", TPAMI 2003, as
    in ITK.

    Parameters
    ----------
    mask : (k, j, i) array of bool
        Not empty.
    spacing : (3,) array
        mm along (i, j, k).
    pad : (3,) array
        Voxels along (i, j, k).

    Returns
    -------
    (k + 2 pad_k, j + 2 pad_j, i + 2 pad_i) array of float32
        mm.

    """
    import SimpleITK as sitk

    image = sitk.GetImageFromArray(np.pad(mask.view(np.uint8), [(int(p), int(p)) for p in pad[::-1]]))
    image.SetSpacing(spacing.tolist())
    return sitk.GetArrayFromImage(
        sitk.SignedMaurerDistanceMap(
            image, insideIsPositive=False, squaredDistance=False, useImageSpacing=True
        )
    )


def distance_at_nodes(
    mask: np.ndarray, box: tuple[slice, ...], spacing: np.ndarray, nodes: Sequence[np.ndarray]
) -> np.ndarray:
    """Signed distance at the nodes of a grid whose axes are parallel to the voxels'.

    Parameters
    ----------
    mask : (k, j, i) array of bool
        The structure's voxels inside its box.
    box : tuple[slice, ...]
        Slices (k, j, i) of that box among all voxels.
    spacing : (3,) array
        mm along (i, j, k).
    nodes : Sequence[np.ndarray]
        Ascending positions of the nodes along i, j and k in voxels, three arrays.

    Returns
    -------
    (k, j, i) array of float32
        mm at the nodes; exact farther than a voxel from the structure, interpolated between the voxels' distances
        nearer and inside.

    """
    try:
        from PolyPoseLib.warp.envelope_kernel import lower_envelope
    except ImportError:
        return distance_at_nodes_by_voxels(mask, box, spacing, nodes)
    first = [box[2 - n].start for n in range(3)]
    places = [(np.asarray(nodes[n], dtype=np.float64) - first[n]) * spacing[n] for n in range(3)]
    # Squared distances are separable: one axis after another, from the voxels in the box to all nodes.
    squared = np.where(mask, np.float32(0), np.float32(np.inf))
    for axis in (2, 1, 0):
        n = 2 - axis
        squared = np.ascontiguousarray(np.moveaxis(squared, axis, 1))
        out = np.empty((squared.shape[0], len(places[n]), squared.shape[2]), dtype=np.float32)
        lower_envelope(squared, float(spacing[n]), places[n], out)
        squared = np.moveaxis(out, 1, axis)
    distance = np.sqrt(squared, order="C")
    _interpolate_near(distance, mask, spacing, places)
    return distance


def distance_at_nodes_by_voxels(
    mask: np.ndarray, box: tuple[slice, ...], spacing: np.ndarray, nodes: Sequence[np.ndarray]
) -> np.ndarray:
    """The same as distance_at_nodes where numba is not installed: all voxels' distances, interpolated."""
    from scipy.ndimage import map_coordinates

    pad = []
    for n in range(3):
        start, stop = box[2 - n].start, box[2 - n].stop
        pad.append(
            (max(start - int(np.floor(nodes[n][0])), 0), max(int(np.ceil(nodes[n][-1])) + 1 - stop, 0))
        )
    signed = distance_at_voxels(np.pad(mask, pad[::-1]), spacing, np.zeros(3, dtype=int))
    index = [np.asarray(nodes[n]) - box[2 - n].start + pad[n][0] for n in range(3)]
    out = np.empty([len(nodes[2 - axis]) for axis in range(3)], dtype=np.float32)
    for layer, k in zip(out, index[2], strict=True):
        place = np.broadcast_arrays(k, index[1][:, None], index[0][None])
        map_coordinates(signed, place, output=layer, order=1, mode="nearest")
    return out


def _interpolate_near(
    distance: np.ndarray, mask: np.ndarray, spacing: np.ndarray, places: Sequence[np.ndarray]
) -> None:
    """Replace the distance (k, j, i) at nodes in and near a structure by the voxels' signed one, in place.

    mask: (k, j, i) of the structure's box; places: mm of the nodes along i, j, k from the box's first voxel.
    """
    from scipy.ndimage import map_coordinates

    for part in connected_parts(np.pad(mask, 2).astype(np.int8), 2):
        signed = distance_at_voxels(part.mask, spacing, np.zeros(3, dtype=int))
        index, window = [], []
        for axis in range(3):
            position = places[2 - axis] / spacing[2 - axis] + 2 - part.box[axis].start
            inside = np.flatnonzero((position >= 0) & (position <= part.mask.shape[axis] - 1))
            window.append(slice(inside[0], inside[-1] + 1) if len(inside) else slice(0, 0))
            index.append(position[window[-1]])
        view = distance[tuple(window)]
        near = np.nonzero(view < spacing.max())
        place = [index[axis][near[axis]] for axis in range(3)]
        view[near] = np.minimum(view[near], map_coordinates(signed, place, order=1, mode="nearest"))
