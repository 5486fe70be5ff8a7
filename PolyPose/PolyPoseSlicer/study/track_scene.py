"""Puts the folder of a track into the scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

from ..scene import track_charts, track_sequences, tree_folder
from ..scene.bone_handles import surface_of
from ..scene.drawing import drawn_once
from ..scene.frames import flip_vectors
from ..scene.names import free_name
from ..scene.rigid_outlines import RigidSurface
from ..scene.track_parts import TrackParts
from .track_nodes import TrackNodes as TrackNodes
from .track_record import TrackRecord
from .track_settings import TrackSettings

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.joint_curves import JointCurves
    from PolyPoseLib.geometry.camera import Camera

DETECTOR_MARGIN = 1.05
"""X-rays are shown this much farther from the source than any bone comes."""

CENTROID_MARGIN_MM = 2.0
"""How far the centroid of a bone's voxels may lie outside of its surface's box, which is smoothed and coarsened."""

MOST_TRIANGLES = 70_000
"""Of a bone: outlines of three such bones on two X-rays take about 12 ms a frame."""


@dataclass(frozen=True)
class TrackInputs:
    """The nodes that a track was made from; none of them is changed.

    Parameters
    ----------
    ct : vtkMRMLScalarVolumeNode
        Whose coordinates the poses lead to.
    segmentation : vtkMRMLSegmentationNode
        Of its bones.
    structures : mapping of str to list of str
        The segments of each bone.
    images : mapping of str to node
        The X-rays of each camera: a vtkMRMLSequenceNode of volumes, or a volume whose slices they are. Cameras without
        one have a view without a picture.
    first : mapping of str to int
        Image of frame 0 of each camera, 0 where it is not given.
    mirrored : mapping of str to bool
        Whether a camera's images are stored the other way round than seen from the source.

    """

    ct: slicer.vtkMRMLScalarVolumeNode
    segmentation: slicer.vtkMRMLSegmentationNode
    structures: Mapping[str, list[str]]
    images: Mapping[str, slicer.vtkMRMLNode] = field(default_factory=dict)
    first: Mapping[str, int] = field(default_factory=dict)
    mirrored: Mapping[str, bool] = field(default_factory=dict)


def show_track(folder: str | Path, inputs: TrackInputs, replaced: TrackNodes | None = None) -> TrackNodes:
    """Show a track: bones that move in 3D, their outlines on the X-rays, and plots of the joints.

    Parameters
    ----------
    folder : path
        That `polypose track` or `save_track` wrote.
    inputs : TrackInputs
        The nodes that it was made from.
    replaced : TrackNodes, optional
        An earlier track that goes once the new one can be shown; the frame that it shows is shown again.

    Returns
    -------
    TrackNodes
        What was made.

    Raises
    ------
    InputError
        The folder is damaged or does not fit the nodes; nothing has changed.

    """
    from PolyPoseLib.io.tracking.joint_curves import load_joint_curves

    content = _Content(Path(folder))
    joints = load_joint_curves(folder)
    surfaces = _surfaces(content.record, inputs)
    settings = _settings(content.record, inputs, surfaces)
    frame = None
    if replaced is not None:
        frame = replaced.frame if replaced.browser.GetScene() is not None else None
        replaced.remove()
    nodes = _made(content, inputs, settings, surfaces, joints)
    if frame is not None:
        nodes.go_to(frame)
    return nodes


class _Content:
    """What track.json holds, and its text."""

    def __init__(self, folder: Path) -> None:
        from PolyPoseLib.io.tracking.tracks import TRACK, load_track

        self.record = TrackRecord(load_track(folder))
        self.text = (folder / TRACK).read_text(encoding="utf-8")


def _surfaces(record: TrackRecord, inputs: TrackInputs) -> dict[str, vtk.vtkPolyData]:
    """The surface of every bone as the CT has it, RAS mm; raises InputError where a bone is not to be had."""
    surfaces = {}
    for name, centroid in zip(record.names, record.track.centroids, strict=True):
        segments = inputs.structures.get(name)
        if not segments:
            raise InputError(
                _("The track's structure '{name}' has no segment: assign it in the first section.").format(
                    name=name
                )
            )
        surfaces[name] = surface_of(inputs.segmentation, segments, MOST_TRIANGLES)
        if surfaces[name].GetNumberOfCells() == 0:
            raise InputError(_("The segments of '{name}' hold no voxel: draw them.").format(name=name))
        if not _lies_within(flip_vectors(centroid), surfaces[name]):
            raise InputError(
                _(
                    "The segments of '{name}' are not where they were when the track was made: choose its CT and "
                    "segmentation, and put them where they were."
                ).format(name=name)
            )
    return surfaces


def _lies_within(point: np.ndarray, surface: vtk.vtkPolyData) -> bool:
    """Whether a point (3,), RAS mm, lies within a surface's box, as a centroid does."""
    low, high = np.array(surface.GetBounds()).reshape(3, 2).T
    return bool(np.all(point >= low - CENTROID_MARGIN_MM) and np.all(point <= high + CENTROID_MARGIN_MM))


