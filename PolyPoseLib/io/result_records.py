"""The parts of result.json: structures with their intervals, cameras, and the steps of the history."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PolyPoseLib.data.result import INTERVALS, CameraResult, StructureResult
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, require_intrinsics
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.json_records import Record, array, list_of, real, real_or_nan, string, whole_number


def structure_fields(structure: StructureResult) -> dict[str, Any]:
    """One structure of result.json; what was not computed is absent."""
    fields: dict[str, Any] = {
        "fixed_to_moving": structure.fixed_to_moving,
        "motion": {
            "rotation_deg": structure.rotation_deg,
            "translation_mm": structure.translation_mm,
            "axis": structure.axis,
        },
    }
    if structure.centroid is not None:
        fields["centroid"] = structure.centroid
    if structure.uncertainty is not None:
        fields["uncertainty"] = structure.uncertainty
    if structure.doubts:
        fields["doubts"] = structure.doubts
    return fields


def camera_fields(camera: CameraResult) -> dict[str, Any]:
    """One camera of result.json."""
    return {
        "name": camera.name,
        "K": camera.intrinsics,
        "extrinsic": camera.extrinsic,
        "height": camera.height,
        "width": camera.width,
        "similarity": camera.similarity,
    }


def read_step(value: Any, place: str) -> dict[str, Any]:
    """One iteration of the history, as it is stated; further fields are left alone."""
    record = Record(value, f"{place}.")
    for name, parser in (
        ("stage", string),
        ("iteration", whole_number(0)),
        ("similarity", real_or_nan),
        ("seconds", real),
        ("level_mm", real),
    ):
        if name in record.fields:
            record.required(name, parser)
    return dict(record.fields)


def read_labelled(value: Any, place: str) -> tuple[int | None, StructureResult]:
    """One structure of result.json with its label, which earlier files do not have."""
    label = Record(value, f"{place}.").optional("label", whole_number(1))
    return label, _read_structure(value, place)


def in_order_of_labels(
    given: Mapping[str, tuple[int | None, StructureResult]],
) -> dict[str, StructureResult]:
    """Structures so that the nth has the label n, whatever the order of the file's keys; as they come without labels.

    Raises InputError where only some have a label, or the labels are not 1, 2, 3 and so on.
    """
    labels = {name: label for name, (label, _) in given.items() if label is not None}
    if labels and sorted(labels.values()) != list(range(1, len(given) + 1)):
        raise InputError(f'"structures": each needs a "label" of its own, from 1 to {len(given)}.')
    names = sorted(given, key=lambda name: labels.get(name, 0))
    return {name: given[name][1] for name in names}


def _read_structure(value: Any, place: str) -> StructureResult:
    """One structure of result.json."""
    record = Record(value, f"{place}.")
    motion = record.required("motion", Record.within)
    centroid = motion.optional("centroid_mm", array(3))  # where earlier files had it
    given = record.optional("centroid", array(3))
    return StructureResult(
        record.required("fixed_to_moving", require_rigid),
        motion.required("rotation_deg", real_or_nan),
        motion.required("translation_mm", array(3, finite=False)),
        motion.required("axis", array(3, finite=False)),
        record.optional("uncertainty", _read_uncertainty),
        centroid if given is None else given,
        tuple(record.optional("doubts", list_of(string)) or ()),
    )


def _read_uncertainty(value: Any, place: str) -> dict[str, Any]:
    """A structure's intervals as they are stated, once those that people are shown are known to be numbers."""
    record = Record(value, f"{place}.")
    for name, shape in {**INTERVALS, "covariance": (6, 6)}.items():
        if name in record.fields:
            record.required(name, array(*shape, finite=False))  # null stands for a number that is not finite
    directions = record.optional("directions", Record.within)
    if directions is not None:
        directions.required("along", array(3, finite=False))
        directions.required("across", array(2, 3, finite=False))
    return dict(record.fields)


def read_camera(value: Any, place: str) -> CameraResult:
    """One camera of result.json."""
    record = Record(value, f"{place}.")
    camera = Camera(
        record.required("K", require_intrinsics),
        record.required("extrinsic", require_rigid),
        record.required("height", whole_number(1)),
        record.required("width", whole_number(1)),
    )
    return CameraResult(
        camera, record.required("similarity", real_or_nan), record.optional("name", string) or ""
    )
