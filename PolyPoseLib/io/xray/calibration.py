"""Calibrated cameras from files: 3x4 projection matrices, MayaCam 2.0 texts, and intrinsics with distortion.

A calibration's extrinsic maps the calibration's own world to the camera. That world is the CT's only if somebody
registered the two; otherwise the intrinsics and the relative pose of two cameras are what a calibration gives
(:mod:`PolyPoseLib.registration.cameras.rig`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import require_intrinsics
from PolyPoseLib.geometry.distortion import require_distortion, with_positive_axes
from PolyPoseLib.geometry.negative_focal import has_negative_focal, positive_camera, require_signed_intrinsics
from PolyPoseLib.geometry.projection_matrix import decompose_projection, rows_downward
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import Record, array, number_in, numbers, one_of, parse_json

JSON_FIELDS = (
    "projection", "intrinsics", "distortion", "rotation", "translation", "image_size", "rows", "unit_mm", "comment",
)  # fmt: skip
"""Fields that a calibration's JSON object may have."""

MAX_BYTES = 1 << 20
"""Larger files are not read."""

UNIT_RANGE_MM = (1e-6, 1e6)
"""Millimetres in one unit of the translation."""

MAX_SIDE_PX = 1 << 16
"""Rows or columns that no detector has."""

_BLOCKS = ("image size", "camera matrix", "rotation", "translation")
"""Headings of a MayaCam 2.0 text."""

