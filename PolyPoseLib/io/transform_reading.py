"""Displacement fields from ITK transform files that may be damaged or hostile: read in bounded time, or refused."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.guarded import Limits, run_child
from PolyPoseLib.io.hdf5 import Damaged, Hdf5File, UnknownLayout

CHILD_SECONDS = 5
"""Of a processor for a process that reads an unusual file, and one more for every 20 MB."""

_PATIENCE = 4
"""Seconds on the clock for one of a processor, on a machine that is busy otherwise."""

_TYPE = "DisplacementFieldTransform_double_3_3"

_CHILD = """
import numpy as np
import SimpleITK as sitk
try:
    field = sitk.DisplacementFieldTransform(sitk.ReadTransform(sys.argv[1])).GetDisplacementField()
except Exception as error:
    refuse(error)
np.savez(
    sys.argv[2],
    vectors=sitk.GetArrayFromImage(field),
    origin=field.GetOrigin(),
    spacing=field.GetSpacing(),
    direction=field.GetDirection(),
)
"""


def read_displacement_field(path: Path) -> DisplacementField:
    """Read an ITK transform file that holds one displacement field.

    Files as ITK writes them are read here. Others (compressed, of other versions) are read by the image toolkit in a
    process of its own, whose time and memory are limited.

    Raises
    ------
    InputError
        The file is damaged, holds something else, or takes too long.

    """
    try:
        with Hdf5File(path) as file:
            return _from_itk_layout(file)
    except UnknownLayout:
        return _read_in_child(path)
    except Damaged as error:
        raise _refusal(path, str(error)) from error
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}): check it.") from error


def _from_itk_layout(file: Hdf5File) -> DisplacementField:
    """The field of a file that ITK wrote without compression."""
    groups = file.links(file.links(file.root).get("TransformGroup", file.root))
    if set(groups) != {"0"}:
        raise UnknownLayout
    parts = file.links(groups["0"])
    if not {"TransformType", "TransformFixedParameters", "TransformParameters"} <= set(parts):
        raise UnknownLayout
    kind = file.text(parts["TransformType"])
    if kind != _TYPE:
        raise Damaged(f"it is a {kind[:60]}")
    fixed = file.doubles(parts["TransformFixedParameters"])
    if fixed.shape != (18,):
        raise Damaged("its grid is not described by 18 numbers")
    values = file.doubles(parts["TransformParameters"])
    size = fixed[:3]
    if not ((size >= 1) & (size == np.rint(size)) & (size < 1 << 20)).all() or values.size != 3 * size.prod():
        raise Damaged("its grid contradicts the number of its vectors")
    width, height, depth = (int(n) for n in size)
    vectors = values.reshape(depth, height, width, 3)
    return _field(vectors, fixed[3:6], fixed[6:9], fixed[9:])


def _field(
    vectors: np.ndarray, origin: np.ndarray, spacing: np.ndarray, direction: np.ndarray
) -> DisplacementField:
    """The field of vectors (k, j, i, 3) on a grid as ITK describes it."""
    affine = np.eye(4)
    affine[:3, :3] = direction.reshape(3, 3) @ np.diag(spacing)
    affine[:3, 3] = origin
    return DisplacementField(vectors.astype(np.float32), affine)


def _read_in_child(path: Path) -> DisplacementField:
    """Let the image toolkit read a file in a process of its own."""
    size = path.stat().st_size
    seconds = CHILD_SECONDS + size // 20_000_000
    limits = Limits(seconds, _PATIENCE * seconds, (4 << 30) + 8 * size)
    with tempfile.TemporaryDirectory(prefix="polypose-") as folder:
        kept = Path(folder) / "field.npz"
        done = run_child(_CHILD, [path.resolve(), kept], limits, folder)
        if done is None:
            raise _refusal(path, "reading it takes too long")
        if done.returncode != 0 or not kept.is_file():
            reason = " ".join(done.stdout.decode("utf-8", "replace").split())[:200]
            raise _refusal(path, reason or "reading it ended the process")
        with np.load(kept, allow_pickle=False) as parts:
            return _field(parts["vectors"], parts["origin"], parts["spacing"], parts["direction"])


def _refusal(path: Path, reason: str) -> InputError:
    return InputError(
        f"{path}: does not hold a displacement field ({reason}); give a transform.h5 written by PolyPose."
    )
