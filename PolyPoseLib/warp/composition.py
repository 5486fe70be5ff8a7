"""A CT taken apart into bones and filled soft tissue, and put together again in another posture.

A smooth warp tears where bones touch in the CT and part later: what lies between them is stretched from bone.
Composition avoids that. The bones are taken out of the CT and their places are filled in from the soft tissue
around; the filled CT follows the smooth warp; and every bone, with the rim of voxels that it shares with its
surroundings, is resampled rigidly and laid over it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box, grown_box
from PolyPoseLib.geometry.rigid import require_rigid, rigid_inverse
from PolyPoseLib.warp.dense import AnyWarp, warp_labels, warp_volume
from PolyPoseLib.warp.distances import distance_at_voxels
from PolyPoseLib.warp.infill import fill_harmonic
from PolyPoseLib.warp.parts import connected_parts
from PolyPoseLib.warp.vote import LabelVote

if TYPE_CHECKING:
    import torch

RIM_VOXELS = 1
"""Labels are grown by so many voxels, because a bone's outermost voxels are partly soft tissue."""

BRIGHT_HU = 150.0
"""Voxels at least this dense that touch a grown label belong to the bone: labels often miss its cortex."""

BRIGHT_REACH_MM = 3.0
"""How far beyond its label a bone may take such voxels."""


def grow_regions(
    ct_voxels: np.ndarray, labels: np.ndarray, spacing: np.ndarray, rim_voxels: int = RIM_VOXELS
) -> np.ndarray:
    """Labels with the rim that each structure shares with its surroundings, int16 (k, j, i).

    Every structure grows by rim_voxels (neighbours by a corner included), then along bright voxels
    (BRIGHT_HU) connected to it, up to BRIGHT_REACH_MM. Labelled voxels keep their label; where two structures
    want the same voxel the nearer one gets it.

    Parameters
    ----------
    ct_voxels : (k, j, i) array
        HU.
    labels : (k, j, i) array
        0 is background.
    spacing : (3,) array
        mm along (i, j, k).
    rim_voxels : int
        By how many voxels every structure grows.

    Returns
    -------
    (k, j, i) array of int16
        The grown labels.

    Raises
    ------
    InputError
        The shapes differ.

    """
    from scipy.ndimage import binary_dilation, binary_propagation

    _require_same_shape(ct_voxels, labels)
    spacing = np.asarray(spacing, dtype=np.float64)
    border = np.maximum(np.ceil(BRIGHT_REACH_MM / spacing[::-1]).astype(int), rim_voxels) + 1
    grown = np.array(labels, dtype=np.int16)
    nearest = np.full(labels.shape, np.inf, dtype=np.float16)
    for part in connected_parts(labels, border):
        box, mask = part.box, part.mask
        free = labels[box] == 0
        distance = distance_at_voxels(mask, spacing, np.zeros(3, dtype=int))
        rim = binary_dilation(mask, np.ones((3, 3, 3)), iterations=rim_voxels) if rim_voxels else mask
        bright = (ct_voxels[box] >= BRIGHT_HU) & (distance <= BRIGHT_REACH_MM) & free
        taken = binary_propagation(rim, mask=rim | bright) & free & (distance < nearest[box])
        grown[box][taken] = part.label
        nearest[box][taken] = distance[taken]
    return grown


def fill_structures(
    ct_voxels: np.ndarray, mask: np.ndarray, spacing: np.ndarray, grow: bool = True
) -> np.ndarray:
    """A CT without its bones: the structures' places filled in harmonically from the soft tissue around.

    Parameters
    ----------
    ct_voxels : (k, j, i) array
        HU.
    mask : (k, j, i) array
        Voxels of any structure (bool or labels).
    spacing : (3,) array
        mm along (i, j, k).
    grow : bool
        First grow the mask by its rim (see grow_regions), so that no halo stays; False when it was grown already.

    Returns
    -------
    (k, j, i) array of float32
        HU, equal to the CT outside the grown mask. Voxels brighter than BRIGHT_HU outside the mask (other bones,
        metal) stay as they are and do not contribute to the filling.

    Raises
    ------
    InputError
        The shapes differ.

    """
    _require_same_shape(ct_voxels, mask)
    region = mask != 0
    if grow:
        region = grow_regions(ct_voxels, region.astype(np.int16), spacing) > 0
    filled = np.array(ct_voxels, dtype=np.float32)
    box = bounding_box(region)
    if box is None:
        return filled
    wide = grown_box(box, 2, region.shape)
    values, wanted = filled[wide], region[wide]
    filled[wide] = fill_harmonic(values, wanted, (values >= BRIGHT_HU) & ~wanted, spacing)
    return filled


