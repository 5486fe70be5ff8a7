"""Structures: sets of labels that each move as one rigid body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.segmentation import AbsentLabelError, Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, nearest

OVERLAP_TOLERANCE = 0.02
"""Share of the smaller structure's voxels that a larger one may also claim; those stay with the smaller one."""

FEW_VOXELS = 64
"""A structure with fewer voxels than this gets a warning: it can hardly be located in an X-ray."""

MAX_STRUCTURES = 1000
"""More names are a mistake, and int16 labels must hold them."""


@dataclass(frozen=True)
class Structures:
    """Which voxel of the CT belongs to which structure.

    Attributes
    ----------
    names
        One per structure, all different.
    labels
        (k, j, i) int16 on the CT's grid; 0 is background, n belongs to names[n - 1].

    Raises
    ------
    InputError
        From the constructor: a structure without voxels, or a voxel of no structure.

    """

    names: tuple[str, ...]
    labels: np.ndarray
    _counts: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Validate, and fix the types."""
        names = tuple(self.names)
        labels = np.asarray(self.labels)
        if labels.ndim != 3 or not np.issubdtype(labels.dtype, np.integer):
            raise InputError("The labels of structures must be a three-dimensional array of whole numbers.")
        if not names:
            raise InputError('"structures" is empty: name at least the anchor with its labels.')
        if len(names) > MAX_STRUCTURES:
            raise InputError(f'"structures" holds {len(names)} names: give at most {MAX_STRUCTURES}.')
        if len(set(names)) != len(names) or not all(isinstance(name, str) and name for name in names):
            raise InputError("Every structure needs a name of its own that is not empty.")
        low, high = int(labels.min()), int(labels.max())
        if low < 0 or high > len(names):
            raise InputError(
                f"The labels of structures run from {low} to {high} but there are {len(names)} names: "
                "0 is background and n is the nth name."
            )
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "labels", labels.astype(np.int16, copy=False))
        # Counted once: on a large CT that takes a second, and weights ask for it again and again.
        object.__setattr__(self, "_counts", _count(self.labels, len(names)))
        for name, count in zip(names, self._counts, strict=True):
            if count == 0:
                raise InputError(f'Structure "{name}" has no voxel: remove it or give it labels that it has.')

    def __len__(self) -> int:
        """How many structures there are."""
        return len(self.names)

    def index(self, name: str) -> int:
        """Position of a structure in names; raises InputError when there is none of that name."""
        if name not in self.names:
            similar = nearest(name, self.names)
            fix = f'did you mean "{similar}"?' if similar else f"give one of {', '.join(self.names)}."
            raise InputError(f'There is no structure "{name}": {fix}')
        return self.names.index(name)

    def mask(self, name: str) -> np.ndarray:
        """Where a structure is, (k, j, i) bool."""
        return self.labels == self.index(name) + 1

    def voxel_counts(self) -> np.ndarray:
        """Voxels of each structure, (K,) int64."""
        return self._counts.copy()

    def volume_share(self) -> np.ndarray:
        """Share of each structure in the volume of all, (K,) float64, sum 1: the masses m_k of the weights."""
        counts = self.voxel_counts()
        return counts / counts.sum()

    def centroids(self, affine: np.ndarray) -> np.ndarray:
        """Mean of each structure's voxel centres in LPS mm, (K, 3); affine maps (i, j, k, 1) to LPS mm."""
        flat = np.flatnonzero(self.labels)
        owner = self.labels.ravel()[flat]
        counts = self.voxel_counts()
        indices = np.unravel_index(flat, self.labels.shape)[::-1]
        means = [np.bincount(owner, axis, len(self.names) + 1)[1:] / counts for axis in indices]
        return np.stack(means, axis=-1) @ affine[:3, :3].T + affine[:3, 3]


def structures_from_labels(
    labels: Volume, groups: Mapping[str, Sequence[int | str]], ct: Volume
) -> Structures:
    """Structures on the CT's grid from a plain label map.

    Parameters
    ----------
    labels
        The label map; another grid is resampled by nearest neighbour.
    groups
        {structure: [labels]}.
    ct
        Gives the grid.

    Raises
    ------
    InputError
        As `build_structures`.

    """
    return build_structures(Segmentation.from_labels(labels), groups, ct)[0]


