"""Read label maps and segmentations, names of segments included."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.data.segmentation import Segment, Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom_segments import find_dicom_segmentation, read_dicom_segmentation
from PolyPoseLib.io.images import read_image
from PolyPoseLib.io.mask_folder import is_mask_folder, read_mask_folder
from PolyPoseLib.io.volumes import read_volume

if TYPE_CHECKING:
    import SimpleITK as sitk

_SLICER_ENDINGS = (".nrrd", ".nhdr")
"""Files that may name their segments."""

_SEGMENT_FIELD = re.compile(r"^Segment([0-9]{1,9})_(ID|Name|LabelValue|Layer)$")


def read_segmentation(path: str | Path, reference: Volume | None = None) -> Segmentation:
    """Read a label map, a .seg.nrrd, a DICOM SEG or RTSTRUCT, or a folder of one mask per structure.

    Parameters
    ----------
    path
        A file, a folder of masks, or a folder of DICOM: one SEG or RTSTRUCT, beside its CT perhaps, or slices
        of labels.
    reference
        The CT, on whose grid the contours of an RTSTRUCT are filled; on one of their own, without it.

    Raises
    ------
    InputError
        The file cannot be read, or its values are no labels; the sentence names it and the fix.

    """
    path = Path(path)
    if is_mask_folder(path):
        return read_mask_folder(path)
    found = find_dicom_segmentation(path)
    if found:
        return read_dicom_segmentation(*found, reference)
    if path.name.lower().endswith(_SLICER_ENDINGS) and not path.is_dir():
        image = read_image(path)
        fields = _segment_fields(image)
        if fields:
            layers = _layers(image, path)
            return Segmentation(layers, _segments(fields, path, len(layers)), str(path))
    return Segmentation.from_labels(read_volume(path), str(path))


def _segment_fields(image: sitk.Image) -> dict[str, str]:
    """The fields about segments; other programs' fields may have names that the toolkit does not find again."""
    keys = [key for key in image.GetMetaDataKeys() if _SEGMENT_FIELD.match(key)]
    return {key: _text(image.GetMetaData(key)) for key in keys}


def _text(value: str) -> str:
    """A field's value with the replacement character where its bytes are no UTF-8, so that it can be printed."""
    return value.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def _layers(image: sitk.Image, path: Path) -> tuple[Volume, ...]:
    """The layers of a vector or four-dimensional image as volumes."""
    import SimpleITK as sitk

    if image.GetDimension() == 4:
        size = image.GetSize()
        parts = [sitk.Extract(image, [*size[:3], 0], [0, 0, 0, n]) for n in range(size[3])]
    elif image.GetNumberOfComponentsPerPixel() > 1:
        parts = [
            sitk.VectorIndexSelectionCast(image, n) for n in range(image.GetNumberOfComponentsPerPixel())
        ]
    else:
        parts = [image]
    try:
        return tuple(Volume.from_sitk(part) for part in parts)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _segments(fields: dict[str, str], path: Path, layers: int) -> tuple[Segment, ...]:
    """The segments that a .seg.nrrd names in its fields Segment{N}_ID, _Name, _LabelValue and _Layer.

    Older files keep one segment a layer with label 1 and give neither LabelValue nor Layer; other programs give labels
    in one image, and no Layer.
    """
    numbered: dict[int, dict[str, str]] = {}
    for key, value in fields.items():
        match = _SEGMENT_FIELD.match(key)
        if match:
            numbered.setdefault(int(match[1]), {})[match[2]] = value.strip()
    segments = []
    for number, values in sorted(numbered.items()):
        identifier = values.get("ID", f"Segment_{number}")
        usual = 0 if layers == 1 and "LabelValue" in values else number
        try:
            layer, label = int(values.get("Layer", usual)), int(values.get("LabelValue", 1))
        except ValueError as error:
            raise InputError(
                f"{path}: segment {number} has a Layer or LabelValue that is not a whole number: export it "
                "again."
            ) from error
        segments.append(Segment(identifier, values.get("Name", identifier), layer, label))
    return tuple(segments)
