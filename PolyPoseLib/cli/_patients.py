"""Whom a simulation is of: a CT with labels and how they are grouped, or a drawn knee."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import read_text

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.tracking.joints import Joint
    from PolyPoseLib.data.volume import Volume

_LOG = logging.getLogger(__name__)

Grouping = tuple[dict[str, list[int]], str, str | None]
"""Structures with their labels, the anchor, and the label table that gives the numbers."""


class Patient(NamedTuple):
    """A CT in HU, its structures and the one that others move against, all labels with their names, and its joints."""

    ct: Volume
    structures: Structures
    reference: str
    labels: np.ndarray | None
    label_names: dict[int, str]
    landmarks: dict[str, np.ndarray]
    joints: tuple[Joint, ...] = ()


def read_patient(ct_path: Path, labels_path: Path, grouping: Grouping) -> Patient:
    """CT, structures and the full segmentation on the CT's grid; raises InputError."""
    from PolyPoseLib.data.label_names import label_table
    from PolyPoseLib.data.structures import build_structures
    from PolyPoseLib.io.segmentations import read_segmentation
    from PolyPoseLib.io.volumes import read_ct

    ct = read_ct(ct_path)
    segmentation = read_segmentation(labels_path, ct)
    if segmentation.has_layers:
        raise InputError(f"{labels_path}: the segmentation has overlapping layers: export it as a label map.")
    groups, anchor, table = grouping
    if not segmentation.numbered and table is None:
        raise InputError(
            f"{labels_path}: its labels have names only: add the label_table that has them to the "
            "structures' JSON file."
        )
    segmentation = segmentation.renumbered(label_table(table) if table else {})
    structures, odd_structures = build_structures(segmentation, groups, ct, anchor=anchor)
    for warning in odd_structures:
        _LOG.warning(warning)
    names = label_table(table) if table else {}
    return Patient(ct, structures, anchor, segmentation.on_grid(0, ct).voxels, names, {})


def phantom_patient(seed: int, ct_reach: float | None = None) -> Patient:
    """The drawn knee of a seed, as long as it can be where the CT is given only so far (mm)."""
    from PolyPoseLib.simulation.joint_phantom import LONGEST_MM, REACH_MM, joint_phantom

    drawn = joint_phantom(seed, reach_mm=REACH_MM if ct_reach is None else LONGEST_MM)
    reference = drawn.structures.names[0]
    return Patient(drawn.ct, drawn.structures, reference, None, {}, drawn.landmarks, drawn.joints)


def moving_apart(grouping: Grouping, motion: str) -> Grouping:
    """Structures that a motion takes apart, one by one: in breathing, every rib."""
    from PolyPoseLib.data.label_names import label_table
    from PolyPoseLib.simulation.breathing import separate_ribs

    groups, anchor, table = grouping
    if motion != "breathing" or table is None:
        return grouping
    apart, anchor = separate_ribs(groups, anchor, label_table(table))
    return apart, anchor, table


def read_structures(path: Path) -> Grouping:
    """Structures, anchor and label table of a JSON file as the subcommand structures prints it."""
    from PolyPoseLib.data.label_names import label_table
    from PolyPoseLib.io.json_records import Record, parse_object
    from PolyPoseLib.io.study_schema import check_grouping

    fields = parse_object(read_text(path, "the structures' JSON file"), str(path))
    try:
        check_grouping(Record(fields))
        table = fields.get("label_table")
        numbers = {name: number for number, name in label_table(table).items()} if table else {}
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    groups = {}
    for structure, labels in fields["structures"].items():
        unknown = [label for label in labels if isinstance(label, str) and label not in numbers]
        if unknown:
            raise InputError(
                f'{path}: "{unknown[0]}" is no name of the label table: list numbers to simulate.'
            )
        groups[structure] = [numbers[label] if isinstance(label, str) else label for label in labels]
    return groups, fields["anchor"], table
