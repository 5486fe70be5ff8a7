"""What the deformation looks like: Slicer's own grid and arrows, the volume change, a structure's weight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk

from PolyPoseLib.data.options import USUAL_EPSILON
from PolyPoseLib.errors import InputError

from . import layouts
from .frames import flip_affine, to_vtk
from .grid_transform import field_of
from .nodes import Grid, Layer, read_layers, region_on

if TYPE_CHECKING:
    from PolyPoseLib.data.displacement_field import DisplacementField

MAP_ATTRIBUTE = "PolyPose.Map"
"""Attribute of the volumes that are drawn here: "volume change" or "weight"."""

_CHANGE_RANGE = (0.0, 2.0)
_FOLD_COLOR = (1.0, 0.0, 1.0)
_GRID_SPACING_MM = 15.0
WEIGHT_SPACING_MM = 4.0
_RIGID_DELTA_MM = 1e-4


def show_transform(
    node: slicer.vtkMRMLTransformNode, region: slicer.vtkMRMLVolumeNode | None, what: str
) -> None:
    """Show a transform as "grid" in slices or as "glyphs" in slices and 3D, or hide it (""); not over the X-rays.

    A grid of the whole region in 3D would hide everything and takes seconds to draw.
    """
    if not what:
        if node.GetDisplayNode() is not None:
            node.GetDisplayNode().SetVisibility(False)
        return
    display = _restricted_display(node)
    was = display.StartModify()
    if region is not None:
        display.SetAndObserveRegionNode(region)
        display.SetAndObserveGlyphPointsNode(None)
    grid = slicer.vtkMRMLTransformDisplayNode.VIS_MODE_GRID
    glyph = slicer.vtkMRMLTransformDisplayNode.VIS_MODE_GLYPH
    display.SetVisualizationMode(grid if what == "grid" else glyph)
    display.SetGridSpacingMm(_GRID_SPACING_MM)
    display.SetGlyphSpacingMm(_GRID_SPACING_MM)
    display.SetGlyphDisplayRangeMinMm(0.5)
    display.SetVisibility(True)
    display.SetVisibility2D(True)
    display.SetVisibility3D(what == "glyphs")
    display.EndModify(was)


def _restricted_display(node: slicer.vtkMRMLTransformNode) -> slicer.vtkMRMLTransformDisplayNode:
    """The node's display node, shown in the views of the patient alone.

    Slice views look only once whether they may show a display node, when its transform gets it: one that was not
    restricted by then is replaced.
    """
    wanted, display = layouts.patient_views(), node.GetDisplayNode()
    if display is not None:
        present = [display.GetNthViewNodeID(number) for number in range(display.GetNumberOfViewNodeIDs())]
        if set(present) == set(wanted):
            return display
        slicer.mrmlScene.RemoveNode(display)
    display = slicer.mrmlScene.CreateNodeByClass("vtkMRMLTransformDisplayNode")
    display.UnRegister(None)
    display.SetVisibility(False)
    display.SetViewNodeIDs(wanted)
    slicer.mrmlScene.AddNode(display)
    display.SetDefaultColors()
    node.SetAndObserveDisplayNodeID(display.GetID())
    return display


@dataclass(frozen=True)
class VolumeChange:
    """Jacobian determinants of the map from the X-rays' posture to the CT.

    values: (k, j, i), 1 where volume is kept; affine: (4, 4) index to RAS; folds: share of voxels <= 0.
    """

    values: np.ndarray
    affine: np.ndarray
    folds: float

    @property
    def text(self) -> str:
        """One sentence about it."""
        low, high = np.percentile(self.values, (0.5, 99.5))
        spread = _("Volume changes by a factor of {low:.2f} to {high:.2f} (99 % of the grid).").format(
            low=low, high=high
        )
        if not self.folds:
            return _("No folds.") + " " + spread
        folds = _(
            "The deformation folds in {share:.2f} % of the grid (magenta): do not trust the soft tissue there."
        ).format(share=100 * self.folds)
        return folds + " " + spread


def volume_change(node: slicer.vtkMRMLTransformNode) -> Callable[[], VolumeChange]:
    """What computes the Jacobian map of a grid transform node, without touching the node any more.

    Raises InputError when the node holds no grid.
    """
    field = field_of(node)
    return partial(_change, field, flip_affine(field.affine))


def _change(field: DisplacementField, affine: np.ndarray) -> VolumeChange:
    from PolyPoseLib.warp.dense import jacobian_determinant

    values = np.asarray(jacobian_determinant(field), np.float32)
    return VolumeChange(values, affine, float(np.mean(values <= 0)))


def show_volume_change(change: VolumeChange) -> slicer.vtkMRMLScalarVolumeNode:
    """Draw the map as a volume: blue shrinks, white stays, red grows, magenta folds."""
    node = _map_node("volume change", _("PolyPose volume change"))
    _fill(node, change.values, change.affine)
    step = (_CHANGE_RANGE[1] - _CHANGE_RANGE[0]) / 255
    _set_colors(node, _("PolyPose volume change colours"), _diverging(), (-step, _CHANGE_RANGE[1]))
    return node


@dataclass(frozen=True)
class Weighting:
    """How the warp weighs structures, as in PolyPoseLib.data.options."""

    form: str = "rigid"
    epsilon: float = USUAL_EPSILON


def structure_weight(
    segmentation: slicer.vtkMRMLSegmentationNode,
    structures: dict[str, list[str]],
    name: str,
    weighting: Weighting,
) -> Callable[[], tuple[np.ndarray, np.ndarray]]:
    """What computes how strongly a structure's motion influences each point of the CT, without touching nodes.

    It returns (k, j, i) from 0 to 1 and index to RAS (4, 4), at rest, on a grid of about 4 mm. Raises InputError for
    an unknown name.
    """
    if name not in structures:
        raise InputError(_("There is no structure '{name}': choose one from the table.").format(name=name))
    layers = read_layers(segmentation, [each for ids in structures.values() for each in ids])
    return partial(_weight_of, layers, structures, name, weighting)


def _weight_of(
    layers: list[Layer], structures: dict[str, list[str]], name: str, weighting: Weighting
) -> tuple[np.ndarray, np.ndarray]:
    grid = _coarse_grid([layer.voxels.grid for layer in layers])
    owner = np.zeros(grid.shape, np.int16)
    for number, ids in enumerate(structures.values(), start=1):
        for layer in layers:
            labels = [layer.labels[each] for each in ids if each in layer.labels]
            if labels:
                region, values = region_on(layer.voxels, grid)
                np.copyto(owner[region], np.int16(number), where=np.isin(values, labels))
    share = np.bincount(owner.ravel(), minlength=len(structures) + 1)[1:].astype(np.float64)
    share /= max(share.sum(), 1)
    total, mine = np.zeros(grid.shape, np.float64), np.zeros(grid.shape, np.float64)
    for number, structure in enumerate(structures, start=1):
        squared = _distance(owner == number, grid.spacing) ** 2
        weight = _weight(squared, share[number - 1], weighting)
        total += weight
        mine = weight if structure == name else mine
    return (mine / np.maximum(total, 1e-30)).astype(np.float32), flip_affine(grid.affine)


def show_weight(values: np.ndarray, affine: np.ndarray, name: str) -> slicer.vtkMRMLScalarVolumeNode:
    """Draw a weight field as a volume."""
    node = _map_node("weight", _("PolyPose weight"))
    node.SetName(_("PolyPose weight of {name}").format(name=name))
    _fill(node, values, affine)
    _set_colors(node, _("PolyPose weight colours"), _warm(), (0.0, 1.0))
    return node


def _weight(squared: np.ndarray, share: float, weighting: Weighting) -> np.ndarray:
    if weighting.form == "mass":
        return share / (1 + squared)
    if weighting.form == "epsilon":
        return 1 / (1 + weighting.epsilon * squared)
    return share / (_RIGID_DELTA_MM**2 + squared)


def _coarse_grid(grids: list[Grid]) -> Grid:
    """The first grid in steps of about 4 mm."""
    grid = grids[0]
    factors = np.maximum(np.round(WEIGHT_SPACING_MM / grid.spacing), 1)
    affine = grid.affine @ np.diag([*factors, 1.0])
    k, j, i = (int(-(-size // factor)) for size, factor in zip(grid.shape, factors[::-1], strict=True))
    return Grid(affine, (k, j, i))


def _distance(mask: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Distance in mm to the mask, 0 inside; far away when it is empty."""
    import SimpleITK as sitk

    if not mask.any():
        return np.full(mask.shape, 1e6)
    image = sitk.GetImageFromArray(mask.astype(np.uint8))
    image.SetSpacing(spacing.tolist())
    distance = sitk.SignedMaurerDistanceMap(image, False, False, True)
    return np.maximum(sitk.GetArrayFromImage(distance), 0)


