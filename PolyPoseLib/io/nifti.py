"""Checks of the bytes of a NIfTI or Analyze image, in one file or in two, before the toolkit reads it.

The toolkit turns NaN into 0 (water in a CT), fills a file that was cut short with zeros, and takes a spacing of 0 for
1 mm, all without a warning.
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from io import BufferedIOBase
from pathlib import Path

import numpy as np

from PolyPoseLib.data.shear import SHEAR_TOLERANCE_MM, sideways_drift
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.inflation import MAX_SKIPPED_BYTES

NIFTI_ENDINGS = (".nii", ".nii.gz", ".hdr", ".img", ".img.gz")
"""Endings of NIfTI and Analyze images, in one file or in two."""

HEADERS = (".hdr", ".hdr.gz")
"""Endings of the file of a pair that holds the header."""

VOXELS = (".img", ".img.gz")
"""Endings of the file of a pair that holds the voxels."""

_BLOCK_BYTES = 1 << 22
"""Bytes that are read at a time."""

_FLOATS = {16: "f4", 64: "f8"}
"""Datatypes that can hold NaN and infinity."""

_BYTES = {2: 1, 4: 2, 8: 4, 16: 4, 32: 8, 64: 8, 128: 3, 256: 1, 512: 2, 768: 4, 1024: 8, 1280: 8, 2304: 4}
"""Bytes of one voxel by datatype; the toolkit goes by it and not by bitpix, which may say anything."""

_DAMAGE = (OSError, EOFError, zlib.error, ValueError, OverflowError, IndexError)
"""What reading and decoding a damaged file raises."""

_PATIENT_SPACE = (1, 2)
"""Codes of forms that lead to the scanner's millimetres or another scan's; the others lead to templates, which may
well be sheared, and an image with such an sform is placed by its qform."""

_SPACING_TOLERANCE = 1e-3
"""Share of a spacing that rounding may make."""

_UNKNOWN_UNIT, _MILLIMETRE = 0, 2
_UNITS = {1: "metres", 3: "micrometres"}


def check_nifti(path: Path) -> None:
    """Refuse a NIfTI or Analyze file, or pair, that is cut short, damaged, or holds NaN or infinity.

    Parameters
    ----------
    path
        Of the one file, or of either half.

    Raises
    ------
    InputError
        The sentence names the file at fault.

    """
    voxel_file = _files(path)[1]
    header = read_header(path)
    try:
        with _opened(voxel_file) as stream:
            wrong = _count_not_finite(stream, header)
    except _DAMAGE as error:
        raise _damaged(voxel_file) from error
    if wrong:
        raise InputError(
            f"{path}: {wrong} voxels are NaN or infinite: replace them by -1000 (air) or 0 (no label) and save again."
        )


def check_nifti_grid(path: Path) -> None:
    """Refuse a grid that the toolkit would read otherwise than it is written.

    That is a spacing of 0 or NaN, for which it takes 1 mm, a unit that is not the millimetre, and an sform of other
    lengths than the spacing, of which it uses a part at most.

    Parameters
    ----------
    path
        Of the one file, or of either half, that has passed `check_nifti`.

    Raises
    ------
    InputError
        The sentence names the file and the fix.

    """
    header = read_header(path)
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
    _check_sform(header, path)
    if header.unit not in (_UNKNOWN_UNIT, _MILLIMETRE):
        unit = _UNITS.get(header.unit, "an unknown unit")
        raise InputError(f"{path}: its lengths are in {unit} (xyzt_units): save it again in millimetres.")


def _check_sform(header: Header, path: Path) -> None:
    """Refuse an sform in the patient's space whose axes are of other lengths than the spacing; raises InputError.

    The toolkit puts the qform or pixdim in its place without a warning.  After gantry tilt some programs give the
    distance of the slices' planes as spacing.
    """
    if header.axes is None or len(header.sizes) < 3:
        return
    spacing, steps = np.abs(header.spacing[:3]), np.linalg.norm(header.axes, axis=0)
    agree = _are_close(steps, spacing)
    if _is_sheared(header):
        agree |= _are_close(1 / np.linalg.norm(np.linalg.inv(header.axes), axis=1), spacing)
    if not agree.all():
        stated, stepped = (" x ".join(f"{each:.4g}" for each in sizes) for sizes in (spacing, steps))
        raise InputError(
            f"{path}: its voxels measure {stated} mm by its pixdim but {stepped} mm by its sform: save it again with "
            "one spacing."
        )


def _are_close(steps: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Whether lengths in mm differ by rounding alone, for each."""
    return np.abs(steps - spacing) <= _SPACING_TOLERANCE * spacing


def _is_sheared(header: Header) -> bool:
    """Whether the axes of an sform in the patient's space are not perpendicular."""
    if header.axes is None or len(header.sizes) < 3 or not np.isfinite(header.pose).all():
        return False
    if abs(np.linalg.det(header.axes)) < 1e-12:
        return False
    return sideways_drift(header.axes, header.sizes[:3])[0] > SHEAR_TOLERANCE_MM


