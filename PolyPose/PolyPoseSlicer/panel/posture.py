"""Shows the CT and its bones in the slices as they were scanned, or as they are in the X-rays."""

from __future__ import annotations

import slicer

from ..scene import layouts
from ..study.parameters import PolyPoseParameterNode, structures_of


def show_posture(parameters: PolyPoseParameterNode, after: bool) -> None:
    """Show the inputs, or (after) the warped CT and segmentation, in the slices and in 3D; moves no node."""
    after = after and parameters.outputVolume is not None
    volume = parameters.outputVolume if after else parameters.ct
    if volume is not None:
        layouts.set_background(volume)
    shown = parameters.outputSegmentation if after else parameters.segmentation
    hidden = parameters.segmentation if after else parameters.outputSegmentation
    if shown is None:
        return
    for node, visible in ((shown, True), (hidden, False)):
        if node is not None and node is not (None if visible else shown):
            _set_visible(node, visible)


def _set_visible(node: slicer.vtkMRMLSegmentationNode, visible: bool) -> None:
    if node.GetDisplayNode() is None:
        node.CreateDefaultDisplayNodes()
    if node.GetDisplayNode() is not None:
        node.GetDisplayNode().SetVisibility(visible)


def show_only_bones(parameters: PolyPoseParameterNode, only: bool) -> None:
    """Hide the segments that belong to no structure, or show all again, in both segmentations."""
    bones = {segment for segments in structures_of(parameters).values() for segment in segments}
    for node in (parameters.segmentation, parameters.outputSegmentation):
        if node is None or node.GetDisplayNode() is None:
            continue
        was = node.GetDisplayNode().StartModify()
        for segment in node.GetSegmentation().GetSegmentIDs():
            node.GetDisplayNode().SetSegmentVisibility(segment, not only or segment in bones)
        node.GetDisplayNode().EndModify(was)
