"""The fields of a TRACK.json that say which joints are reported: "joints", and the names of "landmarks"."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.tracking.joints import CONVENTIONS, SIDES, Joint, side_of
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.json_records import Parser, Record, kind_of, nonempty, one_of, quoted
from PolyPoseLib.kinematics.landmark_axes import LANDMARK_NAMES

MAX_JOINTS = 1000
"""More joints are refused."""

FIELDS = ("name", "proximal", "distal", "convention", "side")
"""Of a joint."""


def joints(structures: Collection[str]) -> Parser[tuple[Joint, ...]]:
    """A parser of a list of joints between known structures; raises InputError for any other value.

    Without "convention" a joint is generic, and without "side" it has the one that its distal bone's name says.
    """

    def parse(value: Any, place: str) -> tuple[Joint, ...]:
        if not isinstance(value, list):
            raise InputError(f"{place} must be a list of objects, not {kind_of(value)}.")
        if len(value) > MAX_JOINTS:
            raise InputError(f"{place} holds {len(value)} entries: give at most {MAX_JOINTS}.")
        found: list[Joint] = []
        for number, fields in enumerate(value):
            joint = _joint(Record(fields, f"{place}[{number}]: "), structures)
            if joint.name in [other.name for other in found]:
                raise InputError(
                    f"{place}[{number}] has the name {quoted(joint.name)} of an earlier one: give each its own."
                )
            found.append(joint)
        return tuple(found)

    return parse


def check_landmark_names(landmarks: Collection[str], structures: Collection[str], place: str) -> None:
    """Raise InputError unless every landmark is named after a structure and what it is: "femur_left.hip_center"."""
    for name in landmarks:
        bone, _, short = name.rpartition(".")
        where = f"{place}.{quoted(name)}"
        if not bone:
            raise InputError(f'{where} has no bone: name it after its structure, as "femur_left.hip_center".')
        if bone not in structures:
            raise InputError(f"{where}: " + unknown_name("structure", bone, structures))
        if short not in LANDMARK_NAMES:
            raise InputError(f"{where}: " + unknown_name("name of a landmark", short, LANDMARK_NAMES))


def those_that_are_there(
    given: tuple[Joint, ...], landmarks: Mapping[str, np.ndarray], structures: Collection[str]
) -> tuple[tuple[Joint, ...], dict[str, np.ndarray], list[str]]:
    """Joints and landmarks of structures that the CT shows, and warnings about the joints that it does not."""
    kept = tuple(joint for joint in given if {joint.proximal, joint.distal} <= set(structures))
    warnings = [
        f'The joint "{joint.name}" was left out: the CT does not show both of its bones.'
        for joint in given
        if joint not in kept
    ]
    points = {name: point for name, point in landmarks.items() if name.rpartition(".")[0] in structures}
    return kept, points, warnings


def _joint(record: Record, structures: Collection[str]) -> Joint:
    record.require_known(FIELDS)
    bone = _one_of_structures(structures)
    name, proximal, distal = (
        record.required("name", nonempty),
        record.required("proximal", bone),
        record.required("distal", bone),
    )
    convention = record.optional("convention", one_of(CONVENTIONS)) or "generic"
    side = record.optional("side", one_of(SIDES)) or side_of(distal)
    try:
        return Joint(name, proximal, distal, convention, side)
    except InputError as error:
        raise InputError(f"{record.opening}{error}") from error


def _one_of_structures(structures: Collection[str]) -> Parser[str]:
    """A parser of a structure's name."""

    def parse(value: Any, place: str) -> str:
        name = nonempty(value, place)
        if name not in structures:
            raise InputError(f"{place}: " + unknown_name("structure", name, structures))
        return name

    return parse
