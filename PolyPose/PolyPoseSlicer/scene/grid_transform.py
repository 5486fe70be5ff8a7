"""A displacement field as a grid transform node, in the direction in which images are resampled."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from PolyPoseLib.errors import InputError

from .frames import flip_affine, flip_vectors, from_vtk, to_vtk

if TYPE_CHECKING:
    from PolyPoseLib.data.displacement_field import DisplacementField


def set_grid_transform(node: slicer.vtkMRMLTransformNode, vectors: np.ndarray, affine: np.ndarray) -> None:
    """Make a transform node hold a displacement field from fixed to moving points.

    vectors: (k, j, i, 3) mm along LPS axes; affine: (4, 4) from (i, j, k, 1) to fixed LPS mm.
    The map goes from the node's parent (fixed, what the views show) to its content (moving).
    """
    to_ras = flip_affine(affine)
    spacing = np.linalg.norm(to_ras[:3, :3], axis=0)
    size = vectors.shape[2::-1]
    grid = vtk.vtkImageData()
    grid.SetDimensions(*map(int, size))
    grid.SetSpacing(*spacing)
    grid.SetOrigin(*to_ras[:3, 3])
    values = np.ascontiguousarray(flip_vectors(vectors).reshape(-1, 3))
    array = numpy_to_vtk(values, deep=True)
    array.SetName("displacement")
    grid.GetPointData().SetScalars(array)
    direction = np.eye(4)
    direction[:3, :3] = to_ras[:3, :3] / spacing
    transform = slicer.vtkOrientedGridTransform()
    transform.SetGridDirectionMatrix(to_vtk(direction))
    transform.SetDisplacementGridData(grid)
    transform.SetInterpolationModeToLinear()
    node.SetAndObserveTransformFromParent(transform)


def field_of(node: slicer.vtkMRMLTransformNode) -> DisplacementField:
    """A copy of the displacement field that a transform node holds, LPS; raises InputError when it holds none."""
    from PolyPoseLib.data.displacement_field import DisplacementField

    transform = node.GetTransformFromParentAs("vtkOrientedGridTransform", False, True)
    if transform is None or transform.GetDisplacementGrid() is None:
        raise InputError(
            _("'{node}' does not hold a displacement grid: register first, or load a result.").format(
                node=node.GetName()
            )
        )
    grid = transform.GetDisplacementGrid()
    shape = grid.GetDimensions()[::-1]
    vectors = vtk_to_numpy(grid.GetPointData().GetScalars()).reshape(*shape, 3)
    direction = transform.GetGridDirectionMatrix()
    affine = np.eye(4) if direction is None else from_vtk(direction)
    affine[:3, :3] = affine[:3, :3] * np.array(grid.GetSpacing())
    affine[:3, 3] = grid.GetOrigin()
    return DisplacementField(
        np.ascontiguousarray(flip_vectors(vectors), dtype=np.float32), flip_affine(affine)
    )


def keep_linear(node: slicer.vtkMRMLTransformNode | None) -> None:
    """Interpolate linearly, as ITK and the registration do; Slicer reads a grid from a file as a cubic one."""
    if node is None or node.IsLinear():
        return
    transform = node.GetTransformFromParentAs("vtkOrientedGridTransform", False, True)
    if transform is not None and transform.GetInterpolationMode() != vtk.VTK_LINEAR_INTERPOLATION:
        transform.SetInterpolationModeToLinear()


def read_field(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (k, j, i, 3) and affine (4, 4) in LPS mm from the file of a displacement field (.h5, .nrrd).

    Raises RuntimeError or ValueError when the file holds none.
    """
    import SimpleITK as sitk

    path = str(path)
    if path.lower().endswith((".h5", ".hdf5", ".tfm")):
        image = sitk.DisplacementFieldTransform(sitk.ReadTransform(path)).GetDisplacementField()
    else:
        image = sitk.ReadImage(path)
    if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 3:
        raise ValueError(f"{path} holds no field of displacements.")
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return sitk.GetArrayFromImage(image).astype(np.float32), affine