def compose_warped_ct(
    ct: Volume,
    structures: Structures,
    poses: ArrayLike,
    warp: AnyWarp,
    reference: Volume | None = None,
    device: torch.device | None = None,
) -> Volume:
    """The CT in the fixed frame with every bone exactly rigid and no stretched bone between them.

    Each bone covers the soft tissue by its region's mask, trilinear; where two bones overlap they share.

    Parameters
    ----------
    ct : Volume
        Moving, HU.
    structures : Structures
        On the CT's grid.
    poses : (K, 4, 4) array_like
        Fixed to moving, rigid.
    warp : AnyWarp
        Fixed to moving, for the soft tissue.
    reference : Volume, optional
        Gives the fixed grid; None takes the CT's own.
    device : torch.device, optional
        Where torch warps the soft tissue, as in :func:`PolyPoseLib.warp.dense.warp_volume`.

    Returns
    -------
    Volume
        float32 HU, -1000 outside. With all motions at rest it is the CT itself.

    Raises
    ------
    InputError
        Poses that are not rigid or do not fit the structures.

    """
    _require_same_shape(ct.voxels, structures.labels)
    motions = _rigid_poses(poses, structures.names)
    regions = grow_regions(ct.voxels, structures.labels, ct.spacing)
    filled = fill_structures(ct.voxels, regions, ct.spacing, grow=False)
    out = warp_volume(Volume(filled, ct.affine), warp, reference, device=device)
    cover = np.zeros(out.shape, dtype=np.float32)
    bones = np.zeros(out.shape, dtype=np.float32)
    for piece in _pieces(regions, Volume(ct.voxels, ct.affine), motions, out):
        inside = piece.mask
        values = np.where(inside, ct.voxels[piece.moving], filled[piece.moving]).astype(np.float32)
        alpha = piece.resample(inside.astype(np.float32))
        cover[piece.fixed] += alpha
        bones[piece.fixed] += alpha * piece.resample(values)
    np.divide(bones, cover, out=bones, where=cover > 1)
    np.minimum(cover, 1, out=cover)
    cover -= 1
    out.voxels[...] *= -cover
    out.voxels[...] += bones
    return out


def compose_warped_labels(
    labels: Volume,
    structures: Structures,
    poses: ArrayLike,
    warp: AnyWarp,
    reference: Volume | None = None,
    device: torch.device | None = None,
) -> Volume:
    """A label map in the fixed frame that fits compose_warped_ct: bones moved rigidly, all else by the warp.

    Parameters
    ----------
    labels : Volume
        Moving, whole numbers, on the structures' grid (a source segmentation with its own numbers, or the
        structures' labels).
    structures : Structures
        On the labels' grid.
    poses : (K, 4, 4) array_like
        Fixed to moving, rigid.
    warp : AnyWarp
        Fixed to moving, for the soft tissue.
    reference : Volume, optional
        Gives the fixed grid; None takes the labels' own.
    device : torch.device, optional
        Where torch warps the soft tissue, as in :func:`PolyPoseLib.warp.dense.warp_labels`.

    Returns
    -------
    Volume
        Every voxel has the label whose interpolated mask is largest.

    Raises
    ------
    InputError
        Poses that are not rigid or do not fit the structures.

    """
    _require_same_shape(labels.voxels, structures.labels)
    motions = _rigid_poses(poses, structures.names)
    soft = labels.with_voxels(np.where(structures.labels > 0, 0, labels.voxels).astype(labels.voxels.dtype))
    out = warp_labels(soft, warp, reference, device=device)
    for piece in _pieces(structures.labels, labels, motions, out):
        found = piece.vote(np.where(piece.mask, labels.voxels[piece.moving], 0).astype(labels.voxels.dtype))
        target = out.voxels[piece.fixed]
        target[found != 0] = found[found != 0]
    return out