def build_structures(
    segmentation: Segmentation,
    groups: Mapping[str, Sequence[int | str]],
    ct: Volume,
    table: str | None = None,
    anchor: str | None = None,
) -> tuple[Structures, tuple[str, ...]]:
    """Structures on the CT's grid.

    A list of structures may serve many patients: labels that this segmentation does not hold are left out with a
    warning, and so are structures of which nothing is left, but not the anchor.

    Where two structures claim the same voxels, the smaller one keeps them, with a warning, up to `OVERLAP_TOLERANCE`
    of its own.

    Parameters
    ----------
    segmentation
        A label map, or layers with named segments.
    groups
        {structure: labels}; a label is a number of the label map or the name of a segment.
    ct
        Gives the grid.
    table
        A label table ("totalsegmentator_v2", ...) whose names may be used besides those of segments.
    anchor
        The structure that must be there.

    Returns
    -------
    structures
        Structures in the order of `groups`.
    warnings
        Sentences about absent labels, overlaps and very small structures.

    Raises
    ------
    InputError
        Larger overlaps, an anchor that is absent or outside the CT, or no structure left.

    """
    if not groups:
        raise InputError('"structures" is empty: name at least the anchor with its labels.')
    members, warnings = _members(segmentation, groups, table, anchor)
    masks_of = _layer_lookup(members)
    grids = {layer: segmentation.on_grid(layer, ct).voxels for layer in sorted(masks_of)}
    claims = [_look_up(voxels, masks_of[layer]) for layer, voxels in grids.items()]
    counts = np.sum([_count(claim, len(members)) for claim in claims], axis=0)
    outside = [name for name, count in zip(members, counts, strict=True) if count == 0]
    if anchor in outside or len(outside) == len(members):
        name = anchor if anchor in outside else outside[0]
        raise InputError(
            f'Structure "{name}" lies outside the CT: its labels are in the segmentation but none of '
            "their voxels is on the CT's grid; check that both are of the same scan."
        )
    if outside:
        warnings += [f'Structure "{name}" lies outside the CT and was left out.' for name in outside]
        members = {name: pairs for name, pairs in members.items() if name not in outside}
        masks_of = _layer_lookup(members)
        claims = [_look_up(grids[layer], numbers) for layer, numbers in masks_of.items()]
        counts = counts[counts > 0]
    names = tuple(members)
    few = [(name, count) for name, count in zip(names, counts, strict=True) if count < FEW_VOXELS]
    warnings += [f'Structure "{name}" has only {count} voxels.' for name, count in few]
    labels = np.zeros(ct.shape, dtype=np.int16)
    for claim in claims:
        warnings += _merge(labels, claim, counts, names)
    return Structures(names, labels), tuple(warnings)


def _count(labels: np.ndarray, highest: int) -> np.ndarray:
    """Voxels of each label from 1 to highest, (highest,) int64; one slice at a time to save memory."""
    counts = np.zeros(highest + 1, dtype=np.int64)
    for section in labels:
        counts += np.bincount(section.ravel(), minlength=highest + 1)
    return counts[1:]


def _members(
    segmentation: Segmentation,
    groups: Mapping[str, Sequence[int | str]],
    table: str | None,
    anchor: str | None,
) -> tuple[dict[str, list[tuple[int, int]]], list[str]]:
    """The (layer, label) pairs of every structure that has any, each at most once, and warnings about absent ones."""
    names_of = label_table(table) if table else {}
    ids = {name: number for number, name in names_of.items()}
    owner: dict[tuple[int, int], str] = {}
    members: dict[str, list[tuple[int, int]]] = {}
    warnings: list[str] = []
    first: AbsentLabelError | None = None
    for structure, labels in groups.items():
        if not labels:
            raise InputError(f'Structure "{structure}" has no labels: list at least one, or remove it.')
        pairs: list[tuple[int, int]] = []
        absent: list[int | str] = []
        for label in labels:
            try:
                pair = segmentation.find(_translated(label, segmentation, names_of, ids), structure)
            except AbsentLabelError as error:
                first = first or error
                if structure == anchor and len(absent) + 1 == len(labels):
                    raise
                absent.append(label)
                continue
            if pair in owner:
                twice = "twice" if owner[pair] == structure else f'by structure "{owner[pair]}" too'
                raise InputError(
                    f'Structure "{structure}" lists label {label!r}, which is listed {twice}: keep it in one '
                    "place."
                )
            owner[pair] = structure
            pairs.append(pair)
        if pairs:
            members[structure] = pairs
        if absent:
            warnings.append(_absence(structure, absent, left_out=not pairs))
    if not members and first is not None:
        raise first
    return members, warnings


