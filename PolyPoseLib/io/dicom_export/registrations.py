"""Registrations between the CT's frame of reference and that of the patient as X-rayed.

In DICOM the two kinds of object map opposite ways (PS3.17 O.1). In both, the *registered* frame is that of the patient
as X-rayed, and the *source* frame the CT's:

- Spatial Registration (PS3.3 C.20.2): a matrix takes a point of the source to its place in the registered frame.
- Deformable Spatial Registration (C.20.3): at a point of the registered frame, vectors lead to the point of the source.

One Spatial Registration holds one bone, in a series of its own: readers multiply the matrices of one object, and refuse
series of several.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.io.dicom_export.axes import reordered
from PolyPoseLib.io.dicom_export.objects import Export, Series, coded, decimals, text_of
from PolyPoseLib.io.dicom_export.references import referenced_series, references
from PolyPoseLib.io.dicom_export.source import SourceImage

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

SPATIAL = "1.2.840.10008.5.1.4.1.1.66.1"
DEFORMABLE = "1.2.840.10008.5.1.4.1.1.66.3"

_BY_CONTENT = ("125024", "DCM", "Image Content-based Alignment")
_IDENTITY = ("125021", "DCM", "Frame of Reference Identity")


@dataclass(frozen=True)
class Warped:
    """The CT series in the registered frame, to which registrations refer."""

    series: Series
    images: Sequence[SourceImage]


def spatial_registration(
    export: Export, series: Series, warped: Warped, name: str, structure: StructureResult
) -> Dataset:
    """The rigid motion of one bone.

    Parameters
    ----------
    export
        Patient, study, time and frames.
    series
        The object's own.
    warped
        In the registered frame.
    name, structure
        Of the bone.

    Returns
    -------
    Dataset
        A Spatial Registration Storage object.

    """
    made = _registration(export, SPATIAL, series, warped)
    made.ContentLabel = _label(name)
    made.ContentDescription = text_of(f"{name}: CT to patient as X-rayed")
    comment = f"doubtful: {'; '.join(structure.doubts)}" if structure.doubts else f"rigid motion of {name}"
    made.RegistrationSequence = [
        _matrix_item(export.posture_frame, warped.images, np.eye(4), _IDENTITY, ""),
        _matrix_item(
            export.source.frame_of_reference,
            export.source.images,
            rigid_inverse(structure.fixed_to_moving),
            _BY_CONTENT,
            text_of(comment),
        ),
    ]
    return made


def deformable_registration(
    export: Export, series: Series, warped: Warped, transform: DisplacementField
) -> Dataset:
    """The displacement field.

    Parameters
    ----------
    export
        Patient, study, time and frames.
    series
        The object's own.
    warped
        In the registered frame.
    transform
        From fixed to moving points, LPS mm.

    Returns
    -------
    Dataset
        A Deformable Spatial Registration Storage object.

    """
    from pydicom.dataset import Dataset

    made = _registration(export, DEFORMABLE, series, warped)
    made.ContentLabel = "POLYRIGID"
    made.ContentDescription = "Patient as X-rayed to CT, all tissue"
    item = Dataset()
    item.SourceFrameOfReferenceUID = export.source.frame_of_reference
    item.ReferencedImageSequence = references(export.source.images)
    item.RegistrationTypeCodeSequence = [coded(*_BY_CONTENT)]
    item.PreDeformationMatrixRegistrationSequence = [_matrix(np.eye(4))]
    item.PostDeformationMatrixRegistrationSequence = [_matrix(np.eye(4))]
    item.DeformableRegistrationGridSequence = [_grid(transform, export.source.grid.affine)]
    made.DeformableRegistrationSequence = [item]
    return made


def _registration(export: Export, sop_class: str, series: Series, warped: Warped) -> Dataset:
    """What both kinds have in common."""
    made = export.new_object(sop_class, series, 1, export.posture_frame)
    made.ContentDate, made.ContentTime = export.date, export.time
    made.ContentCreatorName = ""
    made.ReferencedSeriesSequence = [
        referenced_series(warped.series.uid, warped.images),
        referenced_series(export.source.uid, export.source.images),
    ]
    return made


def _matrix_item(
    frame: str, images: Sequence[SourceImage], matrix: np.ndarray, how: tuple[str, str, str], comment: str
) -> Dataset:
    """An item of the Registration Sequence: from a frame of reference to the registered one."""
    from pydicom.dataset import Dataset

    registration = Dataset()
    registration.RegistrationTypeCodeSequence = [coded(*how)]
    registration.MatrixSequence = [_matrix(matrix)]
    if comment:
        registration.FrameOfReferenceTransformationComment = comment
    item = Dataset()
    item.FrameOfReferenceUID = frame
    item.ReferencedImageSequence = references(images)
    item.MatrixRegistrationSequence = [registration]
    return item


def _matrix(matrix: np.ndarray) -> Dataset:
    """A rigid motion (4, 4), row by row."""
    from pydicom.dataset import Dataset

    item = Dataset()
    item.FrameOfReferenceTransformationMatrix = decimals(matrix)
    item.FrameOfReferenceTransformationMatrixType = "RIGID"
    return item


def _grid(field: DisplacementField, like: np.ndarray) -> Dataset:
    """The vectors on their grid, whose axes follow the CT's; DICOM takes the third from the first two."""
    from pydicom.dataset import Dataset

    vectors, affine = reordered(field.vectors, field.affine, like)
    if np.linalg.det(affine[:3, :3]) < 0:
        affine[:3, 3] += (len(vectors) - 1) * affine[:3, 2]
        affine[:3, 2] *= -1
        vectors = vectors[::-1]
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    item = Dataset()
    item.ImagePositionPatient = decimals(affine[:3, 3])
    item.ImageOrientationPatient = decimals((affine[:3, :2] / spacing[:2]).T)
    item.GridDimensions = list(vectors.shape[2::-1])
    item.GridResolution = spacing.tolist()
    item.VectorGridData = np.ascontiguousarray(vectors, dtype="<f4").tobytes()
    return item


def _label(name: str) -> str:
    """A name as a label (CS): capitals, digits, underscores."""
    return re.sub(r"[^A-Z0-9]+", "_", name.upper()).strip("_")[:16] or "BONE"