def _map_node(kind: str, name: str) -> slicer.vtkMRMLScalarVolumeNode:
    for node in slicer.util.getNodesByClass("vtkMRMLScalarVolumeNode"):
        if node.GetAttribute(MAP_ATTRIBUTE) == kind:
            return node
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", name)
    node.SetAttribute(MAP_ATTRIBUTE, kind)
    return node


def _fill(node: slicer.vtkMRMLScalarVolumeNode, values: np.ndarray, affine: np.ndarray) -> None:
    image = vtk.vtkImageData()
    image.SetDimensions(*map(int, values.shape[::-1]))
    scalars = numpy_to_vtk(np.ascontiguousarray(values, np.float32).reshape(-1), deep=True)
    image.GetPointData().SetScalars(scalars)
    node.SetIJKToRASMatrix(to_vtk(affine))
    node.SetAndObserveImageData(image)


def _set_colors(
    node: slicer.vtkMRMLScalarVolumeNode, name: str, colors: np.ndarray, limits: tuple[float, float]
) -> None:
    """Give a volume a colour table of its own over fixed limits."""
    table = slicer.mrmlScene.GetFirstNodeByName(name)
    if table is None:
        table = slicer.mrmlScene.CreateNodeByClass("vtkMRMLColorTableNode")
        table.UnRegister(None)
        table.SetName(name)
        table.SetTypeToUser()
        table.SetNumberOfColors(len(colors))
        for index, color in enumerate(colors):
            table.SetColor(index, *map(float, color), 1.0)
        table.SetHideFromEditors(True)
        table = slicer.mrmlScene.AddNode(table)
    if node.GetDisplayNode() is None:
        node.CreateDefaultDisplayNodes()
    display = node.GetDisplayNode()
    display.SetAndObserveColorNodeID(table.GetID())
    display.SetAutoWindowLevel(False)
    display.SetWindowLevelMinMax(*limits)
    display.SetInterpolate(False)


def _diverging() -> np.ndarray:
    """256 colours: magenta for folds, then blue over white to red."""
    place = np.linspace(-1, 1, 255)[:, None]
    cold, warm = np.array([0.13, 0.40, 0.85]), np.array([0.85, 0.20, 0.10])
    end = np.where(place < 0, cold, warm)
    colors = 1 + np.abs(place) * (end - 1)
    return np.vstack([_FOLD_COLOR, colors])


def _warm() -> np.ndarray:
    """256 colours from black over orange to yellow."""
    place = np.linspace(0, 1, 256)
    return np.stack([np.sqrt(place), place**1.5, 0.4 * place**4], axis=-1)