def _translated(
    label: int | str, segmentation: Segmentation, names_of: Mapping[int, str], ids: Mapping[str, int]
) -> int | str:
    """A label as the segmentation knows it, by the table's number or by its name."""
    if isinstance(label, str):
        known = segmentation.has_segment(label) or not segmentation.numbered
        return label if known else ids.get(label, label)
    return label if segmentation.numbered else names_of.get(label, label)


def _absence(structure: str, absent: Sequence[int | str], left_out: bool) -> str:
    """A warning about labels that the segmentation does not hold."""
    shown = ", ".join(map(str, absent[:10])) + (", ..." if len(absent) > 10 else "")
    if left_out:
        return f'Structure "{structure}" was left out: the segmentation holds none of its labels ({shown}).'
    few = f"label {shown}" if len(absent) == 1 else f"{len(absent)} of its labels ({shown})"
    return f'Structure "{structure}": the segmentation does not hold {few}; it is made of the others.'


def _layer_lookup(members: Mapping[str, list[tuple[int, int]]]) -> dict[int, dict[int, int]]:
    """For every layer that is used, in order, {label: structure's number from 1}."""
    lookup: dict[int, dict[int, int]] = {}
    for number, pairs in enumerate(members.values(), start=1):
        for layer, label in pairs:
            lookup.setdefault(layer, {})[label] = number
    return dict(sorted(lookup.items()))


def _look_up(labels: np.ndarray, numbers: Mapping[int, int]) -> np.ndarray:
    """Replace every label by its structure's number, 0 where it has none."""
    highest = max(int(labels.max()), max(numbers))
    table = np.zeros(highest + 1, dtype=np.int16)
    for label, number in numbers.items():
        table[label] = number
    return table[labels]


def _merge(labels: np.ndarray, claim: np.ndarray, counts: np.ndarray, names: Sequence[str]) -> list[str]:
    """Add one layer's claims to the labels in place; the smaller structure keeps what both claim."""
    warnings = []
    both = np.flatnonzero((labels > 0) & (claim > 0) & (labels != claim))
    old, new = labels.ravel()[both], claim.ravel()[both]
    for first, second in sorted(set(zip(old.tolist(), new.tolist(), strict=True))):
        shared = int(np.count_nonzero((old == first) & (new == second)))
        smaller, _ = sorted((first, second), key=lambda number: (counts[number - 1], number))
        share = shared / counts[smaller - 1]
        if share > OVERLAP_TOLERANCE:
            raise InputError(
                f'Structures "{names[first - 1]}" and "{names[second - 1]}" overlap in {shared} voxels '
                f'({100 * share:.1f} % of "{names[smaller - 1]}", at most {100 * OVERLAP_TOLERANCE:g} % '
                "may): correct the segments or put both into one structure."
            )
        warnings.append(
            f'Structures "{names[first - 1]}" and "{names[second - 1]}" overlap in {shared} voxels; '
            f'they were given to "{names[smaller - 1]}", the smaller one.'
        )
    take = claim > 0
    if both.size:
        keep_old = counts[old - 1] < counts[new - 1]
        keep_old |= (counts[old - 1] == counts[new - 1]) & (old < new)
        take.ravel()[both[keep_old]] = False
    np.copyto(labels, claim, where=take)
    return warnings
