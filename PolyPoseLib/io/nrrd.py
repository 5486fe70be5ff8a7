"""What a NRRD header says about units and patient axes, beyond what the toolkit reads.

The toolkit takes every length for millimetres, and knows three patient frames (RAS, LAS, LPS), which are all that the
format defines; some programs write others in the same words.  A header without a frame is read as LPS.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.detached_data import MAX_HEADER_BYTES

if TYPE_CHECKING:
    import SimpleITK as sitk

NRRD_ENDINGS = (".nrrd", ".nhdr")

_UNITS_MM = {
    "": 1.0, "???": 1.0, "none": 1.0, "mm": 1.0, "millimeter": 1.0, "millimetre": 1.0,
    "cm": 10.0, "centimeter": 10.0, "centimetre": 10.0, "m": 1e3, "meter": 1e3, "metre": 1e3,
    "um": 1e-3, "\u00b5m": 1e-3, "\u03bcm": 1e-3, "micron": 1e-3, "micrometer": 1e-3, "micrometre": 1e-3,
}  # fmt: skip
"""Millimetres of a unit by its name, in lower case and without the s of a plural."""

_AXES = {
    "l": (0, 1.0), "r": (0, -1.0), "p": (1, 1.0), "a": (1, -1.0), "s": (2, 1.0), "i": (2, -1.0),
}  # fmt: skip
"""Number and sign of the LPS axis that each letter means."""

_WORDS = ("left", "right", "posterior", "anterior", "superior", "inferior")
_OF_THE_TOOLKIT = ("ras", "las", "lps")
_WITHOUT_PATIENT = ("", "scanner-xyz", "3d-right-handed", "3d-left-handed")

_END = re.compile(rb"\n\r?\n")
_SPACE_LINE = re.compile(rb"^space:[^\r\n]*", re.MULTILINE | re.IGNORECASE)
_QUOTED = re.compile(r'"((?:[^"\\]|\\.)*)"')


@dataclass(frozen=True)
class NrrdFrame:
    """How a file's coordinates become LPS millimetres.

    Attributes
    ----------
    to_lps
        (3, 3) of -1, 0 and 1 when the toolkit does not know the frame, else None.
    millimetres
        Of the file's unit.
    is_stated
        Whether the header names a patient frame.

    """

    to_lps: np.ndarray | None
    millimetres: float
    is_stated: bool


def read_frame(path: Path) -> NrrdFrame:
    """The frame of a NRRD file's coordinates.

    Parameters
    ----------
    path
        The file or its detached header.

    Raises
    ------
    InputError
        Its unit is no length, or differs between the axes; the sentence names the file.

    """
    with path.open("rb") as stream:
        head = stream.read(MAX_HEADER_BYTES)
    end = _END.search(head)
    fields: dict[str, str] = {}
    for line in re.split(r"[\r\n]+", (head[: end.start()] if end else head).decode("utf-8", "replace")):
        name, colon, value = line.partition(":")
        if colon and not line.startswith("#") and not value.startswith("="):
            fields.setdefault(name.strip().lower(), value.strip())
    space = fields.get("space", "").lower().removesuffix("-time")
    letters = _letters(space)
    known = space in _WITHOUT_PATIENT or letters is None or letters in _OF_THE_TOOLKIT
    return NrrdFrame(
        to_lps=None if known or letters is None else _to_lps(letters),
        millimetres=_millimetres(fields, path),
        is_stated=letters is not None,
    )


def states_patient_axes(path: Path) -> bool:
    """Whether a file says how its axes lie in the patient; False only for NRRD files that do not."""
    return not (path.name.lower().endswith(NRRD_ENDINGS) and path.is_file()) or read_frame(path).is_stated


def in_lps_millimetres(image: sitk.Image, frame: NrrdFrame) -> sitk.Image:
    """The image, as the toolkit has read it, in LPS mm; changed in place."""
    count = min(image.GetDimension(), 3)
    origin, spacing = np.array(image.GetOrigin()), np.array(image.GetSpacing())
    direction = np.array(image.GetDirection()).reshape(image.GetDimension(), -1)
    origin[:count] *= frame.millimetres
    spacing[:count] *= frame.millimetres
    if frame.to_lps is not None and count == 3:
        origin[:3] = frame.to_lps @ origin[:3]
        direction[:3, :3] = frame.to_lps @ direction[:3, :3]
    image.SetOrigin(origin.tolist())
    image.SetSpacing(spacing.tolist())
    image.SetDirection(direction.ravel().tolist())
    return image


@contextmanager
def readable_copy(path: Path) -> Iterator[Path]:
    """A temporary copy of a file whose frame the toolkit does not know, under the name of LPS.

    Parameters
    ----------
    path
        With its voxels behind the header.

    Raises
    ------
    InputError
        The header has no end, or the copy cannot be written.

    """
    with (
        TemporaryDirectory(prefix="polypose-", ignore_cleanup_errors=True) as folder,
        path.open("rb") as stream,
    ):
        head = stream.read(MAX_HEADER_BYTES)
        end = _END.search(head)
        if end is None:
            raise InputError(f"{path}: the end of its header is not found; save the image again in LPS.")
        copy = Path(folder) / "copy.nrrd"
        stream.seek(end.end())
        try:
            with copy.open("wb") as target:
                target.write(_SPACE_LINE.sub(b"space: left-posterior-superior", head[: end.end()], count=1))
                shutil.copyfileobj(stream, target, 1 << 22)
        except OSError as error:
            raise InputError(
                f"{path}: its axes need a temporary copy, which cannot be written ({error.strerror}); save the image "
                "again in LPS."
            ) from error
        yield copy


def _letters(space: str) -> str | None:
    """The three letters of a patient frame in words or letters, in lower case; None when it is none."""
    words = space.split("-")
    letters = "".join(word[0] for word in words) if all(word in _WORDS for word in words) else space
    is_frame = len(letters) == 3 and set(letters) <= set(_AXES)
    return letters if is_frame and len({_AXES[letter][0] for letter in letters}) == 3 else None


def _to_lps(letters: str) -> np.ndarray:
    """(3, 3) from coordinates along these letters to LPS."""
    matrix = np.zeros((3, 3))
    for column, letter in enumerate(letters):
        row, sign = _AXES[letter]
        matrix[row, column] = sign
    return matrix


def _millimetres(fields: dict[str, str], path: Path) -> float:
    """Millimetres of the unit of lengths; units of axes that are no lengths, such as seconds, do not count."""
    if "space units" in fields:
        names = [_singular(each) for each in _QUOTED.findall(fields["space units"])]
        if not all(name in _UNITS_MM for name in names):
            raise InputError(
                f'{path}: its "space units" are no lengths that are known: save it again in millimetres.'
            )
    else:
        names = [_singular(each) for each in _QUOTED.findall(fields.get("units", ""))]
    lengths = {_UNITS_MM[name] for name in names if name in _UNITS_MM and _UNITS_MM[name] != 1} | (
        {1.0} if "mm" in names else set()
    )
    if len(lengths) > 1:
        raise InputError(f"{path}: its axes have different units: save it again in millimetres.")
    return lengths.pop() if lengths else 1.0


def _singular(unit: str) -> str:
    """A unit's name in lower case and singular."""
    name = unit.strip().lower()
    return name.removesuffix("s") if len(name) > 4 else name
