"""Directions of an image's columns and rows in the patient, from Patient Orientation (0020,0020)."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.io.xray.tags import XrayTags

_LETTERS = {"L": (1, 0, 0), "R": (-1, 0, 0), "P": (0, 1, 0), "A": (0, -1, 0), "H": (0, 0, 1), "F": (0, 0, -1)}
"""Anatomical directions in LPS (PS3.3 C.7.6.1.1.1)."""

_LEAST_TURN = 0.3
"""Sine between the image's normal and the beam below which nothing follows about handedness."""


def stored_handedness(tags: XrayTags | None, beam: np.ndarray) -> int:
    """Whether Patient Orientation says that the stored image is a view from the source.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    beam
        (3,) unit vector from the source to the detector in the patient, LPS.

    Returns
    -------
    int
        1 for a view from the source, -1 for its mirror image, 0 when the file does not say.

    """
    axes = _stored_axes(tags)
    turn = 0.0 if axes is None else float(np.dot(np.cross(*axes), beam))
    return 0 if abs(turn) < _LEAST_TURN else int(np.sign(turn))


def contradicts(tags: XrayTags | None, beam: np.ndarray) -> bool:
    """Whether the file says how its image lies in the patient, and this beam (3,) would run along that plane."""
    return _stored_axes(tags) is not None and stored_handedness(tags, beam) == 0


def nearest_orientation(
    tags: XrayTags | None, columns: np.ndarray, rows: np.ndarray, beam: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Stored axes: of all quarter turns and mirror images of a display, the one nearest to Patient Orientation.

    Parameters
    ----------
    tags
        The frame's attributes, None for files that are not DICOM.
    columns, rows
        (3,) unit vectors along the display's columns and rows, LPS.
    beam
        (3,) unit vector from the source to the detector, LPS.

    Returns
    -------
    tuple or None
        Columns and rows (3,) of the stored image; None when the file does not say.

    """
    wanted = _stored_axes(tags)
    handedness = stored_handedness(tags, beam)
    if wanted is None or handedness == 0:
        return None
    if np.dot(np.cross(columns, rows), beam) * handedness < 0:
        columns = -columns
    turns = ((columns, rows), (rows, -columns), (-columns, -rows), (-rows, columns))
    return max(turns, key=lambda pair: pair[0] @ wanted[0] + pair[1] @ wanted[1])


def _stored_axes(tags: XrayTags | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Directions of columns and rows in the patient as the file says, or None."""
    letters = tags.texts("PatientOrientation") if tags else ()
    if len(letters) != 2:
        return None
    columns, rows = map(_direction, letters)
    return None if columns is None or rows is None else (columns, rows)


def _direction(letters: str) -> np.ndarray | None:
    """Unit vector (3,) of letters such as "L" or "LF", the first weighing most; None when not letters."""
    if not letters or any(letter not in _LETTERS for letter in letters):
        return None
    total = np.sum([np.array(_LETTERS[letter]) / 2**rank for rank, letter in enumerate(letters)], axis=0)
    length = np.linalg.norm(total)
    return total / length if length > 0 else None
