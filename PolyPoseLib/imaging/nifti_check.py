"""A look at a NIfTI file's bytes before the toolkit reads it.

The toolkit turns NaN into 0 (water in a CT), fills a file that was cut short with zeros, and takes a spacing of 0 for
1 mm, all without a word.
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from PolyPoseLib.errors import InputError

_BLOCK_BYTES = 1 << 22
_FLOATS = {16: "f4", 64: "f8"}
_BYTES = {2: 1, 4: 2, 8: 4, 16: 4, 32: 8, 64: 8, 128: 3, 256: 1, 512: 2, 768: 4, 1024: 8, 1280: 8, 2304: 4}
"""Bytes of one voxel by datatype; the toolkit goes by it and not by bitpix, which may say anything."""

_UNKNOWN_UNIT, _MILLIMETRE = 0, 2
_UNITS = {1: "metres", 3: "micrometres"}


def check_nifti(path: Path) -> None:
    """Refuse a .nii or .nii.gz that is cut short, damaged, or holds NaN or infinity; raises InputError."""
    opened = gzip.open if path.name.lower().endswith(".gz") else open
    try:
        with opened(path, "rb") as stream:
            wrong = _count_not_finite(stream, _header(stream))
    except (OSError, EOFError, zlib.error, ValueError, OverflowError) as error:
        raise InputError(f"{path}: the file is damaged or cut short: copy or export it again.") from error
    if wrong:
        raise InputError(
            f"{path}: {wrong} voxels are NaN or infinite: replace them by -1000 (air) or 0 (no label) and save again."
        )


def check_nifti_grid(path: Path) -> None:
    """Refuse spacings that are none, which the toolkit replaces by 1 mm, and units but millimetres; raises InputError.

    The file has passed check_nifti.
    """
    opened = gzip.open if path.name.lower().endswith(".gz") else open
    with opened(path, "rb") as stream:
        header = _header(stream)
    spacing = header.spacing[: min(len(header.sizes), 3)]
    if not (np.isfinite(spacing).all() and (spacing != 0).all()):
        shown = ", ".join(f"{each:g}" for each in spacing)
        raise InputError(
            f"{path}: its voxel spacing (pixdim) is {shown}: save it again with its spacing in mm."
        )
    if not np.isfinite(header.pose).all():
        raise InputError(
            f"{path}: its qform or sform holds NaN or infinity: save it again with its place in mm."
        )
    if header.unit not in (_UNKNOWN_UNIT, _MILLIMETRE):
        unit = _UNITS.get(header.unit, "an unknown unit")
        raise InputError(f"{path}: its lengths are in {unit} (xyzt_units): save it again in millimetres.")


@dataclass(frozen=True)
class _Header:
    """What a NIfTI header says.

    order: "<" or ">"; sizes: voxels along each axis; spacing: (7,) of the axes, in the file's unit; unit: code of the
    lengths' unit; kind: datatype; offset: bytes before the voxels; pose: numbers of the qform and sform
    that are in force.
    """

    order: str
    sizes: np.ndarray
    spacing: np.ndarray
    unit: int
    kind: int
    offset: float
    pose: np.ndarray


def _header(stream: BinaryIO) -> _Header:
    """The NIfTI-1 header at the stream's start; raises ValueError when it is none, or half of a pair."""
    start = stream.read(352)
    order = next((o for o in "<>" if np.frombuffer(start[:4], o + "i4")[0] == 348), None)
    if order is None or start[344:347] == b"ni1":
        raise ValueError("no NIfTI header with the voxels behind it")
    sizes = np.frombuffer(start, order + "i2", 8, 40).astype(float)
    qform, sform = np.frombuffer(start, order + "i2", 2, 252) > 0
    numbers = np.frombuffer(start, order + "f4", 18, 256)
    return _Header(
        order=order,
        sizes=sizes[1 : int(sizes[0]) + 1],
        spacing=np.frombuffer(start, order + "f4", 7, 80),
        unit=start[123] & 7,
        kind=int(np.frombuffer(start, order + "i2", 1, 70)[0]),
        offset=float(np.frombuffer(start, order + "f4", 1, 108)[0]),
        pose=numbers[np.repeat([qform, sform], [6, 12])],
    )


def _count_not_finite(stream: BinaryIO, header: _Header) -> int:
    """Voxels that are no numbers; raises ValueError when the file is shorter than its header says."""
    if header.kind not in _BYTES:
        raise ValueError("no datatype that is read")
    left, wrong = np.prod(np.maximum(header.sizes, 1)) * _BYTES[header.kind], 0
    if not 0 <= header.offset < np.inf:
        raise ValueError("no offset")
    stream.seek(int(header.offset))
    dtype = _FLOATS.get(header.kind)
    while left > 0:
        block = stream.read(int(min(left, _BLOCK_BYTES)))
        if not block:
            raise ValueError("cut short")
        left -= len(block)
        if dtype:
            values = np.frombuffer(block[: len(block) // 8 * 8], header.order + dtype)
            wrong += values.size - int(np.count_nonzero(np.isfinite(values)))
    stream.read(_BLOCK_BYTES)
    return wrong