def _settings(
    record: TrackRecord, inputs: TrackInputs, surfaces: Mapping[str, vtk.vtkPolyData]
) -> TrackSettings:
    """How the X-rays lie; raises InputError where an image is not that of its camera."""
    corners = _corners(record, surfaces)
    detectors = {}
    for name, camera in record.track.cameras.items():
        detectors[name] = DETECTOR_MARGIN * float(camera.depth(corners).max())
        if name in inputs.images:
            _check_size(name, camera, inputs.images[name])
    return TrackSettings(dict(inputs.first), dict(inputs.mirrored), detectors)


def _corners(record: TrackRecord, surfaces: Mapping[str, vtk.vtkPolyData]) -> np.ndarray:
    """Corners (N, 3) of all bones' boxes in all frames, LPS mm."""
    boxes = np.stack([RigidSurface(surfaces[name]).bounds for name in record.names])
    boxes = np.concatenate([boxes, np.ones((*boxes.shape[:2], 1))], axis=2)
    moved = np.einsum("fkij,kcj->fkci", record.to_patient, boxes)[..., :3]
    return flip_vectors(moved.reshape(-1, 3))


def _check_size(name: str, camera: Camera, image: slicer.vtkMRMLNode) -> None:
    columns, rows = track_sequences.image_size(image)
    if (columns, rows) != (camera.width, camera.height):
        raise InputError(
            _(
                "The X-rays '{image}' have {columns} x {rows} pixels, but the track's camera '{camera}' has {width} x "
                "{height}: choose those that were tracked."
            ).format(
                image=image.GetName(),
                columns=columns,
                rows=rows,
                camera=name,
                width=camera.width,
                height=camera.height,
            )
        )


@drawn_once
def _made(
    content: _Content,
    inputs: TrackInputs,
    settings: TrackSettings,
    surfaces: Mapping[str, vtk.vtkPolyData],
    joints: tuple[JointCurves, ...],
) -> TrackNodes:
    """Make all nodes, or none of them."""
    record = content.record
    browser = track_sequences.new_browser(_("Track"), record.track.frames_per_second)
    parts = TrackParts(browser)
    try:
        settings.store(browser)
        _make_record(parts, content.text)
        _refer_to_inputs(parts, record, inputs)
        for number, name in enumerate(record.names):
            segment = inputs.segmentation.GetSegmentation().GetSegment(inputs.structures[name][0])
            _make_bone(parts, record, number, surfaces[name], segment.GetColor(), browser)
        track_charts.make_charts(parts, joints)
        nodes = TrackNodes(browser)
        listed = [node for node in parts.nodes_made() if not node.GetHideFromEditors()]
        tree_folder.new_folder(browser.GetName(), [browser, *listed])
    except BaseException:
        parts.remove()
        raise
    return nodes


def _make_record(parts: TrackParts, text: str) -> None:
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLTextNode", free_name(_("Track, all numbers")))
    parts.made("record", 0, node)
    node.SetForceCreateStorageNode(True)  # long texts belong in a file of their own
    node.SetHideFromEditors(True)
    node.SetText(text)


def _refer_to_inputs(parts: TrackParts, record: TrackRecord, inputs: TrackInputs) -> None:
    parts.given("ct", 0, inputs.ct)
    parts.given("segmentation", 0, inputs.segmentation)
    for number, name in enumerate(record.track.cameras):
        if name in inputs.images:
            parts.given("image", number, inputs.images[name])


def _make_bone(
    parts: TrackParts,
    record: TrackRecord,
    number: int,
    surface: vtk.vtkPolyData,
    color: tuple[float, float, float],
    browser: slicer.vtkMRMLSequenceBrowserNode,
) -> None:
    """One bone's sequence, the transform that shows it, and the surface below."""
    scene, name = slicer.mrmlScene, record.names[number]
    sequence = track_sequences.pose_sequence(
        _("{bone} poses").format(bone=name), record.numbers, record.to_patient[:, number]
    )
    parts.made("sequence", number, sequence)
    transform = scene.AddNewNodeByClass(
        "vtkMRMLLinearTransformNode", free_name(_("{bone} pose").format(bone=name))
    )
    parts.made("transform", number, transform)
    track_sequences.play(browser, sequence, transform)
    model = scene.AddNewNodeByClass("vtkMRMLModelNode", free_name(_("{bone} in motion").format(bone=name)))
    parts.made("model", number, model)
    model.SetAndObservePolyData(surface)
    model.CreateDefaultDisplayNodes()
    model.GetDisplayNode().SetColor(*color)
    model.GetDisplayNode().SetVisibility2D(True)
    model.SetAndObserveTransformNodeID(transform.GetID())