_HEADINGS = {name.replace(" ", ""): name for name in _BLOCKS}
"""The same by their letters alone."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """One camera as calibrated.

    Attributes
    ----------
    intrinsics
        K (3, 3) px, pixel centres at whole numbers, rows downward.
    extrinsic
        (4, 4) calibration's world (mm) to camera, or None when the file holds intrinsics only.
    distortion
        k1, k2, p1, p2[, k3] (Brown's model), or empty.
    image_size
        (rows, columns), or None.
    mirrored
        Whether the image is the mirror image of the extrinsic's view from the source, as negative focal lengths say;
        None where they are positive.

    """

    intrinsics: np.ndarray
    extrinsic: np.ndarray | None
    distortion: tuple[float, ...] = ()
    image_size: tuple[int, int] | None = None
    mirrored: bool | None = None


def read_calibration(path: str | Path) -> Calibration:
    """Read a calibrated camera.

    Parameters
    ----------
    path
        .csv (three rows of four numbers: a projection matrix), .json (an object with some of `JSON_FIELDS`: either
        "projection" or "intrinsics", "rows": "up" where rows count from the image's bottom, "unit_mm" of the
        translation), or a MayaCam 2.0 text (image size, camera matrix, rotation, translation).

    Raises
    ------
    InputError
        The file cannot be read or breaks a rule; the sentence names it and the fix.

    """
    path = Path(path)
    text = read_text(path, "the .csv, .json or MayaCam 2.0 text of one camera", MAX_BYTES)
    is_json = path.suffix.lower() == ".json"
    value = parse_json(text, str(path), allow_nan=True) if is_json else None
    try:
        if is_json:
            return _from_json(value)
        if re.search(r"camera\s*matrix", text, re.IGNORECASE):
            return _from_mayacam(text)
        intrinsics, extrinsic = decompose_projection(_table(text, 3, 4, "the projection matrix"))
        return Calibration(intrinsics, extrinsic)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _table(text: str, rows: int, columns: int, what: str) -> np.ndarray:
    """Numbers separated by commas, semicolons or blanks; raises InputError."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    try:
        table = [[float(cell) for cell in re.split(r"[,;\s]+", line.strip().strip(",;"))] for line in lines]
    except ValueError:
        raise InputError(
            f"{what} holds something that is no number; give {rows} rows of {columns} numbers."
        ) from None
    if len(table) == columns and rows == 1 and all(len(line) == 1 for line in table):
        table = [[line[0] for line in table]]
    if len(table) != rows or any(len(line) != columns for line in table):
        raise InputError(f"{what} must have {rows} rows of {columns} numbers.")
    return np.array(table)


def _from_mayacam(text: str) -> Calibration:
    """MayaCam 2.0 (XMALab): blocks under headings, axes as in OpenCV, rows downward."""
    blocks: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in text.splitlines():
        heading = _HEADINGS.get("".join(line.lower().split()).removesuffix(":"))
        if heading is None:
            lines.append(line)
        else:
            lines = blocks[heading] = []
    missing = [name for name in _BLOCKS[1:] if name not in blocks]
    if missing:
        raise InputError(
            f'a "camera matrix" begins a MayaCam 2.0 text, which lacks the block "{missing[0]}"; export the camera '
            "again, or give the 3x4 projection matrix alone."
        )
    intrinsics = require_intrinsics(
        _table("\n".join(blocks["camera matrix"]), 3, 3, '"camera matrix"'), '"camera matrix"'
    )
    extrinsic = _pose(
        _table("\n".join(blocks["rotation"]), 3, 3, '"rotation"'),
        _table("\n".join(blocks["translation"]), 1, 3, '"translation"')[0],
    )
    size = None
    if "image size" in blocks:
        size = _image_size(
            _table("\n".join(blocks["image size"]), 1, 2, '"image size"')[0, ::-1], '"image size"'
        )
    return Calibration(intrinsics, extrinsic, (), size)


def _from_json(value: Any) -> Calibration:
    """An object with some of JSON_FIELDS, or a projection matrix by itself."""
    if isinstance(value, list):
        value = {"projection": value}
    if not isinstance(value, dict):
        raise InputError("the JSON must hold one object, or three rows of four numbers.")
    record = Record(value)
    record.require_known(JSON_FIELDS)
    size = record.optional("image_size", _image_size)
    unit = record.optional(
        "unit_mm", number_in(UNIT_RANGE_MM, "the millimetres in one unit of the translation")
    )
    read_camera = _projection if "projection" in value else _separate
    intrinsics, extrinsic = read_camera(record, _upward_height(record, size), 1.0 if unit is None else unit)
    distortion = record.optional("distortion", require_distortion) or ()
    if not has_negative_focal(intrinsics):
        return Calibration(intrinsics, extrinsic, distortion, size)
    distortion = with_positive_axes(distortion, intrinsics)
    intrinsics, extrinsic, mirrored = positive_camera(intrinsics, extrinsic)
    return Calibration(intrinsics, extrinsic, distortion, size, mirrored)


def _upward_height(record: Record, size: tuple[int, int] | None) -> int | None:
    """Rows of an image whose rows count from its bottom, None where they count from its top; raises InputError."""
    if record.optional("rows", one_of(("up", "down"))) != "up":
        return None
    if size is None:
        raise InputError(
            '"rows" is "up", which needs the image\'s height; add "image_size": [rows, columns].'
        )
    return size[0]


def _projection(record: Record, upward_height: int | None, unit: float) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsics and extrinsic by the field "projection"."""
    matrix = record.required("projection", array(3, 4))
    if upward_height is not None:
        matrix = rows_downward(matrix, upward_height)
    intrinsics, extrinsic = decompose_projection(matrix)
    extrinsic[:3, 3] *= unit
    return intrinsics, require_rigid(extrinsic, 'its pose in millimetres, by "unit_mm",')


def _separate(record: Record, upward_height: int | None, unit: float) -> tuple[np.ndarray, np.ndarray | None]:
    """Intrinsics, with the signs they have, and, where there is one, extrinsic by fields of their own."""
    if "intrinsics" not in record.fields:
        raise InputError('give "projection" (3x4) or "intrinsics" (3x3).')
    if upward_height is not None:
        raise InputError('"rows": "up" goes with "projection" only; give "intrinsics" for rows downward.')
    intrinsics = record.required("intrinsics", require_signed_intrinsics)
    if "rotation" not in record.fields and "translation" not in record.fields:
        return intrinsics, None
    rotation, translation = record.required("rotation", array(3, 3)), record.required("translation", array(3))
    return intrinsics, _pose(rotation, unit * translation)


def _image_size(value: Any, place: str) -> tuple[int, int]:
    """(rows, columns) of an image, whole numbers above 0; raises InputError."""
    rows, columns = numbers(2, "the image's sides in pixels")(value, place)
    if not all(1 <= part <= MAX_SIDE_PX and part == int(part) for part in (rows, columns)):
        raise InputError(f"{place} must be two whole numbers of pixels, from 1 to {MAX_SIDE_PX}.")
    return int(rows), int(columns)


def _pose(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """Extrinsic (4, 4); raises InputError when the rotation (3, 3) is none."""
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, translation
    return require_rigid(extrinsic, '"rotation"')
