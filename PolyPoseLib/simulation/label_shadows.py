"""True silhouettes of labelled structures: which rays of a camera meet which labels.

They are the truth that renderings of warped labels are compared with, so nothing of PolyPoseLib.rendering is used here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import bounding_box

if TYPE_CHECKING:
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera

_STEP_VOXELS = 0.2
"""Between samples on a ray, of the smallest spacing: what is missed is a voxel's corner, cut shorter than that."""

_BLOCK = 4
"""Voxels along a block's edge."""

_SAMPLES_AT_ONCE = 4_000_000
_BITS = 63


def label_shadows(
    labels: Volume, camera: Camera, groups: Mapping[str, Sequence[int]]
) -> dict[str, np.ndarray]:
    """Where a camera's rays meet structures; structures in front of or behind each other are all met.

    Rays are sampled by the nearest voxel, at a fifth of the smallest spacing. Rays that meet a block full of a
    structure, or no block that holds any of it, are known before that.

    Parameters
    ----------
    labels : Volume
        Whole numbers, 0 is background.
    camera : Camera
        All labels of the groups must lie in front of its source.
    groups : {str: sequence of int}
        Labels of each structure.

    Returns
    -------
    {str: (H, W) array of bool}
        One mask a structure, in the groups' order.

    Raises
    ------
    InputError
        A structure reaches to or behind the source.

    """
    names = list(groups)
    masks: dict[str, np.ndarray] = {}
    for low in range(0, len(names), _BITS):
        part = names[low : low + _BITS]
        met = _met(labels, camera, [groups[name] for name in part])
        masks |= {name: (met >> np.uint64(bit)) & np.uint64(1) > 0 for bit, name in enumerate(part)}
    return masks


def _met(labels: Volume, camera: Camera, groups: Sequence[Sequence[int]]) -> np.ndarray:
    """For every pixel (H, W) uint64, bit n set where its ray meets a label of the nth group."""
    met = np.zeros(camera.height * camera.width, dtype=np.uint64)
    bits = _bits(labels.voxels, groups)
    box = bounding_box(bits)
    if box is None:
        return met.reshape(camera.height, camera.width)
    bits = np.pad(bits[box], 1)
    to_index = np.linalg.inv(labels.affine)
    to_index[:3, 3] -= [side.start - 1 for side in reversed(box)]
    to_world = np.linalg.inv(to_index)
    ends = np.stack(np.meshgrid(*[(0.5, size - 1.5) for size in bits.shape[::-1]], indexing="ij"), axis=-1)
    corners = ends.reshape(8, 3) @ to_world[:3, :3].T + to_world[:3, 3]
    depths = camera.depth(corners)
    if depths.min() <= 0:
        raise InputError("The X-ray source lies inside or behind the labels: check the camera and its units.")
    pixels = _rays_near(camera, corners)
    spacing = float(labels.spacing.min())
    span = (float(depths.min()), float(depths.max()) + spacing)
    rays = _Rays(
        to_index[:3, :3] @ camera.source + to_index[:3, 3],
        camera.pixel_directions().reshape(-1, 3)[pixels] @ to_index[:3, :3].T,
    )
    full, some = _blocks(bits)
    marks = np.arange(*span, spacing)
    sure = rays.in_blocks(1).along(full, marks)
    unsure = np.flatnonzero(rays.in_blocks(2).along(some, marks) != sure)
    sure[unsure] |= rays.part(unsure).along(bits, np.arange(*span, _STEP_VOXELS * spacing))
    met[pixels] = sure
    return met.reshape(camera.height, camera.width)


@dataclass(frozen=True)
class _Rays:
    """Rays in index coordinates (i, j, k): from start (3,) along slopes (N, 3), at depth 1 mm."""

    start: np.ndarray
    slopes: np.ndarray

    def part(self, chosen: np.ndarray) -> _Rays:
        """Some of the rays, by their numbers."""
        return _Rays(self.start, self.slopes[chosen])

    def in_blocks(self, padding: int) -> _Rays:
        """The rays in the index coordinates of blocks, whose volume is padded by so many."""
        return _Rays((self.start + 0.5) / _BLOCK - 0.5 + padding, self.slopes / _BLOCK)

    def along(self, bits: np.ndarray, marks: np.ndarray) -> np.ndarray:
        """All bits (N,) of the voxels nearest to points at depths marks (M,); the outermost voxels must be 0."""
        met = np.zeros(len(self.slopes), dtype=np.uint64)
        at_once = max(1, _SAMPLES_AT_ONCE // len(marks))
        for low in range(0, len(met), at_once):
            part = slice(low, low + at_once)
            place = np.zeros((len(met[part]), len(marks)), dtype=np.int64)
            stride = 1
            for axis, size in enumerate(bits.shape[::-1]):
                # What is outside lands in the outermost voxels, which are empty.
                index = np.rint(self.start[axis] + self.slopes[part, axis, None] * marks)
                place += np.clip(index, 0, size - 1).astype(np.int64) * stride
                stride *= size
            met[part] = np.bitwise_or.reduce(bits.ravel()[place], axis=1)
        return met


def _blocks(bits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bits of all voxels of a block, padded by one block; those of any in it or beside it, padded by two."""
    whole = np.pad(bits, [(0, -size % _BLOCK) for size in bits.shape])
    cells = whole.reshape([part for size in whole.shape for part in (size // _BLOCK, _BLOCK)])
    full = np.pad(np.bitwise_and.reduce(cells, axis=(1, 3, 5)), 1)
    # A ray that meets a voxel between two marks has a mark in a neighbouring block; those take one of the empty layers.
    some = np.pad(np.bitwise_or.reduce(cells, axis=(1, 3, 5)), 2)
    for axis in range(3):
        some = some | np.roll(some, 1, axis) | np.roll(some, -1, axis)
    return full, some


def _bits(voxels: np.ndarray, groups: Sequence[Sequence[int]]) -> np.ndarray:
    """Labels as bits of the groups that they belong to, (k, j, i) uint64."""
    highest = int(voxels.max(initial=0))
    table = np.zeros(highest + 1, dtype=np.uint64)
    for bit, numbers in enumerate(groups):
        for number in numbers:
            if 0 < number <= highest:
                table[number] |= np.uint64(1) << np.uint64(bit)
    return table[voxels]


def _rays_near(camera: Camera, corners: np.ndarray) -> np.ndarray:
    """Flat numbers of the pixels within the rectangle that a box's corners (8, 3) project to."""
    image = camera.project(corners)
    (left, top), (right, bottom) = np.floor(image.min(axis=0)), np.ceil(image.max(axis=0))
    rows = np.arange(max(int(top), 0), min(int(bottom), camera.height - 1) + 1)
    columns = np.arange(max(int(left), 0), min(int(right), camera.width - 1) + 1)
    return (rows[:, None] * camera.width + columns).ravel()
