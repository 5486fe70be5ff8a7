"""A look at a NIfTI file's bytes before the toolkit reads it.

The toolkit turns NaN into 0 (water in a CT) and fills a file that was cut short with zeros, both without a word.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np

from PolyPoseLib.errors import InputError

_BLOCK_BYTES = 1 << 22
_FLOATS = {16: "f4", 64: "f8"}


def check_nifti(path: Path) -> None:
    """Refuse a .nii or .nii.gz that is cut short, damaged, or holds NaN or infinity; raises InputError."""
    opened = gzip.open if path.name.lower().endswith(".gz") else open
    try:
        with opened(path, "rb") as stream:
            wrong = _count_not_finite(stream)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        raise InputError(f"{path}: the file is damaged or cut short: copy or export it again.") from error
    if wrong:
        raise InputError(
            f"{path}: {wrong} voxels are NaN or infinite: replace them by -1000 (air) or 0 (no label) and save again."
        )


def _count_not_finite(stream: BinaryIO) -> int:
    """Voxels that are no numbers; raises ValueError when the file is no NIfTI, or shorter than its header says."""
    start = stream.read(544)
    order = next((o for o in "<>" if np.frombuffer(start[:4], o + "i4")[0] in (348, 540)), None)
    if order is None:
        raise ValueError("no NIfTI header")
    if np.frombuffer(start[:4], order + "i4")[0] == 348:
        dimensions = np.frombuffer(start, order + "i2", 8, 40).astype(float)
        kind, bits = np.frombuffer(start, order + "i2", 2, 70)
        offset = float(np.frombuffer(start, order + "f4", 1, 108)[0])
    else:
        dimensions = np.frombuffer(start, order + "i8", 8, 16).astype(float)
        kind, bits = np.frombuffer(start, order + "i2", 2, 12)
        offset = float(np.frombuffer(start, order + "i8", 1, 168)[0])
    voxels = np.prod(np.maximum(dimensions[1 : int(dimensions[0]) + 1], 1))
    stream.seek(int(offset))
    dtype = _FLOATS.get(int(kind))
    left, wrong = voxels * int(bits) / 8, 0
    while left > 0:
        block = stream.read(int(min(left, _BLOCK_BYTES)))
        if not block:
            raise ValueError("cut short")
        left -= len(block)
        if dtype:
            values = np.frombuffer(block[: len(block) // 8 * 8], order + dtype)
            wrong += values.size - int(np.count_nonzero(np.isfinite(values)))
    stream.read(_BLOCK_BYTES)
    return wrong