def sheared_pose(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """Where a file's sheared sform puts its voxels, which the toolkit does not read; None for any other file.

    Parameters
    ----------
    path
        Of the one file, or of either half.

    Returns
    -------
    axes
        (3, 3), in its columns the steps along (i, j, k), LPS mm.
    origin
        (3,) of the first voxel, LPS mm.

    """
    header = read_header(path)
    if not _is_sheared(header):
        return None
    flip = np.array([-1.0, -1.0, 1.0])  # NIfTI counts to the right and to the front
    return header.axes * flip[:, None], header.pose[-12:].reshape(3, 4)[:, 3].astype(float) * flip


def _files(path: Path) -> tuple[Path, Path]:
    """The files that hold the header and the voxels; raises InputError unless there is exactly one of each."""
    pair = pair_of(path)
    if not pair:
        return path, path
    halves = []
    for endings, what in ((HEADERS, "header"), (VOXELS, "voxels")):
        found = [file for file in pair if file.name.lower().endswith(endings)]
        if len(found) != 1:
            names = ", ".join(file.name for file in found) or f"no {endings[0]}"
            raise InputError(
                f"{path}: of its pair of files, one must be the {what}, but there is {names}: keep one header (.hdr) "
                "and one file of voxels (.img) of this name."
            )
        halves += found
    return halves[0], halves[1]


def _opened(path: Path) -> BufferedIOBase:
    """The file's bytes, decompressed where its name says so."""
    return (gzip.open if path.name.lower().endswith(".gz") else open)(path, "rb")


def _damaged(path: Path) -> InputError:
    """The error about a file whose bytes do not fit together."""
    return InputError(f"{path}: the file is damaged or cut short: copy or export it again.")


@dataclass(frozen=True)
class Header:
    """What a NIfTI header says, or one of Analyze 7.5, which has the same fields but for unit and pose.

    Attributes
    ----------
    order
        "<" or ">".
    sizes
        Voxels along each axis.
    spacing
        (7,) of the axes, in the file's unit.
    unit
        Code of the lengths' unit.
    kind
        Datatype.
    offset
        Bytes before the voxels.
    pose
        Numbers of the qform and sform that are in force.
    axes
        (3, 3), in its columns the steps along each axis by an sform in the patient's space, or None.

    """

    order: str
    sizes: np.ndarray
    spacing: np.ndarray
    unit: int
    kind: int
    offset: float
    pose: np.ndarray
    axes: np.ndarray | None


def read_header(path: Path) -> Header:
    """The NIfTI-1 or Analyze 7.5 header of a file or pair.

    Parameters
    ----------
    path
        Of the one file, or of either half.

    Raises
    ------
    InputError
        It is none, or in the wrong kind of file.

    """
    path = _files(path)[0]
    try:
        with _opened(path) as stream:
            return _header(stream.read(352), path.name.lower().endswith(HEADERS))
    except _DAMAGE as error:
        raise _damaged(path) from error


def _header(start: bytes, is_half: bool) -> Header:
    """The header in a file's first bytes; raises ValueError when it is none.

    is_half: whether the voxels are in a file of their own, which the header of a NIfTI must say as well.
    """
    order = next((o for o in "<>" if np.frombuffer(start[:4], o + "i4")[0] == 348), None)
    magic = start[344:347]
    if order is None or magic == (b"n+1" if is_half else b"ni1"):
        raise ValueError("no NIfTI header with its voxels where it says")
    sizes = np.frombuffer(start, order + "i2", 8, 40).astype(float)
    is_nifti = magic in (b"n+1", b"ni1")  # where an Analyze file has other fields, NIfTI has unit and pose
    codes = np.frombuffer(start, order + "i2", 2, 252) * is_nifti
    qform, sform = codes > 0
    numbers = np.frombuffer(start, order + "f4", 18, 256)
    return Header(
        order=order,
        sizes=sizes[1 : int(sizes[0]) + 1],
        spacing=np.frombuffer(start, order + "f4", 7, 80),
        unit=start[123] & 7 if is_nifti else _UNKNOWN_UNIT,
        kind=int(np.frombuffer(start, order + "i2", 1, 70)[0]),
        offset=float(np.frombuffer(start, order + "f4", 1, 108)[0]),
        pose=numbers[np.repeat([qform, sform], [6, 12])],
        axes=numbers[6:].reshape(3, 4)[:, :3].astype(float) if codes[1] in _PATIENT_SPACE else None,
    )


def _count_not_finite(stream: BufferedIOBase, header: Header) -> int:
    """Voxels that are no numbers; raises ValueError when the file is shorter than its header says."""
    if header.kind not in _BYTES:
        raise ValueError("no datatype that is read")
    left, wrong = np.prod(np.maximum(header.sizes, 1)) * _BYTES[header.kind], 0
    if not 0 <= header.offset <= MAX_SKIPPED_BYTES:
        raise ValueError("no offset")
    stream.seek(int(header.offset))
    dtype = _FLOATS.get(header.kind)
    while left > 0:
        block = stream.read(int(min(left, _BLOCK_BYTES)))
        if not block:
            raise ValueError("cut short")
        left -= len(block)
        if dtype:
            width = _BYTES[header.kind]
            values = np.frombuffer(block[: len(block) // width * width], header.order + dtype)
            wrong += values.size - int(np.count_nonzero(np.isfinite(values)))
    stream.read(_BLOCK_BYTES)
    return wrong


def pair_of(path: Path) -> list[Path]:
    """Every file that may be the header or the voxels of a pair, in upper or lower case.

    Parameters
    ----------
    path
        Either half. Any other name gives an empty list.

    """
    name = path.name.lower()
    ending = next((each for each in (*HEADERS, *VOXELS) if name.endswith(each)), None)
    if ending is None:
        return []
    stem = name.removesuffix(ending)
    names = {stem + each for each in (*HEADERS, *VOXELS)}
    return sorted(file for file in path.parent.iterdir() if file.name.lower() in names)
