"""The bones as surfaces in 3D, each where it is in the CT's posture or in that of the X-rays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _

from .bone_handles import coarsened, surface_of
from .frames import flip_map, from_vtk, to_vtk
from .own_nodes import remove_with_display, unsaved_node


class BoneModels:
    """Models that are drawn from the segmentation, so that they are not saved with the scene."""

    def __init__(self) -> None:
        """No bone yet."""
        self._nodes: dict[str, tuple[slicer.vtkMRMLModelNode, slicer.vtkMRMLLinearTransformNode]] = {}

    @property
    def names(self) -> list[str]:
        """The bones that are shown and have not been deleted."""
        return [
            name for name, nodes in self._nodes.items() if all(each.GetScene() is not None for each in nodes)
        ]

    def build(
        self, segmentation: slicer.vtkMRMLSegmentationNode, structures: Mapping[str, Sequence[str]]
    ) -> Iterator[None]:
        """Make the models anew, {structure: segment IDs}; yields after every segment, as each takes some time."""
        self.clear()
        for name, segments in structures.items():
            whole = vtk.vtkAppendPolyData()
            for segment in segments:
                whole.AddInputData(surface_of(segmentation, [segment]))
                yield
            whole.Update()
            color = segmentation.GetSegmentation().GetSegment(segments[0]).GetColor()
            self._nodes[name] = _shown(name, coarsened(whole.GetOutput()), color)

    def place(self, motions: Mapping[str, np.ndarray]) -> None:
        """Move bones by motions (4, 4) in LPS mm from the CT's posture; those without one are where the CT has them."""
        for name in self.names:
            _model, transform = self._nodes[name]
            wanted, present = to_vtk(flip_map(motions.get(name, np.eye(4)))), vtk.vtkMatrix4x4()
            transform.GetMatrixTransformToParent(present)
            if not np.allclose(from_vtk(present), from_vtk(wanted), atol=1e-9):
                transform.SetMatrixTransformToParent(wanted)

    def clear(self) -> None:
        """Take all of them out of the scene."""
        for nodes in self._nodes.values():
            for node in nodes:
                remove_with_display(node)
        self._nodes.clear()


def _shown(
    name: str, surface: vtk.vtkPolyData, color: tuple[float, float, float]
) -> tuple[slicer.vtkMRMLModelNode, slicer.vtkMRMLLinearTransformNode]:
    """A model in 3D, and the transform that moves it."""
    scene = slicer.mrmlScene
    transform = _hidden("vtkMRMLLinearTransformNode", _("Motion of {name}").format(name=name))
    model = _hidden("vtkMRMLModelNode", _("{name} in 3D").format(name=name))
    scene.AddNode(transform)
    scene.AddNode(model)
    model.SetAndObservePolyData(surface)
    model.CreateDefaultDisplayNodes()
    display = model.GetDisplayNode()
    display.SetSaveWithScene(False)
    display.SetColor(*color)
    display.SetVisibility2D(False)
    model.SetAndObserveTransformNodeID(transform.GetID())
    return model, transform


def _hidden(kind: str, name: str) -> slicer.vtkMRMLNode:
    """A node that lists do not show and scenes do not keep; not in the scene yet."""
    node = unsaved_node(kind, name)
    node.SetHideFromEditors(True)
    return node
