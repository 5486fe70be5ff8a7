"""Reads volumes and segmentations from the scene as they are shown (in the world), without changing them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from PolyPoseLib.errors import InputError

from .frames import flip_affine, from_vtk, to_vtk

LATTICE_TOLERANCE_VOXELS = 1e-3
"""Two grids are one lattice when their voxel centres agree to this part of a voxel."""


@dataclass(frozen=True)
class Grid:
    """Where voxels are: affine (4, 4) from (i, j, k, 1) to LPS mm, shape (k, j, i)."""

    affine: np.ndarray
    shape: tuple[int, int, int]

    @property
    def spacing(self) -> np.ndarray:
        """Distance of voxel centres along (i, j, k) in mm, (3,)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    def is_straight(self) -> bool:
        """Whether the axes are at right angles; files and PolyPoseLib need that."""
        axes = self.affine[:3, :3] / self.spacing
        return bool(np.abs(axes.T @ axes - np.eye(3)).max() < 1e-4)


@dataclass(frozen=True)
class Voxels:
    """Voxels (k, j, i) on a grid."""

    values: np.ndarray
    grid: Grid


@dataclass(frozen=True)
class Layer:
    """A label map of a segmentation; labels gives the value of each segment ID in it."""

    voxels: Voxels
    labels: dict[str, int]


def world_transform(node: slicer.vtkMRMLTransformableNode) -> np.ndarray | vtk.vtkGeneralTransform:
    """From a node's own RAS to the world's RAS: a matrix (4, 4) when it is linear, else a VTK transform."""
    parent = node.GetParentTransformNode()
    if parent is None:
        return np.eye(4)
    if parent.IsTransformToWorldLinear():
        matrix = vtk.vtkMatrix4x4()
        parent.GetMatrixTransformToWorld(matrix)
        return from_vtk(matrix)
    transform = vtk.vtkGeneralTransform()
    parent.GetTransformToWorld(transform)
    return transform


def read_volume(node: slicer.vtkMRMLScalarVolumeNode) -> Voxels:
    """A copy of a volume's voxels and their grid in the world, LPS.

    Raises InputError, as one sentence, when the node has no voxels.
    """
    if node.GetImageData() is None or node.GetImageData().GetNumberOfPoints() == 0:
        raise InputError(_("The volume '{name}' has no voxels: load it again.").format(name=node.GetName()))
    to_world = world_transform(node)
    if not isinstance(to_world, np.ndarray):
        node = _hardened(node, to_world)
        to_world = np.eye(4)
    matrix = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(matrix)
    affine = flip_affine(to_world @ from_vtk(matrix))
    values = np.array(slicer.util.arrayFromVolume(node))
    voxels = Voxels(values, Grid(affine, values.shape[:3]))
    return voxels if voxels.grid.is_straight() else resample(voxels, straightened(voxels.grid))


def read_layers(node: slicer.vtkMRMLSegmentationNode, segment_ids: Sequence[str]) -> list[Layer]:
    """Copies of the label maps that hold some segments of a segmentation, in the world, LPS.

    A segmentation without label maps gets them in a copy; the node itself is not changed. Raises InputError
    when a segment does not exist.
    """
    for segment_id in segment_ids:
        if node.GetSegmentation().GetSegment(segment_id) is None:
            raise InputError(
                _("The segmentation '{name}' has no segment '{segment}'.").format(
                    name=node.GetName(), segment=segment_id
                )
            )
    to_world = world_transform(node)
    name = slicer.vtkSegmentationConverter.GetSegmentationBinaryLabelmapRepresentationName()
    if not isinstance(to_world, np.ndarray) or not node.GetSegmentation().ContainsRepresentation(name):
        linear = isinstance(to_world, np.ndarray)
        node = _hardened(node, None if linear else to_world)
        to_world = to_world if linear else np.eye(4)
        if not node.GetSegmentation().CreateRepresentation(name):
            raise InputError(
                _("The segmentation '{name}' cannot be converted to label maps.").format(name=node.GetName())
            )
    images: dict[str, tuple[vtk.vtkImageData, dict[str, int]]] = {}
    for segment_id in segment_ids:
        segment = node.GetSegmentation().GetSegment(segment_id)
        image = segment.GetRepresentation(name)
        if image is not None and image.GetNumberOfPoints() > 0:
            images.setdefault(image.GetAddressAsString(""), (image, {}))[1][segment_id] = (
                segment.GetLabelValue()
            )
    return [Layer(_oriented_voxels(image, to_world), labels) for image, labels in images.values()]


def _oriented_voxels(image: slicer.vtkOrientedImageData, to_world: np.ndarray) -> Voxels:
    """The voxels of a vtkOrientedImageData; its extent need not start at 0."""
    matrix = vtk.vtkMatrix4x4()
    image.GetImageToWorldMatrix(matrix)
    first = np.eye(4)
    first[:3, 3] = image.GetExtent()[::2]
    shape = tuple(reversed(image.GetDimensions()))
    values = np.array(vtk_to_numpy(image.GetPointData().GetScalars())).reshape(shape)
    return Voxels(values, Grid(flip_affine(to_world @ from_vtk(matrix)) @ first, shape))


