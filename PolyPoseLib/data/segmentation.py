"""Segmentations: label maps, and Slicer's .seg.nrrd with names and overlapping layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.label_names import label_table, structure_of
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.errors import InputError, nearest

_MAX_LABEL = 100_000
"""Larger values come from an image, not from a label map."""


class AbsentLabelError(InputError):
    """A label that this segmentation does not hold, though another patient's may."""


@dataclass(frozen=True)
class Segment:
    """One named segment: the voxels of a layer that hold its label."""

    identifier: str
    name: str
    layer: int
    label: int


@dataclass(frozen=True)
class Segmentation:
    """Label maps on one grid, one per layer, and the names of their segments when the file has them.

    Attributes
    ----------
    layers
        Volumes of whole numbers, 0 is background.
    segments
        Empty for a plain label map.
    source
        Name for messages.
    numbered
        Whether people know the labels by their numbers; those of a folder of
        masks, a DICOM SEG or an RTSTRUCT they know by name alone.
    warnings
        What was odd but not wrong.

    Raises
    ------
    InputError
        From the constructor: no layer, values that are no labels, or a segment in a layer that does not exist.

    """

    layers: tuple[Volume, ...]
    segments: tuple[Segment, ...] = ()
    source: str = "segmentation"
    numbered: bool = True
    warnings: tuple[str, ...] = ()
    _present: tuple[np.ndarray, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Validate, and fix the types."""
        if not self.layers:
            raise InputError(f"{self.source}: the segmentation has no layer: export it again.")
        layers = tuple(whole_numbers(each, self.source) for each in self.layers)
        object.__setattr__(self, "layers", layers)
        object.__setattr__(self, "_present", tuple(labels_present(each.voxels) for each in layers))
        for segment in self.segments:
            if not 0 <= segment.layer < len(self.layers):
                raise InputError(
                    f'{self.source}: segment "{segment.name}" is in layer {segment.layer}, but the file has '
                    f"{len(self.layers)}: export the segmentation again."
                )

    @classmethod
    def from_labels(cls, labels: Volume, source: str = "segmentation") -> Segmentation:
        """A plain label map."""
        return cls((labels,), (), source)

    @property
    def has_layers(self) -> bool:
        """Whether segments may overlap."""
        return len(self.layers) > 1

    def renumbered(self, table: Mapping[int, str]) -> Segmentation:
        """As it is, or where its labels are known by name: a label map with the table's numbers for these names."""
        if self.numbered:
            return self
        numbers = {name: number for number, name in table.items()}
        lookup = np.zeros(1 + max(segment.label for segment in self.segments), np.int32)
        for segment in self.segments:
            lookup[segment.label] = numbers.get(segment.name, 0)
        labels = self.layers[0]
        return Segmentation.from_labels(Volume(lookup[labels.voxels], labels.affine), self.source)

    def has_segment(self, name: int | str) -> bool:
        """Whether a segment has this name or identifier."""
        return any(name in (segment.name, segment.identifier) for segment in self.segments)

    def label_names(self, table: str | None = None) -> dict[int, str]:
        """Names of the first layer's labels: a known table's where they are numbers, otherwise those of segments."""
        own = {segment.label: segment.name for segment in self.segments if segment.layer == 0}
        return {**own, **label_table(table)} if table and self.numbered else own

    def find(self, label: int | str, structure: str) -> tuple[int, int]:
        """Where the voxels of a label are.

        Parameters
        ----------
        label
            A label's number, or a segment's name or identifier.
        structure
            Whose label it is, for the sentences.

        Returns
        -------
        layer
            Number of the layer.
        label
            The label there.

        Raises
        ------
        AbsentLabelError
            No voxel has it: a number that does not occur, an empty segment, or a bone of which there is no segment.
        InputError
            In several layers, or a name that is no bone's.

        """
        return (
            self._find_number(label, structure)
            if isinstance(label, int)
            else self._find_name(label, structure)
        )

    def on_grid(self, layer: int, reference: Volume) -> Volume:
        """One layer on the reference's grid, by nearest neighbour."""
        return resample_labels_onto(self.layers[layer], reference)

    def whole_on_grid(self, reference: Volume) -> Volume | None:
        """The only layer on the reference's grid; None where there are several, which may overlap."""
        return None if self.has_layers else self.on_grid(0, reference)

    def labels_present(self, layer: int) -> np.ndarray:
        """The labels that a layer's voxels hold, without 0, ascending."""
        return self._present[layer]

    def _find_name(self, name: str, structure: str) -> tuple[int, int]:
        """The pair of a segment's name or identifier."""
        found = [s for s in self.segments if s.name == name] or [
            s for s in self.segments if s.identifier == name
        ]
        if len(found) > 1:
            raise InputError(
                f'{self.source}: {len(found)} segments are named "{name}", which structure "{structure}" '
                f"lists: rename them or list their identifiers ({', '.join(s.identifier for s in found)})."
            )
        if not found:
            is_bone = bool(self.segments) and structure_of(name) is not None
            raise (AbsentLabelError if is_bone else InputError)(self._unknown_name(name, structure))
        if found[0].label not in self.labels_present(found[0].layer):
            raise AbsentLabelError(
                f'{self.source}: segment "{name}" of structure "{structure}" is empty: remove it from the '
                "structure."
            )
        return found[0].layer, found[0].label

    def _find_number(self, label: int, structure: str) -> tuple[int, int]:
        """The pair of a label number that exactly one layer holds."""
        if not self.numbered:
            raise InputError(
                f'{self.source}: structure "{structure}" lists the number {label}, but its labels have names only: '
                'list the names of its files or segments, or say by "label_table" whose numbers they are.'
            )
        layers = [n for n in range(len(self.layers)) if label in self.labels_present(n)]
        if len(layers) == 1:
            return layers[0], label
        if layers:
            raise InputError(
                f'{self.source}: label {label} of structure "{structure}" is in {len(layers)} overlapping '
                "layers: list segments by name."
            )
        present = sorted({int(n) for layer in range(len(self.layers)) for n in self.labels_present(layer)})
        shown = ", ".join(map(str, present[:30])) + (", ..." if len(present) > 30 else "")
        raise AbsentLabelError(
            f'{self.source}: label {label} of structure "{structure}" is not in the image: remove it, or '
            f"choose from {shown or 'nothing (the image is empty)'}."
        )

    def _unknown_name(self, name: str, structure: str) -> str:
        """A sentence about a name that no segment has."""
        if not self.segments:
            return (
                f'{self.source}: structure "{structure}" lists "{name}", but a plain label map has no names: '
                'list numbers, or say by "label_table" whose names they are.'
            )
        names = [segment.name for segment in self.segments]
        similar = nearest(name, names)
        fix = f'did you mean "{similar}"?' if similar else f"choose from {', '.join(names[:30])}."
        return f'{self.source}: structure "{structure}" lists "{name}", but no segment has that name: {fix}'


def checked_source(segmentation: Volume | None, ct: Volume) -> Volume | None:
    """The label map that a CT's structures were made of, with whole numbers; raises InputError."""
    if segmentation is None:
        return None
    if segmentation.shape != ct.shape:
        raise InputError("The source segmentation is on another grid than the CT: resample it onto the CT's.")
    if segmentation.voxels.dtype.kind in "iu":
        return segmentation
    return whole_numbers(segmentation, "The source segmentation")


def labels_present(voxels: np.ndarray) -> np.ndarray:
    """The values that occur, without 0, ascending; one slice at a time to save memory."""
    seen = np.zeros(int(voxels.max()) + 1, dtype=bool)
    for section in voxels:
        seen[section.ravel()] = True
    return np.flatnonzero(seen)[int(seen[0]) :]


def whole_numbers(volume: Volume, source: str) -> Volume:
    """The volume with non-negative integer voxels; raises InputError when its values are none."""
    voxels = volume.voxels
    if voxels.dtype == bool:
        return Volume(voxels.astype(np.uint8), volume.affine)
    low, high = voxels.min(), voxels.max()
    if low < 0 or high > _MAX_LABEL:
        raise InputError(
            f"{source}: its labels run from {low:g} to {high:g}, but labels are whole numbers from 0 to "
            f"{_MAX_LABEL}: give a label map, not an image."
        )
    if np.issubdtype(voxels.dtype, np.integer):
        return volume
    whole = np.rint(voxels)
    if not np.array_equal(whole, voxels):
        raise InputError(
            f"{source}: its labels are not whole numbers, as after smooth resampling: resample it by nearest "
            "neighbour."
        )
    return Volume(whole.astype(np.int32), volume.affine)
