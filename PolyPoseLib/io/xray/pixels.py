"""Stored pixels of one DICOM frame: decompressed, cut to their bits, with the Modality LUT applied.

VOI windows and presentation LUTs belong to the display and are never applied (PS3.3 C.11.2, C.11.6).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import quiet_pydicom, raw_value, refuse_short, refuse_swollen
from PolyPoseLib.io.xray.tags import XrayTags

if TYPE_CHECKING:
    from pydicom.dataset import Dataset
    from pydicom.uid import UID

_PACKAGES = {
    "JPEG 2000": "pylibjpeg pylibjpeg-openjpeg",
    "High-Throughput JPEG 2000": "pylibjpeg pylibjpeg-openjpeg",
    "JPEG": "pylibjpeg pylibjpeg-libjpeg",
    "RLE": "pylibjpeg pylibjpeg-rle",
}
"""pip packages that decode a family of transfer syntaxes; the longest beginning of the name counts."""


def stored_pixels(tags: XrayTags, notes: Notes) -> np.ndarray:
    """Stored values of one frame (PS3.5 8.1): (H, W) int32 or float32, before the Modality LUT.

    Parameters
    ----------
    tags
        The dataset and the frame.
    notes
        Receives the transfer syntax and bits.

    Raises
    ------
    InputError
        A codec is missing, the pixel data are cut short or damaged, or the image is in colour.

    """
    dataset = tags.dataset
    with quiet_pydicom():
        syntax = dataset.file_meta.TransferSyntaxUID
        decoded = _decode(dataset, tags.frame, notes.where)
    pixels = _gray(decoded, notes.where)
    if pixels.shape != (dataset.Rows, dataset.Columns):
        raise InputError(
            f"{notes.where} says {dataset.Rows} x {dataset.Columns} pixels but holds "
            f"{' x '.join(map(str, pixels.shape))}; its header is wrong, export the image again."
        )
    if pixels.dtype.kind == "f":
        return pixels.astype(np.float32)
    stored = int(dataset.get("BitsStored") or dataset.BitsAllocated)
    if not syntax.is_encapsulated:
        pixels = _cut_to_bits(pixels, dataset, notes)
    signed = ", signed" if dataset.get("PixelRepresentation") == 1 else ""
    notes.say(f"pixels: {stored} bits stored{signed}, {syntax.name}")
    return pixels.astype(np.int32)


def _decode(dataset: Dataset, frame: int, where: str) -> np.ndarray:
    """Decode one frame, (H, W) or (H, W, samples)."""
    from pydicom.pixels.decoders.base import get_decoder

    syntax = dataset.file_meta.TransferSyntaxUID
    try:
        decoder = get_decoder(syntax)
    except NotImplementedError:
        shown = syntax.name if syntax.name != str(syntax) else "an unknown transfer syntax"
        raise InputError(
            f"{where} is stored as {shown}, which is not read; export it uncompressed."
        ) from None
    if not decoder.is_available:
        package = next((_PACKAGES[key] for key in _PACKAGES if syntax.name.startswith(key)), None)
        fix = f"pip install {package}" if package else "export it uncompressed"
        raise InputError(f"{where} is compressed as {syntax.name} and its decoder is missing: {fix}.")
    refuse_short(dataset, where)
    refuse_swollen(dataset, where)
    options = _decoder_options(syntax)
    try:
        return decoder.as_array(dataset, index=frame, **options)[0]
    except MemoryError:
        raise InputError(f"{where} does not fit in memory; export a single frame.") from None
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        raise InputError(
            f"{where} has pixel data ({syntax.name}) that cannot be decoded: they are damaged or cut short; "
            "copy the file again or export it uncompressed."
        ) from None


def _decoder_options(syntax: UID) -> dict[str, Any]:
    """Options of pydicom's decoder; RLE by pydicom's own, because a damaged stream panics in the plugin's Rust."""
    if not syntax.is_encapsulated:
        return {"correct_unused_bits": False}
    return {"decoding_plugin": "pydicom"} if syntax == "1.2.840.10008.1.2.5" else {}


