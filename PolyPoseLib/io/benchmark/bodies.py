"""Which labels of a scan move as rigid bodies, which are soft organs, and which bone is the anchor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.errors import InputError

Labels = dict[str, tuple[int, ...]]


def bones_of(names: Mapping[int, str], fused_spine: bool = False) -> Labels:
    """{body: labels}: every bone by itself, or the vertebrae of a region as one.

    Parameters
    ----------
    names
        {label: name} of a scan.
    fused_spine
        Whether cervical, thoracic and lumbar vertebrae are three bodies.

    """
    bodies: dict[str, list[int]] = {}
    for number, name in sorted(names.items()):
        body = structure_of(name, "bones")
        if body is not None and fused_spine and body.startswith("vertebra_"):
            body = structure_of(name, "regions")
        if body is not None:
            bodies.setdefault(body, []).append(number)
    return {body: tuple(numbers) for body, numbers in bodies.items()}


def organs_of(names: Mapping[int, str], wanted: Sequence[str]) -> Labels:
    """{organ: its label} of the wanted soft organs that a scan's labels have, in the wanted order."""
    numbers: dict[str, list[int]] = {}
    for number, name in sorted(names.items()):
        numbers.setdefault(name, []).append(number)
    return {name: tuple(numbers[name]) for name in wanted if name in numbers}


def anchor_of(
    bones: Mapping[str, object], common: Mapping[str, object], preferred: Sequence[str], where: object
) -> str:
    """The first preferred bone that both scans show; raises InputError, beginning with ``where``, without any."""
    for name in preferred:
        if name in bones and name in common:
            return name
    for name in bones:
        if name in common:
            return name
    raise InputError(
        f"{where}: the two scans have no bone in common: segment both by TotalSegmentator, or give labels with the "
        "same names."
    )
