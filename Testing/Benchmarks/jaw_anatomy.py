"""Skull and mandible of the head CT, and a lower row of teeth for it.

The CT ends within the crowns of the upper teeth: of the mandible it has both rami with their condyles and coronoid
processes, and neither teeth nor body. `scanned` leaves it so. `completed` goes on below the scan, where the upper teeth
and their alveolar process, mirrored at the lowest slice, stand for the lower ones; the last of these slices and the
rami's cross-sections go on to the height of a mandible, and all around is the soft tissue of the lowest slice.
Both rows then touch, as in a closed mouth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import binary_fill_holes, binary_propagation, find_objects, grey_dilation

from PolyPoseLib.data.structures import Structures, structures_from_labels
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import connected_components, grown_box

SKULL, MANDIBLE = "skull", "mandible"
LABELS = {SKULL: [1], MANDIBLE: [2]}

LOWER = ("completed", "scanned")
"""What the mandible is made of."""

CORE_HU = 600.0
"""From here on the rami hang together with nothing else: at 500 the right condyle touches its socket."""

BONE_HU = 250.0
STEP_HU = 25.0
"""Bones grow from their cores down to BONE_HU by such steps, so that they meet where the CT is darkest between them."""

LEAST_RAMUS = 1000
"""Voxels of a ramus' core."""

# Cut planes in voxels of this CT, whose arch of teeth they enclose; k = 0 is its lowest slice.
ARCH = (slice(165, None), slice(97, 164))
"""Rows (in front of the rami) and columns (between them)."""

ALVEOLAR_SLICES = 8
"""Slices with teeth and the alveolar process, below the palate: mirrored."""

JAW_SLICES, BELOW_SLICES = 21, 46
"""Height of the mandible below the scan (31 mm), and of all that is added (69 mm, into which an open mouth moves)."""

VERTEBRAE = (slice(0, 9), slice(100, 131), slice(84, 176))
"""Atlas and axis, of which the CT has the upper parts: left out of all structures, so they follow as soft tissue."""

SOFT_HU, SOFT_LIMIT_HU = 50.0, 150.0
"""What takes the place of anything denser below the scan, but the lower jaw."""

MARGIN_VOXELS = 6
"""Air that stays around the head."""

BODY_HU = -400.0


@dataclass(frozen=True, eq=False)
class Head:
    """A head CT and its bones.

    Attributes
    ----------
    ct : Volume
        HU.
    labels : Volume
        As in LABELS, on the CT's grid.

    """

    ct: Volume
    labels: Volume

    @cached_property
    def structures(self) -> Structures:
        """Skull, which is the anchor, and mandible."""
        return structures_from_labels(self.labels, LABELS, self.ct)


def head_of(scan: Volume, lower: str) -> Head:
    """Bones of the head CT; lower: "completed" or "scanned".

    Raises InputError when the scan has no two rami that hang together with nothing else at CORE_HU.
    """
    labels = split_bones(scan.voxels)
    affine = scan.affine.copy()
    voxels = scan.voxels
    if lower == "completed":
        voxels, labels = completed(voxels, labels)
        affine[:3, 3] = scan.to_world(np.array([0.0, 0.0, -BELOW_SLICES]))
    box = _around_head(voxels)
    affine[:3, 3] = Volume(voxels, affine).to_world(
        np.array([part.start for part in box][::-1], dtype=np.float64)
    )
    return Head(
        Volume(np.ascontiguousarray(voxels[box]), affine), Volume(np.ascontiguousarray(labels[box]), affine)
    )


