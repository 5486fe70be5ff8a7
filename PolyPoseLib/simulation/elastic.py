"""Linear elasticity: soft tissue between rigidly moved bones as an elastic body with a free skin.

The displacement is given at the bones; tissue in between is one isotropic, nearly incompressible material in
equilibrium, air is a thousand times softer. Like :mod:`PolyPoseLib.simulation.harmonic` it is independent of the
registration's model, and it differs from it where it matters: tissue around a bone turns with it as far as the skin.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.simulation.nearest import nearest_known

POISSON = 0.45
AIR_STIFFNESS = 1e-3

_CORNERS = np.array([(k, j, i) for k in (0, 1) for j in (0, 1) for i in (0, 1)])
_GAUSS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))


def solve_elastic(
    values: np.ndarray,
    known: np.ndarray,
    tissue: np.ndarray,
    spacing: np.ndarray,
    tolerance: float = 3e-4,
    iterations: int = 1500,
) -> np.ndarray:
    """Extend a displacement from the nodes where it is known to the whole grid.

    Trilinear finite elements of the size of the grid's cells, the change of volume integrated at their middles only
    to avoid locking; conjugate gradients with Jacobi's preconditioner.

    Parameters
    ----------
    values : (3, k, j, i) array
        mm along the axes (i, j, k) of the grid, read at known nodes only.
    known : (k, j, i) array of bool
        Where the displacement is known.
    tissue : (k, j, i) array of bool
        Nodes in the body.
    spacing : (3,) array
        Node distance along (k, j, i) in mm.
    tolerance : float
        Residual relative to that of the initial field.
    iterations : int
        Limit of conjugate-gradient steps.

    Returns
    -------
    (3, k, j, i) array of float32
        Equal to values where known; zero everywhere when nothing is known.

    References
    ----------
    T. Hughes, "The Finite Element Method", 2000, section 4.4.

    """
    if not known.any():
        return np.zeros_like(values, dtype=np.float32)
    stiffness = element_stiffness(np.asarray(spacing, np.float64))
    body = tissue | known
    share = sum(body[_corner(corner, known.shape)].astype(np.float32) for corner in _CORNERS) / 8
    scale = np.where(share >= 0.5, 1.0, AIR_STIFFNESS)
    free = ~known
    field = 0.5 * values[(slice(None), *nearest_known(free, spacing))].astype(np.float64)
    field[:, known] = values[:, known]
    diagonal = _diagonal(stiffness, scale, known.shape)
    residual = -_forces(field, stiffness, scale) * free
    limit = tolerance * np.linalg.norm(residual)
    step = residual / diagonal
    energy = float((residual * step).sum())
    for _ in range(iterations):
        if np.linalg.norm(residual) <= limit:
            break
        image = _forces(step, stiffness, scale) * free
        length = energy / float((step * image).sum())
        field += length * step
        residual -= length * image
        conditioned = residual / diagonal
        fresh = float((residual * conditioned).sum())
        step = conditioned + fresh / energy * step
        energy = fresh
    return field.astype(np.float32)


def element_stiffness(spacing: np.ndarray) -> np.ndarray:
    """(24, 24) stiffness of one cell of Young's modulus 1: eight corners (k, j, i) with components along (i, j, k).

    Parameters
    ----------
    spacing : (3,) array
        mm along (k, j, i).

    """
    volumetric = POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    shear = 1 / (2 * (1 + POISSON))
    by_shear = shear * np.diag([2.0, 2, 2, 1, 1, 1])
    by_volume = np.zeros((6, 6))
    by_volume[:3, :3] = volumetric
    stiffness = np.zeros((24, 24))
    for place in ((k, j, i) for k in _GAUSS for j in _GAUSS for i in _GAUSS):
        strain = _strain(np.array(place), spacing)
        stiffness += strain.T @ by_shear @ strain / 8
    strain = _strain(np.full(3, 0.5), spacing)
    return (stiffness + strain.T @ by_volume @ strain) * float(np.prod(spacing))


def _strain(place: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """(6, 24) strains xx, yy, zz, xy, yz, zx at a place (k, j, i) of the unit cell by the corners' displacements."""
    strain = np.zeros((6, 24))
    for corner, at in enumerate(_CORNERS):
        weights = np.where(at == 1, place, 1 - place)
        slopes = np.where(at == 1, 1.0, -1.0) / spacing
        z, y, x = (slopes[n] * np.prod(np.delete(weights, n)) for n in range(3))
        first = 3 * corner
        strain[0, first], strain[1, first + 1], strain[2, first + 2] = x, y, z
        strain[3, first], strain[3, first + 1] = y, x
        strain[4, first + 1], strain[4, first + 2] = z, y
        strain[5, first], strain[5, first + 2] = z, x
    return strain


def _forces(field: np.ndarray, stiffness: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Forces (3, k, j, i) on the nodes for displacements (3, k, j, i); scale: (k-1, j-1, i-1) of the cells."""
    shape = field.shape[1:]
    corners = np.concatenate([field[(slice(None), *_corner(at, shape))] for at in _CORNERS])
    pushed = (stiffness @ corners.reshape(24, -1)).reshape(corners.shape) * scale
    forces = np.zeros_like(field)
    for n, at in enumerate(_CORNERS):
        forces[(slice(None), *_corner(at, shape))] += pushed[3 * n : 3 * n + 3]
    return forces


def _diagonal(stiffness: np.ndarray, scale: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Diagonal (3, k, j, i) of the whole stiffness."""
    diagonal = np.zeros((3, *shape))
    for n, at in enumerate(_CORNERS):
        own = np.diag(stiffness)[3 * n : 3 * n + 3]
        diagonal[(slice(None), *_corner(at, shape))] += own[:, None, None, None] * scale
    return diagonal


def _corner(at: np.ndarray, shape: tuple[int, ...]) -> tuple[slice, ...]:
    """One corner (k, j, i) of all cells of a grid of nodes."""
    return tuple(slice(step, size - 1 + step) for step, size in zip(at, shape, strict=True))
