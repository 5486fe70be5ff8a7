"""Calibrated cameras from files: 3x4 projection matrices, MayaCam 2.0 texts, and intrinsics with distortion.

A calibration's extrinsic maps the calibration's own world to the camera.  That world is the CT's only if somebody
registered the two; otherwise the intrinsics and the relative pose of two cameras are what a calibration gives
(:mod:`PolyPoseLib.registration.cameras.rig`).
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import rq
from scipy.ndimage import map_coordinates

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.data.xray import RigPose
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.geometry.camera import FOCAL_RANGE_PX, require_intrinsics
from PolyPoseLib.geometry.rigid import real_array, require_rigid
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.xray.fields import XrayFields

JSON_FIELDS = (
    "projection", "intrinsics", "distortion", "rotation", "translation", "image_size", "rows", "unit_mm", "comment",
)  # fmt: skip
MAX_BYTES = 1 << 20
MAX_UNIT_MM = 1e6
MAX_DISTORTION = 1e6
"""Coefficients of lenses are far below it."""

MAX_SIDE_PX = 1 << 16
"""Rows or columns that no detector has."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """One camera as calibrated.

    intrinsics: K (3, 3) px, pixel centres at whole numbers, rows downward; extrinsic: (4, 4) calibration's world (mm)
    to camera, or None when the file holds intrinsics only; distortion: k1, k2, p1, p2[, k3] or empty (Brown's model);
    image_size: (height, width) or None.
    """

    intrinsics: np.ndarray
    extrinsic: np.ndarray | None
    distortion: tuple[float, ...] = ()
    image_size: tuple[int, int] | None = None

    def relative_to(self, other: Calibration) -> np.ndarray:
        """(4, 4) from the other camera's axes to this one's; raises InputError when a pose is missing."""
        if self.extrinsic is None or other.extrinsic is None:
            raise InputError(
                "A rig needs calibrations with rotation and translation; these hold intrinsics only."
            )
        return self.extrinsic @ np.linalg.inv(other.extrinsic)


def read_calibration(path: str | Path, height: int | None = None) -> Calibration:
    """Read a calibrated camera.

    Args:
        path: .csv (three rows of four numbers: a projection matrix), .json (an object with some of JSON_FIELDS: either
            "projection" or "intrinsics", "rows": "up" where rows count from the image's bottom, "unit_mm" of the
            translation), or a MayaCam 2.0 text (image size, camera matrix, rotation, translation).
        height: rows of the image, needed to turn "rows": "up" round unless the file gives the image's size.

    Raises:
        InputError: the file cannot be read or breaks a rule; the sentence names it and the mend.

    """
    path = Path(path)
    text = _text(path)
    try:
        if path.suffix.lower() == ".json":
            return _from_json(text, height)
        if re.search(r"camera\s*matrix", text, re.IGNORECASE):
            return _from_mayacam(text)
        intrinsics, extrinsic = decompose_projection(_table(text, 3, 4, "the projection matrix"))
        return Calibration(intrinsics, extrinsic)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def decompose_projection(matrix: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsics (3, 3) and extrinsic (4, 4) of a projection matrix (3, 4), whatever its scale and sign.

    Hartley and Zisserman, "Multiple View Geometry", 2nd edition, section 6.2.4: an RQ decomposition with positive focal
    lengths.  The sign is chosen so that the rotation is proper.

    Raises:
        InputError: not a matrix of a camera at a finite place, noticeable skew, or numbers that no camera has.

    """
    matrix = np.asarray(matrix, dtype=np.float64)
    if matrix.shape != (3, 4) or not np.isfinite(matrix).all():
        raise InputError("a projection matrix has three rows of four finite numbers.")
    matrix = _of_unit_axis(matrix)
    determinant = np.linalg.det(matrix[:, :3])
    if abs(determinant) < 1e-9:
        raise InputError("its left 3x3 part is singular: this is no camera at a finite place.")
    matrix = matrix * np.sign(determinant)
    upper, rotation = rq(matrix[:, :3])
    signs = np.diag(np.where(np.diag(upper) < 0, -1.0, 1.0))
    upper, rotation = upper @ signs, signs @ rotation
    translation = np.linalg.solve(upper, matrix[:, 3])
    upper = upper / upper[2, 2]
    if abs(upper[0, 1]) > 0.01 * upper[0, 0]:
        raise InputError(
            f"its axes are skewed ({upper[0, 1]:.3g} px at a focal length of {upper[0, 0]:.4g} px): check the order of "
            "its numbers."
        )
    upper[1, 0] = upper[2, 0] = upper[2, 1] = 0.0
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, translation
    return require_intrinsics(upper), require_rigid(extrinsic, "its pose")


def _of_unit_axis(matrix: np.ndarray) -> np.ndarray:
    """A projection matrix (3, 4) scaled so that the axis in its third row has the length 1; raises InputError."""
    largest = np.abs(matrix[2, :3]).max()
    if largest == 0:
        raise InputError("its left 3x3 part is singular: this is no camera at a finite place.")
    with np.errstate(over="ignore"):  # what overflows is refused, here or as a translation
        matrix = matrix / largest
    matrix = matrix / np.linalg.norm(matrix[2, :3])
    if np.abs(matrix[:, :3]).max() > FOCAL_RANGE_PX[1]:
        raise InputError(
            f"its focal lengths are beyond {FOCAL_RANGE_PX[1]:g} px: check its unit and the order of its numbers."
        )
    return matrix


def rows_downward(matrix: np.ndarray, height: int) -> np.ndarray:
    """A projection matrix (3, 4) that counted rows from the bottom, for rows counted from the top."""
    return np.array([[1.0, 0, 0], [0, -1, height - 1], [0, 0, 1]]) @ matrix


def require_in_front(calibration: Calibration, points: np.ndarray, name: str) -> None:
    """Check that points (N, 3) of the calibration's world lie in front of the source; raises InputError."""
    if calibration.extrinsic is None:
        return
    depth = points @ calibration.extrinsic[2, :3] + calibration.extrinsic[2, 3]
    if (depth <= 0).any():
        raise InputError(
            f'{name}: the CT lies behind this camera; if the calibration counts rows from the bottom, add "rows": '
            '"up" to its JSON, else check that its world is the CT\'s (LPS, mm).'
        )


def undistorted(
    image: np.ndarray, mask: np.ndarray, intrinsics: np.ndarray, distortion: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """The image (H, W) and mask (H, W) as a camera without distortion would have seen them.

    distortion: k1, k2, p1, p2[, k3] of D. C. Brown, "Decentering distortion of lenses" (1966), in the order and sign of
    OpenCV: ideal coordinates are mapped to distorted ones, where the image is sampled linearly.

    Raises:
        InputError: another number of coefficients, or ones that fold the image over.

    """
    height, width = image.shape
    column, row = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    inverse = np.linalg.inv(intrinsics)
    ideal = np.stack([column, row, np.ones_like(row)], axis=-1) @ inverse.T
    bent = distort(ideal[..., :2], distortion)
    pixels = np.concatenate([bent, np.ones((height, width, 1))], axis=-1) @ np.asarray(intrinsics).T
    if (np.diff(pixels[..., 0], axis=1) <= 0).any() or (np.diff(pixels[..., 1], axis=0) <= 0).any():
        raise InputError(
            "the distortion folds the image over; check the order of its coefficients k1, k2, p1, p2, k3."
        )
    where = [pixels[..., 1], pixels[..., 0]]
    straight = map_coordinates(image.astype(np.float32), where, order=1, mode="nearest")
    seen = map_coordinates(mask.astype(np.float32), where, order=1, mode="constant", cval=0.0)
    return straight, seen > 0.99


def distort(points: np.ndarray, distortion: ArrayLike) -> np.ndarray:
    """Ideal image coordinates (..., 2) at depth 1 to distorted ones; raises InputError for odd coefficients."""
    coefficients = np.asarray(distortion, dtype=np.float64).ravel()
    if coefficients.size not in (4, 5) or not (np.abs(coefficients) <= MAX_DISTORTION).all():
        raise InputError(
            f'"distortion" must be four or five numbers up to {MAX_DISTORTION:g}: k1, k2, p1, p2 and perhaps k3.'
        )
    k1, k2, p1, p2, k3 = np.append(coefficients, 0.0)[:5]
    x, y = points[..., 0], points[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def _text(path: Path) -> str:
    refuse_special_file(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: is too large for a calibration; give the text file of one camera.")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text; give a .csv, .json or MayaCam 2.0 text.") from None
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); check its name and permissions."
        ) from error


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
    """MayaCam 2.0 (XMALab): blocks headed image size, camera matrix, rotation, translation; OpenCV axes, rows down."""
    heads = ("image size", "camera matrix", "rotation", "translation")
    pattern = re.compile(
        r"^\s*(" + "|".join(h.replace(" ", r"\s*") for h in heads) + r")\s*:?\s*$", re.I | re.M
    )
    marks = list(pattern.finditer(text))
    blocks = {
        re.sub(r"\s+", " ", mark[1].lower()): text[mark.end() : after.start() if after else len(text)]
        for mark, after in zip(marks, [*marks[1:], None], strict=True)
    }
    missing = [head for head in heads[1:] if head not in blocks]
    if missing:
        raise InputError(f'the MayaCam 2.0 text lacks the block "{missing[0]}"; export the camera again.')
    intrinsics = require_intrinsics(
        _table(blocks["camera matrix"], 3, 3, '"camera matrix"'), '"camera matrix"'
    )
    extrinsic = _pose(
        _table(blocks["rotation"], 3, 3, '"rotation"'),
        _table(blocks["translation"], 1, 3, '"translation"')[0],
    )
    size = None
    if "image size" in blocks:
        size = _image_size(_table(blocks["image size"], 1, 2, '"image size"')[0][::-1], '"image size"')
    return Calibration(intrinsics, extrinsic, (), size)


def _from_json(text: str, height: int | None) -> Calibration:
    try:
        fields = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"not valid JSON at line {error.lineno} ({error.msg}); correct it there.") from error
    except RecursionError:
        raise InputError(
            "the JSON is nested too deeply; give one object, or three rows of numbers."
        ) from None
    except ValueError as error:
        raise InputError("the JSON holds a number of too many digits; correct it.") from error
    if isinstance(fields, list):
        fields = {"projection": fields}
    if not isinstance(fields, Mapping):
        raise InputError("the JSON must hold one object, or three rows of four numbers.")
    for field in fields:
        if field not in JSON_FIELDS:
            raise InputError(unknown_name("field", str(field), JSON_FIELDS))
    size = fields.get("image_size")
    if size is not None:
        size = _image_size(_array(fields, "image_size", (2,)), '"image_size"')
        height = size[0]
    up = _rows_upward(fields, height)
    unit = float(_array(fields, "unit_mm", ())) if fields.get("unit_mm") is not None else 1.0
    if not 0 < unit <= MAX_UNIT_MM:
        raise InputError(
            f'"unit_mm" must be above 0 and at most {MAX_UNIT_MM:g}: the millimetres in one unit of the translation.'
        )
    if "projection" in fields:
        matrix = _array(fields, "projection", (3, 4))
        intrinsics, extrinsic = decompose_projection(rows_downward(matrix, height) if up else matrix)
        extrinsic[:3, 3] *= unit
        extrinsic = require_rigid(extrinsic, 'its pose in millimetres, by "unit_mm",')
    else:
        if "intrinsics" not in fields:
            raise InputError('give "projection" (3x4) or "intrinsics" (3x3).')
        if up:
            raise InputError('"rows": "up" goes with "projection" only; give "intrinsics" for rows downward.')
        intrinsics = require_intrinsics(_array(fields, "intrinsics", (3, 3)), '"intrinsics"')
        extrinsic = None
        if "rotation" in fields or "translation" in fields:
            rotation, translation = _array(fields, "rotation", (3, 3)), _array(fields, "translation", (3,))
            extrinsic = _pose(rotation, unit * translation)
    distortion = ()
    if fields.get("distortion") is not None:
        distortion = tuple(_array(fields, "distortion", None).ravel().tolist())
        distort(np.zeros((1, 2)), distortion)
    return Calibration(intrinsics, extrinsic, distortion, size)