def split_bones(voxels: np.ndarray) -> np.ndarray:
    """Labels (k, j, i) int16 of skull and mandible, 0 elsewhere, from HU (k, j, i) with the feet first.

    Raises InputError as `head_of`.
    """
    spine = np.zeros(voxels.shape, bool)
    spine[VERTEBRAE] = True
    cores, _ = connected_components((voxels >= CORE_HU) & ~spine)
    sizes = np.bincount(cores.ravel())
    sizes[0] = 0
    skull = int(sizes.argmax())
    rami = [n for n in np.unique(cores[0]) if n not in (0, skull) and sizes[n] >= LEAST_RAMUS]
    if len(rami) != 2:
        raise InputError(
            f"The head CT has {len(rami)} bones besides the skull that reach its lowest slice, and not the two rami "
            "of a mandible: give the CT that the benchmark was made for."
        )
    bone = voxels >= BONE_HU
    start = np.where(cores == skull, 1, 0) + np.where(np.isin(cores, rami), 2, 0)
    grown = _grown(voxels, start.astype(np.int16), ~spine)
    mandible = np.stack([np.asarray(binary_fill_holes(part), bool) for part in grown == 2])
    attached = np.asarray(binary_propagation(grown == 1, mask=bone & ~mandible & ~spine))
    labels = attached.astype(np.int16)
    labels[mandible] = 2
    return labels


def completed(voxels: np.ndarray, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """HU and labels (k, j, i) with BELOW_SLICES more slices below, and the lower jaw in them."""
    below = np.repeat(np.where(voxels[:1] > SOFT_LIMIT_HU, SOFT_HU, voxels[:1]), BELOW_SLICES, axis=0)
    found = np.zeros(below.shape, np.int16)
    ramus = labels[0] == 2
    rows, columns = ARCH
    for depth in range(JAW_SLICES):  # 0 is the slice next to the scan
        place = BELOW_SLICES - 1 - depth
        below[place][ramus] = voxels[0][ramus]
        found[place][ramus] = 2
        source = min(depth, ALVEOLAR_SLICES - 1)
        below[place][rows, columns] = voxels[source][rows, columns]
        arch = labels[source][rows, columns] == 1
        found[place][rows, columns][arch] = 2
    below = below.astype(voxels.dtype)
    return np.concatenate([below, voxels]), np.concatenate([found, labels])


def mouth(head: Head) -> Volume:
    """The part of a completed head's CT with both rows of teeth and the room into which the mouth opens."""
    mandible = head.labels.voxels == 2
    box = find_objects(mandible.astype(np.int8))[0]
    top = BELOW_SLICES + ALVEOLAR_SLICES
    part = (slice(0, top), slice(box[1].start, head.ct.shape[1]), box[2])
    affine = head.ct.affine.copy()
    affine[:3, 3] = head.ct.to_world(np.array([each.start for each in part][::-1], dtype=np.float64))
    return Volume(head.ct.voxels[part], affine)


def _grown(voxels: np.ndarray, start: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Labels grown into bone around the mandible's, denser voxels first."""
    box = find_objects((start == 2).astype(np.int8))[0]
    wide = grown_box(box, 8, start.shape)
    found, hu, free = start[wide].copy(), voxels[wide], allowed[wide]
    threshold = CORE_HU
    while threshold > BONE_HU:
        threshold = max(threshold - STEP_HU, BONE_HU)
        inside = (hu >= threshold) & free
        while True:
            near = grey_dilation(found, footprint=_CROSS)
            taken = inside & (found == 0) & (near > 0)
            if not taken.any():
                break
            found[taken] = near[taken]
    out = start.copy()
    out[wide] = found
    return out


_CROSS = np.zeros((3, 3, 3), bool)
_CROSS[1, 1], _CROSS[1, :, 1], _CROSS[:, 1, 1] = True, True, True


def _around_head(voxels: np.ndarray) -> tuple[slice, ...]:
    """The box of the largest piece that is not air, widened in the plane of the slices."""
    pieces, _ = connected_components(voxels > BODY_HU)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    _, *plane = find_objects((pieces == sizes.argmax()).astype(np.int8))[0]
    return slice(0, len(voxels)), *grown_box(tuple(plane), MARGIN_VOXELS, voxels.shape[1:])
