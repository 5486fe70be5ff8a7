"""The X-rays of a track: sequences that share the pixels of the scene's own, and volumes on the cameras' detectors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from ..scene import track_sequences, track_views
from ..scene.cameras import plane_to_ras
from ..scene.own_nodes import unsaved_node
from ..scene.pixel_frames import file_to_source
from ..scene.track_outlines import XraySpot

if TYPE_CHECKING:
    from .track_nodes import TrackNodes


class TrackImages:
    """Made anew for every scene that is opened, as they are not saved."""

    def __init__(self, track: TrackNodes) -> None:
        self._track = track
        self._volumes: dict[str, slicer.vtkMRMLVolumeNode] = {}
        for spot in track.spots:
            source = track.parts.get("image", spot.number)
            shown = track.parts.get("xray", spot.number)
            if shown is None and source is not None and track_sequences.has_images(source):
                shown = self._make(spot, source)
            if shown is not None:
                self._volumes[spot.name] = shown

    @property
    def volumes(self) -> dict[str, slicer.vtkMRMLVolumeNode]:
        """The X-ray of the frame that is shown, by camera."""
        return dict(self._volumes)

    def aim(self) -> None:
        """Let every view of an X-ray show it whole."""
        for spot in self._track.spots:
            shape = (spot.camera.height, spot.camera.width)
            track_views.aim_at(
                spot.number, self._volumes.get(spot.name), plane_to_ras(spot.camera, spot.distance), shape
            )

    def _make(self, spot: XraySpot, source: slicer.vtkMRMLNode) -> Any:
        track, parts = self._track, self._track.parts
        stored = file_to_source(spot.camera.width, track.settings.mirrored.get(spot.name, False))
        plane = plane_to_ras(spot.camera, spot.distance) @ stored
        sequence = track_sequences.image_sequence(
            _("{camera} frames").format(camera=spot.name),
            source,
            track.settings.first.get(spot.name, 0),
            track.record.numbers,
            plane,
        )
        parts.made("frames", spot.number, sequence)
        kind = sequence.GetNthDataNode(0).GetClassName()
        volume = slicer.mrmlScene.AddNode(unsaved_node(kind, _("{camera} X-ray").format(camera=spot.name)))
        parts.made("xray", spot.number, volume)
        track_sequences.play(track.browser, sequence, volume, shared=True)
        _display(volume, sequence)
        return volume


def _display(volume: Any, sequence: slicer.vtkMRMLSequenceNode) -> None:
    """Show a volume with one window for all frames: one that changed with them would flicker."""
    volume.CreateDefaultDisplayNodes()
    display = volume.GetDisplayNode()
    display.SetSaveWithScene(False)
    if not display.IsA("vtkMRMLScalarVolumeDisplayNode") or display.IsA("vtkMRMLVectorVolumeDisplayNode"):
        return
    last = sequence.GetNumberOfDataNodes() - 1
    some = [sequence.GetNthDataNode(number) for number in (0, last // 2, last)]
    shown = [slicer.util.arrayFromVolume(node) for node in some if node.GetImageData() is not None]
    if not shown:
        return
    values = np.concatenate([each[0, ::4, ::4].ravel() for each in shown])
    low, high = np.percentile(values, (1, 99))
    display.SetAutoWindowLevel(False)
    display.SetWindowLevelMinMax(float(low), float(max(high, low + 1e-6)))
