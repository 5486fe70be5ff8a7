"""The scene's result as the core's own, so that its functions and its command line can work on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

from ..scene.grid_transform import field_of
from ..scene.motions import Motion, motions_of
from ..scene.nodes import Layer, Voxels, read_layers, read_volume
from .parameters import PolyPoseParameterNode, outputs_of, structures_of
from .writer import UNKNOWN_SPACING, StudyData, merged_labels

if TYPE_CHECKING:
    from PolyPoseLib.carrying.points import PointCarrier
    from PolyPoseLib.data.displacement_field import DisplacementField
    from PolyPoseLib.data.result import Result, StructureResult
    from PolyPoseLib.data.volume import Volume

_NO_XRAY = ({}, np.zeros((2, 2), np.float32), UNKNOWN_SPACING)
"""What is done with a result here reads no X-ray, but a study has to name one."""


def missing_for_bones(parameters: PolyPoseParameterNode | None) -> str:
    """One sentence that says what is missing to know where the bones of the result are; empty when nothing is."""
    if parameters is None or parameters.outputTransform is None:
        return _("No result yet: register, or load an earlier result.")
    motions = motions_of(parameters.outputMotions)
    if not motions:
        return _("The result has lost its table of motions: register again, or load the result again.")
    if parameters.ct is None:
        return _("Choose the CT of the result.")
    if parameters.segmentation is None:
        return _("Choose the segmentation of the result's bones: it says where they are.")
    for name in motions:
        if name not in structures_of(parameters):
            return _(
                "The result's structure '{name}' has no segment: assign it in the first section."
            ).format(name=name)
    return ""


def missing_for_export(parameters: PolyPoseParameterNode | None) -> str:
    """The same for writing the result as DICOM."""
    missing = missing_for_bones(parameters)
    if missing or parameters is None:
        return missing
    if parameters.outputVolume is None or parameters.outputSegmentation is None:
        return _(
            "The result has lost its warped CT or segmentation: register again, or load the result again."
        )
    return ""


def point_carrier(parameters: PolyPoseParameterNode) -> Callable[[], PointCarrier]:
    """What makes the core's carrier of points for the scene's result, without touching nodes any more.

    Raises InputError where `missing_for_bones` says what is missing.
    """
    study = scene_study(parameters)
    motions, field = motions_of(parameters.outputMotions), field_of(parameters.outputTransform)

    def make() -> PointCarrier:
        from PolyPoseLib.carrying.points import PointCarrier

        labels = _structure_labels(study, list(motions))
        return PointCarrier(_result(motions, field, labels, (labels, labels)))

    return make


def whole_result(parameters: PolyPoseParameterNode, study: StudyData) -> Callable[[], Result]:
    """What makes the core's result of the scene's nodes, without touching them any more; it has no X-rays.

    study: of the same nodes. Raises InputError where `missing_for_export` says what is missing.
    """
    missing = missing_for_export(parameters)
    if missing:
        raise InputError(missing)
    from PolyPoseLib.data.volume import Volume

    warped, layers = read_volume(parameters.outputVolume), _warped_layers(parameters, study)
    motions, field = motions_of(parameters.outputMotions), field_of(parameters.outputTransform)
    distrust = outputs_of(parameters).distrust

    def make() -> Result:
        from PolyPoseLib.warp.dense import warp_labels

        labels, ct = _structure_labels(study, list(motions)), _volume(warped)
        if layers:
            numbered = Volume(_numbered(study, warped, layers), ct.affine)
        else:
            numbered = warp_labels(Volume(merged_labels(study), study.ct.grid.affine), field, ct)
        return _result(motions, field, labels, (ct, numbered), distrust)

    return make


def _warped_layers(parameters: PolyPoseParameterNode, study: StudyData) -> list[Layer]:
    """The warped bones as the result has them; none where it was loaded without the names of its segments."""
    content = parameters.outputSegmentation.GetSegmentation()
    there = [each for each in study.segment_ids if content.GetSegment(each) is not None]
    bones = {each for ids in study.structures.values() for each in ids}
    return read_layers(parameters.outputSegmentation, there) if bones <= set(there) else []


def scene_study(parameters: PolyPoseParameterNode) -> StudyData:
    """The result's CT and bones, copied from the scene; raises InputError when something is missing."""
    missing = missing_for_bones(parameters)
    if missing:
        raise InputError(missing)
    motions, structures = motions_of(parameters.outputMotions), structures_of(parameters)
    segment_ids = list(parameters.segmentation.GetSegmentation().GetSegmentIDs())
    names = list(motions)
    return StudyData(
        ct=read_volume(parameters.ct),
        layers=read_layers(parameters.segmentation, segment_ids),
        segment_ids=segment_ids,
        structures={name: structures[name] for name in names},
        anchor=parameters.anchor if parameters.anchor in names else names[0],
        xrays=[_NO_XRAY],
        options={},
    )


def _result(
    motions: dict[str, Motion],
    field: DisplacementField,
    structure_labels: Volume,
    warped: tuple[Volume, Volume],
    distrust: tuple[str, ...] = (),
) -> Result:
    """The core's result; warped: CT and labels."""
    from PolyPoseLib.data.result import Result, installed_versions

    return Result(
        structures={name: _structure(each) for name, each in motions.items()},
        cameras=[],
        history=[],
        seconds={},
        device="",
        versions=installed_versions(),
        warnings=[],
        warped_ct=warped[0],
        warped_labels=warped[1],
        transform=field,
        renderings_after=[],
        distrust=distrust,
        structure_labels=structure_labels,
    )


def _structure(motion: Motion) -> StructureResult:
    from PolyPoseLib.data.result import StructureResult

    pose = np.linalg.inv(motion.matrix)
    centroid = np.zeros(3) if motion.centroid is None else motion.centroid
    return StructureResult.from_pose(pose, centroid, motion.uncertainty, motion.doubts)


def _structure_labels(study: StudyData, names: list[str]) -> Volume:
    """Labels on the CT's grid in which n belongs to the nth structure."""
    from PolyPoseLib.data.volume import Volume

    table = np.zeros(len(study.segment_ids) + 1, np.int16)
    for number, name in enumerate(names, start=1):
        for segment in study.structures[name]:
            table[study.segment_ids.index(segment) + 1] = number
    return Volume(table[merged_labels(study)], study.ct.grid.affine)


def _numbered(study: StudyData, warped: Voxels, layers: list[Layer]) -> np.ndarray:
    """The warped segments with the numbers that a study's file gives them."""
    own = StudyData(
        warped, layers, study.segment_ids, study.structures, study.anchor, study.xrays, study.options
    )
    return merged_labels(own)


def _volume(voxels: Voxels) -> Volume:
    from PolyPoseLib.data.volume import Volume

    return Volume(voxels.values, voxels.grid.affine)