def _gray(pixels: np.ndarray, where: str) -> np.ndarray:
    """One channel of an image whose channels agree, as a gray image saved in colour has."""
    if pixels.ndim == 2:
        return pixels
    colours = pixels[..., :3] if pixels.ndim == 3 and pixels.shape[-1] in (3, 4) else None
    if colours is None or np.ptp(colours.astype(np.int32), axis=-1).max() > 2:
        raise InputError(f"{where} is a colour image; export the X-ray itself, in gray.")
    return colours[..., 0]


def _cut_to_bits(pixels: np.ndarray, dataset: Dataset, notes: Notes) -> np.ndarray:
    """Keep Bits Stored bits below High Bit, with their sign; overlays may live in the others."""
    allocated = pixels.dtype.itemsize * 8
    stored = int(dataset.get("BitsStored") or allocated)
    high = dataset.get("HighBit")
    high = stored - 1 if high is None else int(high)
    if not 1 <= stored <= allocated or not stored - 1 <= high < allocated:
        notes.warn(
            f"Bits Stored {stored} and High Bit {high} do not fit {allocated} bits; all bits are used."
        )
        return pixels
    unsigned = pixels.dtype.str[0] + f"u{pixels.dtype.itemsize}"  # in the file's order of bytes
    values = pixels.view(unsigned).astype(np.int64) >> (high + 1 - stored)
    values &= (1 << stored) - 1
    if dataset.get("PixelRepresentation") == 1:
        values[values >= 1 << (stored - 1)] -= 1 << stored
    return values


def apply_modality(stored: np.ndarray, tags: XrayTags, notes: Notes) -> tuple[np.ndarray, int]:
    """Apply the Modality LUT Sequence (0028,3000) or the rescale slope and intercept (PS3.3 C.11.1).

    Parameters
    ----------
    stored
        (H, W) stored values.
    tags
        The frame's attributes.
    notes
        Receives what was applied.

    Returns
    -------
    tuple[np.ndarray, int]
        ((H, W) float32 values, 1 or -1: whether they rise or fall with the stored ones).

    Raises
    ------
    InputError
        The LUT cannot be read or makes the image constant.

    """
    sequence = raw_value("ModalityLUTSequence", tags.dataset)
    if sequence:
        values = _lookup(stored, sequence[0], notes.where)
        notes.say("Modality LUT sequence applied")
        order = np.corrcoef(stored.ravel()[::7], values.ravel()[::7])[0, 1] if np.ptp(values) else 1.0
        return values, -1 if order < 0 else 1
    slope, intercept = tags.number("RescaleSlope"), tags.number("RescaleIntercept")
    slope, intercept = 1.0 if slope is None else slope, 0.0 if intercept is None else intercept
    if slope == 0:
        notes.warn("the rescale slope (0028,1053) is 0 and was ignored.")
        slope = 1.0
    if (slope, intercept) != (1, 0):
        notes.say(f"rescale: slope {slope:g}, intercept {intercept:g}")
    return (stored * slope + intercept).astype(np.float32), 1 if slope > 0 else -1


def _lookup(stored: np.ndarray, item: Dataset, where: str) -> np.ndarray:
    """Look values up in one item of a Modality LUT Sequence (PS3.3 C.11.1.1.1)."""
    try:
        entries, first, bits = (int(part) for part in item.LUTDescriptor)
        entries = entries or 1 << 16
        first = first - (1 << 16) if first > 32767 and stored.min() < 0 else first
        data = item.LUTData
        if isinstance(data, bytes):
            wide = len(data) >= 2 * entries
            table = np.frombuffer(data, "<u2" if wide else "u1")
        else:
            table = np.asarray(data, dtype=np.int64) & ((1 << max(bits, 8)) - 1)
        if len(table) < entries:
            raise ValueError
    except (AttributeError, TypeError, ValueError):
        raise InputError(
            f"{where} has a Modality LUT (0028,3000) that cannot be read; export the image without it."
        ) from None
    return table[np.clip(stored.astype(np.int64) - first, 0, entries - 1)].astype(np.float32)