@dataclass(frozen=True)
class _Piece:
    """One part of a structure in the moving and in the fixed grid, and the affine between their indices.

    moving, fixed: slices (k, j, i); mask: where the part is in the moving box; to_moving: (4, 4) index (i, j, k)
    inside the fixed box to index inside the moving box.
    """

    moving: tuple[slice, ...]
    mask: np.ndarray
    fixed: tuple[slice, ...]
    to_moving: np.ndarray

    @property
    def shape(self) -> tuple[int, ...]:
        """Voxels (k, j, i) of the fixed box."""
        return tuple(s.stop - s.start for s in self.fixed)

    def resample(self, values: np.ndarray) -> np.ndarray:
        """Values (k, j, i) of the moving box on the fixed box, trilinear, 0 outside."""
        import SimpleITK as sitk

        transform = sitk.AffineTransform(3)
        transform.SetMatrix(self.to_moving[:3, :3].ravel().tolist())
        transform.SetTranslation(self.to_moving[:3, 3].tolist())
        size = [int(n) for n in self.shape[::-1]]
        image = sitk.GetImageFromArray(values)
        return sitk.GetArrayFromImage(sitk.Resample(image, size, transform, sitk.sitkLinear))

    def vote(self, labels: np.ndarray) -> np.ndarray:
        """Labels (k, j, i) of the moving box on the fixed box, by the largest trilinear weight."""
        return LabelVote(labels).on_grid(self.to_moving, self.shape)


def _pieces(labels: np.ndarray, moving: Volume, motions: np.ndarray, fixed: Volume) -> Iterator[_Piece]:
    """The parts of all structures that reach the fixed grid, each with one voxel of border."""
    limit = np.array(fixed.shape[::-1])
    for part in connected_parts(labels, 1):
        pose = motions[part.label - 1]
        first = np.array([s.start for s in part.box[::-1]], dtype=np.float64)
        last = np.array([s.stop - 1 for s in part.box[::-1]], dtype=np.float64)
        corners = np.stack(np.meshgrid(*zip(first, last, strict=True), indexing="ij"), axis=-1).reshape(8, 3)
        back = rigid_inverse(pose)
        places = fixed.to_index(moving.to_world(corners) @ back[:3, :3].T + back[:3, 3])
        low = np.clip(np.floor(places.min(axis=0)).astype(int), 0, limit)
        high = np.clip(np.ceil(places.max(axis=0)).astype(int) + 1, 0, limit)
        if (high <= low).any():
            continue
        to_moving = np.linalg.inv(moving.affine) @ pose @ fixed.affine
        to_moving[:3, 3] += to_moving[:3, :3] @ low - first
        window = tuple(slice(int(a), int(b)) for a, b in zip(low[::-1], high[::-1], strict=True))
        yield _Piece(part.box, part.mask, window, to_moving)


def _rigid_poses(poses: ArrayLike, names: tuple[str, ...]) -> np.ndarray:
    """Poses (K, 4, 4) checked, one for each name."""
    motions = np.asarray(poses, dtype=np.float64)
    if motions.shape != (len(names), 4, 4):
        raise InputError(
            f"There are {len(names)} structures but poses of shape {motions.shape}: give one 4x4 each."
        )
    return np.stack([require_rigid(m, f"the motion of '{n}'") for m, n in zip(motions, names, strict=True)])


def _require_same_shape(voxels: np.ndarray, labels: np.ndarray) -> None:
    """Refuse labels that are not on the voxels' grid."""
    if voxels.shape != labels.shape:
        raise InputError(
            f"The CT has {voxels.shape} voxels and the labels have {labels.shape}: resample them onto the CT."
        )