def _rows_upward(fields: Mapping[str, Any], height: int | None) -> bool:
    rows = fields.get("rows", "down")
    if rows not in ("up", "down"):
        raise InputError(
            f'"rows" is {rows!r}; give "down", or "up" where rows count from the image\'s bottom.'
        )
    if rows == "up" and height is None:
        raise InputError(
            '"rows" is "up", which needs the image\'s height; add "image_size": [rows, columns].'
        )
    return rows == "up"


def _image_size(size: np.ndarray, name: str) -> tuple[int, int]:
    """(rows, columns) of an image, whole numbers above 0; raises InputError."""
    if not all(1 <= part <= MAX_SIDE_PX and part == int(part) for part in size):
        raise InputError(f"{name} must be two whole numbers of pixels, from 1 to {MAX_SIDE_PX}.")
    return int(size[0]), int(size[1])


def _array(fields: Mapping[str, Any], name: str, shape: tuple[int, ...] | None) -> np.ndarray:
    """The finite numbers of a field; shape: None for a list of any length, or a row of them. Raises InputError."""
    try:
        value = real_array(fields[name])
    except KeyError:
        raise InputError(f'"{name}" is missing; add it.') from None
    except (TypeError, ValueError):
        raise InputError(f'"{name}" is not made of numbers; correct it.') from None
    right = value.size == max(value.shape, default=0) if shape is None else value.shape == shape
    if not right or not np.isfinite(value).all():
        wanted = "a list of" if shape is None else " x ".join(map(str, shape)) or "one"
        raise InputError(f'"{name}" must be {wanted} finite numbers.')
    return value


