"""The outlines of tracked bones on their X-rays, redrawn wherever the bones go."""

from __future__ import annotations

import enum
from collections.abc import Mapping

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.geometry.camera import Camera

from . import track_layout
from .frames import flip_vectors
from .own_nodes import remove_with_display, unsaved_node
from .rigid_outlines import Detector, RigidSurface

_DOUBTFUL_COLOR = (1.0, 0.35, 0.75)
_LOST_COLOR, _LOST_OPACITY = (0.75, 0.75, 0.75), 0.45
_WIDTH_PX = 2


class PoseState(enum.Enum):
    """How far the pose of a bone in a frame is to be relied on.

    A lost bone is drawn where the frames beside it lead, but pale and grey: were it hidden, there would be nothing
    that a person could put in its place by hand.
    """

    TRACKED = 0
    DOUBTFUL = 1
    LOST = 2


def opacity_of(state: PoseState) -> float:
    """How solid a bone is drawn."""
    return _LOST_OPACITY if state is PoseState.LOST else 1.0


class XraySpot:
    """Where one camera stands, and where its X-ray is shown.

    number: of its view in the track's layout. distance: of the detector's plane from the source, mm.
    """

    def __init__(self, number: int, name: str, camera: Camera, distance: float) -> None:
        self.number, self.name, self.camera, self.distance = number, name, camera, distance
        self.source = flip_vectors(camera.source)
        self.detector = Detector(flip_vectors(camera.axis), distance)


class BoneOutlines:
    """One bone's outlines on all X-rays, drawn from others, so that scenes do not keep them."""

    def __init__(
        self, name: str, surface: RigidSurface, color: tuple[float, float, float], spots: list[XraySpot]
    ) -> None:
        """surface: as the CT has it, RAS mm. color: of a bone that was tracked, red, green, blue from 0 to 1."""
        self._surface, self._color, self._spots = surface, color, spots
        self._state: PoseState | None = None
        self.nodes = [
            _node(_("Outline of {bone} on {xray}").format(bone=name, xray=each.name)) for each in spots
        ]
        self.set_state(PoseState.TRACKED)

    def draw(self, to_patient: np.ndarray) -> None:
        """Draw the bone where (4, 4) RAS mm has it; nothing while the layout has no view of an X-ray."""
        for node, spot in zip(self.nodes, self._spots, strict=True):
            if node.GetScene() is not None and _show_only_on(node, spot.number):
                node.SetAndObservePolyData(self._surface.outline(to_patient, spot.source, spot.detector))

    def set_state(self, state: PoseState) -> None:
        """Show how far the pose is to be relied on."""
        if state is self._state:
            return
        self._state = state
        color = {PoseState.DOUBTFUL: _DOUBTFUL_COLOR, PoseState.LOST: _LOST_COLOR}.get(state, self._color)
        for node in self.nodes:
            display = node.GetDisplayNode()
            if display is not None:
                was = display.StartModify()
                display.SetColor(*color)
                display.SetSliceIntersectionOpacity(opacity_of(state))
                display.EndModify(was)

    def remove(self) -> None:
        """Take them out of the scene."""
        for node in self.nodes:
            remove_with_display(node)
        self.nodes, self._spots = [], []


def states_of(sources: Mapping[str, str], doubts: Mapping[str, tuple[str, ...]]) -> dict[str, PoseState]:
    """The state of each bone in a frame, from where its pose comes and what speaks against it."""
    return {
        name: PoseState.LOST
        if source == "none"
        else PoseState.DOUBTFUL
        if doubts[name]
        else PoseState.TRACKED
        for name, source in sources.items()
    }


def _node(name: str) -> slicer.vtkMRMLModelNode:
    node = slicer.mrmlScene.AddNode(unsaved_node("vtkMRMLModelNode", name))
    node.SetHideFromEditors(True)
    node.CreateDefaultDisplayNodes()
    display = node.GetDisplayNode()
    display.SetSaveWithScene(False)
    display.SetVisibility2D(True)
    display.SetVisibility3D(False)
    display.SetSliceDisplayModeToProjection()
    display.SetSliceIntersectionThickness(_WIDTH_PX)
    return node


def _show_only_on(node: slicer.vtkMRMLModelNode, number: int) -> bool:
    """Restrict an outline to the view of its X-ray; False while there is none, which would show it everywhere."""
    logic, display = track_layout.slice_logic(number), node.GetDisplayNode()
    if logic is None or display is None:
        return False
    view = logic.GetSliceNode().GetID()
    if not (display.GetNumberOfViewNodeIDs() == 1 and display.IsViewNodeIDPresent(view)):
        display.SetViewNodeIDs([view])
    return True
