"""Hounsfield units of DICOM slices, each by its own attributes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from PolyPoseLib.data.volume import AIR_HU
from PolyPoseLib.errors import InputError, is_out_of_memory, memory_ran_out
from PolyPoseLib.io.dicom import (
    complete_meta,
    looks_like_dicom,
    raw_value,
    read_dataset,
    refuse_short,
    refuse_swollen,
)
from PolyPoseLib.io.machine_memory import require_room
from PolyPoseLib.io.native_output import native_output_logged
from PolyPoseLib.io.slice_stack import Slice

_TISSUE_HU = (-500.0, 3071.0)
"""A padding value within it may be tissue's, too, so that it counts only where it touches the slice's edge."""


@native_output_logged()
def stack_pixels(slices: Sequence[Slice], path: Path) -> np.ndarray:
    """Voxels of slices of one size, with rescale slope and intercept applied (DICOM C.11.1) and padding as air.

    Photometric Interpretation (0028,0004) is for display alone: stored values mean the same under MONOCHROME1.

    Parameters
    ----------
    slices
        In the order of the voxels.
    path
        Folder or file, for the sentences.

    Returns
    -------
    numpy.ndarray
        (k, j, i) float32, Hounsfield units where the slices are a CT's.

    Raises
    ------
    InputError
        A slice is damaged, compressed in a way that cannot be read, or a colour image; the sentence names its file.

    """
    rows, columns = slices[0].size
    require_room(4.0 * len(slices) * rows * columns, str(path))
    try:
        if slices[0].frame is not None:
            return _frame_pixels(slices)
        voxels = np.empty((len(slices), rows, columns), np.float32)
        for number, each in enumerate(slices):
            voxels[number] = _slice_pixels(each)
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    return voxels


def whole_file(path: Path) -> Any:
    """The dataset of a file whose pixels are all there; raises InputError otherwise."""
    try:
        whole = read_dataset(path, force=looks_like_dicom(path))
        complete_meta(whole)
        missing = "PixelData" not in whole or not whole.PixelData
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    except InputError as error:
        raise InputError(f"{path} {error}") from None
    except Exception:
        raise InputError(
            f"{path}: the DICOM header does not say how the pixels are stored, or is damaged: export the series "
            "again."
        ) from None
    if missing:
        raise InputError(f"{path}: the file holds no pixels: export the series again.")
    refuse_short(whole, str(path))
    return whole


def _slice_pixels(each: Slice) -> np.ndarray:
    """(rows, columns) of a single-frame file."""
    whole = whole_file(each.path)
    refuse_swollen(whole, str(each.path))
    if int(raw_value("SamplesPerPixel", whole) or 1) != 1:
        raise InputError(
            f"{each.path}: the slices are colour images, not a CT: choose another series by ct_series."
        )
    rescale = _rescale(whole, each.path)
    if not whole.file_meta.TransferSyntaxUID.is_encapsulated:
        pixels = _rescaled(_stored(whole, each), rescale)
    else:
        # The toolkit needs no further packages, but it would invert MONOCHROME1 and does not read all of RLE.
        is_inverted = raw_value("PhotometricInterpretation", whole) == "MONOCHROME1"
        pixels = None if is_inverted else _toolkit_pixels(each.path)
        if pixels is None:
            pixels = _rescaled(decompressed(whole, each.path), rescale)
    if pixels.shape != each.size:
        raise _unreadable(each.path)
    return _with_padding_as_air(pixels, whole, rescale)


def _stored(whole: Any, each: Slice) -> np.ndarray:
    """Stored values of uncompressed pixels, (rows, columns)."""
    bits = raw_value("BitsAllocated", whole)
    if bits not in (8, 16, 32):
        raise InputError(
            f"{each.path}: {bits} bits a pixel (Bits Allocated) are not read: export the series again."
        )
    kind = "i" if raw_value("PixelRepresentation", whole) == 1 else "u"
    order = "<" if whole.file_meta.TransferSyntaxUID.is_little_endian else ">"
    rows, columns = each.size
    stored = np.frombuffer(whole.PixelData, f"{order}{kind}{bits // 8}", rows * columns)
    return _without_overlays(stored.reshape(rows, columns), whole)


def _without_overlays(stored: np.ndarray, whole: Any) -> np.ndarray:
    """Stored values without the overlays that old files keep in their unused bits (DICOM PS3.5 8.1.2)."""
    bits = stored.dtype.itemsize * 8
    used, high = (raw_value(tag, whole) for tag in ("BitsStored", "HighBit"))
    places = [whole[group, 0x0102].value for group in range(0x6000, 0x6020, 2) if (group, 0x0102) in whole]
    if (
        not any(places)
        or not isinstance(used, int)
        or not isinstance(high, int)
        or not used - 1 <= high < bits
    ):
        return stored
    return stored << (bits - 1 - high) >> (bits - used)


def decompressed(whole: Any, path: Path) -> np.ndarray:
    """Stored values of compressed pixels, one frame or all."""
    from pydicom.uid import RLELossless

    try:
        if (
            whole.file_meta.TransferSyntaxUID == RLELossless
        ):  # of which a damaged stream panics in the plugin's Rust
            whole.pixel_array_options(decoding_plugin="pydicom")
        return whole.pixel_array
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        raise InputError(
            f"{path}: the frames cannot be decompressed: pip install pylibjpeg "
            "pylibjpeg-libjpeg pylibjpeg-openjpeg pylibjpeg-rle, or export without compression."
        ) from error


def _toolkit_pixels(path: Path) -> np.ndarray | None:
    """(rows, columns) of a compressed slice, rescaled; None where the toolkit does not read it."""
    import SimpleITK as sitk

    try:
        pixels = sitk.GetArrayFromImage(sitk.ReadImage(str(path), imageIO="GDCMImageIO"))
    except (RuntimeError, MemoryError) as error:
        if is_out_of_memory(error):
            raise memory_ran_out(str(path)) from error
        return None
    return pixels[0].astype(np.float32) if pixels.ndim == 3 else pixels.astype(np.float32)


def _unreadable(path: Path) -> InputError:
    """The error about pixels that do not fit their header."""
    return InputError(
        f"{path}: the pixels cannot be read (damaged or unknown compression): copy or export the series again."
    )


def _rescale(source: Any, path: Path) -> tuple[float, float]:
    """Slope and intercept of a dataset or functional group, 1 and 0 where it has none."""
    try:
        slope, intercept = (
            absent if (value := raw_value(tag, source)) is None else float(value)
            for tag, absent in (("RescaleSlope", 1.0), ("RescaleIntercept", 0.0))
        )
    except (TypeError, ValueError):
        slope, intercept = np.nan, np.nan
    if not (np.isfinite([slope, intercept]).all() and slope != 0):
        raise InputError(f"{path}: the rescale slope or intercept cannot be read: export the series again.")
    return slope, intercept


def _rescaled(stored: np.ndarray, rescale: tuple[float, float]) -> np.ndarray:
    """Stored values as float32 after slope and intercept."""
    return (stored * rescale[0] + rescale[1]).astype(np.float32)


def _with_padding_as_air(pixels: np.ndarray, whole: Any, rescale: tuple[float, float]) -> np.ndarray:
    """Rescaled pixels (rows, columns) with Pixel Padding Value (0028,0120), or its range, set to air."""
    stored = [
        _in_range(raw_value(tag, whole), whole) for tag in ("PixelPaddingValue", "PixelPaddingRangeLimit")
    ]
    if stored[0] is None:
        return pixels
    ends = sorted(rescale[0] * each + rescale[1] for each in stored if each is not None)
    margin = abs(rescale[0]) / 2
    padding = (pixels >= ends[0] - margin) & (pixels <= ends[-1] + margin)
    if ends[-1] > _TISSUE_HU[0] and ends[0] < _TISSUE_HU[1]:
        padding = _at_edge(padding)
    pixels[padding] = AIR_HU
    return pixels


def _in_range(value: Any, whole: Any) -> int | None:
    """A padding value as the pixels have it: some writers give negative numbers without their sign, or the reverse."""
    bits = raw_value("BitsAllocated", whole)
    if isinstance(value, bytes) and len(value) == 2:  # implicit representation does not say which kind it is
        value = int.from_bytes(value, "little")
    if not isinstance(value, int) or not isinstance(bits, int):
        return None
    if raw_value("PixelRepresentation", whole) == 1:
        return value - (1 << bits) if value >= 1 << (bits - 1) else value
    return value + (1 << bits) if value < 0 else value


def _at_edge(region: np.ndarray) -> np.ndarray:
    """The parts of a region (rows, columns) that touch the slice's edge."""
    parts = np.zeros(region.shape, np.int32)
    ndimage.label(region, output=parts)
    touching = np.zeros(int(parts.max()) + 1, bool)
    for side in (parts[0], parts[-1], parts[:, 0], parts[:, -1]):
        touching[side] = True
    touching[0] = False
    return touching[parts]


def _frame_pixels(slices: Sequence[Slice]) -> np.ndarray:
    """Voxels of a multi-frame file in the order of its slices."""
    import pydicom

    path = slices[0].path
    whole = whole_file(path)
    refuse_swollen(whole, str(path))
    frames = decompressed(whole, path)
    keyword = "PixelValueTransformationSequence"
    groups = whole.PerFrameFunctionalGroupsSequence
    shared = (whole.get("SharedFunctionalGroupsSequence") or [pydicom.Dataset()])[0]
    if frames.ndim != 3 or frames.shape[1:] != slices[0].size or len(frames) != len(slices):
        raise _unreadable(path)
    voxels = np.empty(frames.shape, np.float32)
    for number, each in enumerate(slices):
        group = raw_value(keyword, groups[each.frame]) or raw_value(keyword, shared)
        rescale = _rescale(group[0] if group else whole, path)
        voxels[number] = _with_padding_as_air(_rescaled(frames[each.frame], rescale), whole, rescale)
    return voxels