def _pose(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, translation
    return require_rigid(extrinsic, '"rotation"')


@dataclass(frozen=True, eq=False)
class Calibrated:
    """An entry with what its calibration adds.

    fields: the entry; distortion: coefficients, or empty; rig: or None; image_size: (rows, columns) that the
    intrinsics belong to, or None when they are not the calibration's or it does not say.
    """

    fields: XrayFields
    distortion: tuple[float, ...] = ()
    rig: RigPose | None = None
    image_size: tuple[int, int] | None = None

    def require_size(self, shape: tuple[int, ...], notes: Notes) -> None:
        """Raise InputError when the X-ray's (rows, columns) are not those that the calibration was made for."""
        if self.image_size in (None, tuple(shape)):
            return
        made, found = (f"{size[0]} rows x {size[1]} columns" for size in (self.image_size, shape))
        raise InputError(
            f"{notes.where}: its calibration is for images of {made}, but it has {found}; give the image that was "
            "calibrated, uncropped and in full resolution, or another calibration."
        )


def with_calibration(given: XrayFields, folder: Path, notes: Notes) -> Calibrated:
    """Fields with the calibration's intrinsics (and extrinsic, in the CT's frame), its distortion, and the rig.

    Args:
        given: the entry; what it gives wins over the calibration.
        folder: where a relative path starts and must stay; a Path was checked by the caller.
        notes: is told what was used.

    Raises:
        InputError: the file cannot be read, or leaves the folder.

    """
    if given.calibration is None:
        return Calibrated(given, (), _rig(given, None, notes))
    path = folder / given.calibration
    if isinstance(given.calibration, str) and not path.resolve().is_relative_to(folder.resolve()):
        raise InputError(
            f'{notes.where}: the "calibration" lies outside the study\'s folder; move it into the folder.'
        )
    calibration = read_calibration(path)
    rig = _rig(given, calibration.extrinsic, notes)
    size = None
    if given.intrinsics is None:
        size = calibration.image_size
        given = replace(given, intrinsics=calibration.intrinsics)
        notes.say(f"intrinsics from the calibration {path.name}")
    if given.calibration_frame == "ct" and given.extrinsic is None:
        if calibration.extrinsic is None:
            raise InputError(
                f'{notes.where}: "calibration_frame" is "ct", but {path.name} holds no pose; remove it.'
            )
        given = replace(given, extrinsic=calibration.extrinsic)
        notes.say(f"extrinsic from the calibration {path.name}, in the CT's frame")
    if any(calibration.distortion):
        notes.say(f"distortion from the calibration {path.name}: undone")
        return Calibrated(given, calibration.distortion, rig, size)
    return Calibrated(given, (), rig, size)


def _rig(given: XrayFields, calibrated: np.ndarray | None, notes: Notes) -> RigPose | None:
    """The camera's place in its rig: as calibrated, or else as its extrinsic says."""
    if given.rig is None:
        return None
    pose = calibrated if calibrated is not None else given.extrinsic
    if pose is None:
        raise InputError(
            f'{notes.where}: it belongs to the rig "{given.rig}", but nothing tells its place in it: give a '
            '"calibration" with rotation and translation, or an "extrinsic".'
        )
    source = "its extrinsic" if calibrated is None else "its calibration"
    notes.say(f'place in the rig "{given.rig}" from {source}')
    in_ct = calibrated is None or given.calibration_frame == "ct"
    return RigPose(given.rig, pose, "ct" if in_ct else "own")