def _hardened(
    node: slicer.vtkMRMLDisplayableNode, transform: vtk.vtkAbstractTransform | None
) -> slicer.vtkMRMLDisplayableNode:
    """A copy of a node outside of the scene, with a transform applied to its content."""
    copy = slicer.vtkMRMLNode.SafeDownCast(node.CreateNodeInstance())
    copy.UnRegister(None)
    copy.SetName(node.GetName())
    copy.CopyContent(node)
    if transform is not None:
        copy.ApplyTransform(transform)
    return copy


def straightened(grid: Grid) -> Grid:
    """A grid of right angles that covers a sheared one, near its axes and with its spacing."""
    axes = grid.affine[:3, :3] / grid.spacing
    left, _singular, right = np.linalg.svd(axes)
    direction = left @ right  # the nearest orthogonal matrix
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in grid.shape[::-1]], indexing="ij"), -1).reshape(8, 3)
    corners = (ends @ grid.affine[:3, :3].T + grid.affine[:3, 3]) @ direction
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = np.ceil((high - low) / grid.spacing - 1e-6).astype(int) + 1
    affine = np.eye(4)
    affine[:3, :3] = direction * grid.spacing
    affine[:3, 3] = direction @ low
    return Grid(affine, (int(size[2]), int(size[1]), int(size[0])))


def resample(voxels: Voxels, grid: Grid, labels: bool = False, outside: float | None = None) -> Voxels:
    """Voxels on another grid: linear, or nearest neighbour for labels (0 outside).

    outside: the value where there was nothing; by default the lowest of the voxels.
    """
    import SimpleITK as sitk

    image = sitk.GetImageFromArray(voxels.values)
    # The image keeps its index space; the transform takes points of the new grid there.
    to_index = np.linalg.inv(voxels.grid.affine)
    transform = sitk.AffineTransform(3)
    transform.SetMatrix(to_index[:3, :3].ravel().tolist())
    transform.SetTranslation(to_index[:3, 3].tolist())
    if outside is None:
        outside = 0.0 if labels else float(voxels.values.min())
    direction = grid.affine[:3, :3] / grid.spacing
    out = sitk.Resample(
        image,
        list(map(int, grid.shape[::-1])),
        transform,
        sitk.sitkNearestNeighbor if labels else sitk.sitkLinear,
        grid.affine[:3, 3].tolist(),
        grid.spacing.tolist(),
        direction.ravel().tolist(),
        outside,
    )
    return Voxels(sitk.GetArrayFromImage(out), grid)


def lattice_shift(source: Grid, target: Grid) -> np.ndarray | None:
    """Whole voxels (i, j, k) from the target's first voxel to the source's; None: not one lattice."""
    relative = np.linalg.inv(target.affine) @ source.affine
    size = np.array([*source.shape[::-1], 1.0])
    shift = np.round(relative[:3, 3])
    drift = np.abs(relative[:3, :3] - np.eye(3)) @ size[:3] + np.abs(relative[:3, 3] - shift)
    return shift.astype(int) if drift.max() < LATTICE_TOLERANCE_VOXELS * size.max() else None


def region_on(voxels: Voxels, grid: Grid) -> tuple[tuple[slice, ...], np.ndarray]:
    """Where a label map lies on another grid, and its values there; the rest of the grid is background.

    Returns slices (k, j, i) of the grid and an array of their shape.
    """
    shift = lattice_shift(voxels.grid, grid)
    if shift is None:
        return (slice(None),) * 3, resample(voxels, grid, labels=True).values
    into, taken = [], []
    for size, length, start in zip(grid.shape, voxels.values.shape, shift[::-1], strict=True):
        low, high = max(0, start), min(size, start + length)
        into.append(slice(low, max(low, high)))
        taken.append(slice(low - start, max(low, high) - start))
    return tuple(into), voxels.values[tuple(taken)]


def set_volume(
    node: slicer.vtkMRMLScalarVolumeNode,
    values: np.ndarray,
    to_ras: np.ndarray,
    window_level: tuple[float, float] | None = None,
) -> None:
    """Fill a volume node with an array (k, j, i) without copying it; to_ras: (i, j, k, 1) to RAS.

    window_level: for a new display; found from the values, which takes time, when it is None.
    """
    values = np.ascontiguousarray(values)
    image = vtk.vtkImageData()
    image.SetDimensions(*map(int, values.shape[::-1]))
    scalars = numpy_to_vtk(values.reshape(-1))
    scalars.SetName("ImageScalars")
    image.GetPointData().SetScalars(scalars)
    was = node.StartModify()
    node.SetAndObserveTransformNodeID(None)
    node.SetIJKToRASMatrix(to_vtk(to_ras))
    if node.GetDisplayNode() is None:
        node.CreateDefaultDisplayNodes()
        if window_level is not None:
            node.GetDisplayNode().SetAutoWindowLevel(False)
            node.GetDisplayNode().SetWindowLevel(*window_level)
    node.SetAndObserveImageData(image)
    node.EndModify(was)


def set_layer(image: slicer.vtkOrientedImageData, voxels: Voxels) -> None:
    """Let a vtkOrientedImageData show labels given in LPS, without copying them."""
    image.SetExtent(0, voxels.grid.shape[2] - 1, 0, voxels.grid.shape[1] - 1, 0, voxels.grid.shape[0] - 1)
    scalars = numpy_to_vtk(np.ascontiguousarray(voxels.values).reshape(-1))
    scalars.SetName("ImageScalars")
    image.GetPointData().SetScalars(scalars)
    image.SetImageToWorldMatrix(to_vtk(flip_affine(voxels.grid.affine)))
