"""Connected pieces of a mesh that belong to one bone, such as its own surface or an implant, carried as rigid ones.

A bone's surface lies half a voxel outside of its labels, as a rule: vertex by vertex, half of it would take the bone's
motion and half the displacement field, and the surface would come out rough.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from PolyPoseLib.carrying.points import PointCarrier
from PolyPoseLib.data.carried import DISPLACEMENT_FIELD, CarriedPoints, require_frame

LEAST_SHARE = 0.6
"""Of a piece's vertices in a bone, or within a voxel of it, that makes the piece the bone's."""

MOST_OF_OTHERS = 0.1
"""Of a piece's vertices inside of other bones; with more, it is the surface of several."""

ENOUGH = 4000
"""Vertices of a piece that are looked at."""


def carry_with_pieces(
    carrier: PointCarrier, vertices: np.ndarray, edges: np.ndarray, to: str
) -> tuple[CarriedPoints, dict[str, int]]:
    """Carry the vertices of a mesh, each piece that belongs to one bone by that bone's motion alone.

    Parameters
    ----------
    carrier : PointCarrier
        Of the result.
    vertices : (N, 3) array
        LPS mm.
    edges : (M, 2) array of int
        Pairs of vertices that are connected; vertices at one place are, too.
    to : {"xray", "ct"}
        Where they are carried.

    Returns
    -------
    carried : CarriedPoints
    pieces : dict
        By name of the bone, how many pieces it moved as a whole.

    Raises
    ------
    InputError
        As ``Result.transform_points``.

    """
    carried = carrier(vertices, to)
    count, piece = pieces_of(vertices, edges)
    seen = _sample(piece)
    sizes = np.bincount(piece[seen], minlength=count)
    near = np.stack(
        [
            np.bincount(piece[seen][each], minlength=count)
            for each in carrier.near_bones(vertices[seen], to, _NEIGHBOURS)
        ]
    )
    bone = near.argmax(axis=0)
    names = np.array(carrier.names)
    by = np.array(carried.moved_by)[seen]
    others = (by != names[bone[piece[seen]]]) & (by != DISPLACEMENT_FIELD)
    apart = np.bincount(piece[seen][others], minlength=count)
    whole = (near.max(axis=0) >= LEAST_SHARE * sizes) & (apart <= MOST_OF_OTHERS * sizes) & (sizes > 0)
    pieces = {}
    for k in np.unique(bone[whole]):
        mine = whole & (bone == k)
        which = np.flatnonzero(mine[piece]).tolist()
        carried = carrier.rigidly(carried, vertices, which, str(names[k]), require_frame(to))
        pieces[str(names[k])] = int(np.count_nonzero(mine))
    return carried, pieces


_NEIGHBOURS = np.array(list(product((-1, 0, 1), repeat=3)))
"""(27, 3) steps to the voxels around one."""


def pieces_of(vertices: np.ndarray, edges: np.ndarray) -> tuple[int, np.ndarray]:
    """How many pieces a mesh has, and the piece (N,) of every vertex; vertices at one place are one."""
    if not len(vertices):
        return 0, np.zeros(0, np.int64)
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = int(place.max()) + 1
    ends = place[np.asarray(edges, np.int64).reshape(-1, 2)]
    graph = coo_matrix((np.ones(len(ends), np.int8), (ends[:, 0], ends[:, 1])), shape=(total, total))
    count, piece = connected_components(graph.astype(np.int32), directed=False)
    return int(count), piece[place].astype(np.int64)


def edges_of(faces: np.ndarray) -> np.ndarray:
    """Edges (2 M, 2) that connect the corners of triangles (M, 3)."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])


def _sample(piece: np.ndarray) -> np.ndarray:
    """Indices of vertices that are looked at: all of small pieces, evenly spread ones of large."""
    order = np.argsort(piece, kind="stable")
    sizes = np.bincount(piece)
    start = np.cumsum(sizes) - sizes
    within = np.arange(len(piece)) - start[piece[order]]
    step = -(-sizes // ENOUGH)
    return order[within % np.maximum(step, 1)[piece[order]] == 0]
