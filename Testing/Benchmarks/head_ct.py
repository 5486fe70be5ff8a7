"""The head CT of a Debian package of examples, read from InVesalius' project file."""

from __future__ import annotations

import gzip
import io
import plistlib
import tarfile
import zlib
from pathlib import Path
from typing import Any, cast

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

WHERE = (
    "the benchmark uses the head CT Cranium.inv3 of Debian's package invesalius-examples: "
    "unpack the package and give its folder, or that file"
)

ENDING = ".inv3"
MOST_VOXELS = 1 << 27
MOST_BYTES = 1 << 29
"""Of all files in a project, decompressed."""

_SETTINGS, _SETTINGS_BYTES = "main.plist", 1 << 20


def read_head(path: Path) -> Volume:
    """The CT of an InVesalius project.

    Parameters
    ----------
    path : Path
        The project (.inv3), or a folder that holds one, however deep.

    Returns
    -------
    Volume
        HU, int16. The file states spacings only; InVesalius keeps slices from the feet up and rows from the back of
        the patient to the front, with the first column at the patient's right, which makes the axes left-handed. That
        the face looks towards the last row can be seen, left and right cannot.

    Raises
    ------
    InputError
        There is no such file, or it is no project of a CT.

    """
    project = _project(path)
    try:
        with tarfile.open(fileobj=io.BytesIO(_decompressed(project)), mode="r:") as archive:
            members = {Path(member.name).name: member for member in archive if member.isfile()}
            settings = _settings(archive, members, project)
            name, shape, spacing = _described(settings, project)
            if name not in members:
                raise InputError(f"{project}: lacks {name}, which its {_SETTINGS} names; {WHERE}.")
            expected = 2 * int(np.prod(shape))
            if members[name].size != expected:
                raise InputError(
                    f"{project}: {name} has {members[name].size} bytes and not {expected}; {WHERE}."
                )
            voxels = np.frombuffer(_content(archive, members[name]), "<i2").reshape(shape)
    except (OSError, EOFError, tarfile.TarError, zlib.error) as error:
        raise InputError(f"{project}: cannot be read ({error}); {WHERE}.") from error
    i, j, k = spacing
    return Volume(voxels.astype(np.int16), np.diag([i, -j, k, 1.0]))


def _project(path: Path) -> Path:
    """The project's file."""
    if path.is_dir():
        found = sorted(path.rglob(f"*{ENDING}"))
        if len(found) != 1:
            raise InputError(f"--head {path}: holds {len(found)} files *{ENDING} and not one; {WHERE}.")
        return found[0]
    if not path.is_file():
        raise InputError(f"--head {path}: there is no such file or folder; {WHERE}.")
    return path


def _decompressed(project: Path) -> bytes:
    """The whole archive, which checks it for damage; refuses one that grows beyond MOST_BYTES."""
    with gzip.open(project) as stream:
        content = stream.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise InputError(f"{project}: it grows beyond {MOST_BYTES >> 20} MiB; {WHERE}.")
    return content


def _content(archive: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    """All bytes of a plain file."""
    return cast("Any", archive.extractfile(member)).read()


def _settings(archive: tarfile.TarFile, members: dict[str, tarfile.TarInfo], project: Path) -> dict[str, Any]:
    """What main.plist holds."""
    member = members.get(_SETTINGS)
    if member is None or member.size > _SETTINGS_BYTES:
        raise InputError(f"{project}: is no project of InVesalius (it lacks {_SETTINGS}); {WHERE}.")
    try:
        settings = plistlib.loads(_content(archive, member))
    except Exception as error:  # plistlib lets errors of many kinds through
        raise InputError(f"{project}: its {_SETTINGS} cannot be read ({error}); {WHERE}.") from error
    return settings if isinstance(settings, dict) else {}


def _described(
    settings: dict[str, Any], project: Path
) -> tuple[str, tuple[int, int, int], tuple[float, float, float]]:
    """Name of the voxels' file, its shape (k, j, i), and the spacing (i, j, k) in mm."""
    try:
        matrix, spacing = settings["matrix"], [float(each) for each in settings["spacing"]]
        name, kind, shape = str(matrix["filename"]), matrix["dtype"], [int(n) for n in matrix["shape"]]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f'{project}: its {_SETTINGS} lacks "matrix" or "spacing"; {WHERE}.') from error
    if settings.get("modality") != "CT" or kind != "int16":
        raise InputError(f"{project}: holds no CT of 16-bit integers; {WHERE}.")
    if len(shape) != 3 or min(shape) < 1 or np.prod(shape, dtype=float) > MOST_VOXELS:
        raise InputError(f'{project}: "matrix" has the shape {shape}; {WHERE}.')
    if len(spacing) != 3 or not all(0 < each < 100 for each in spacing):
        raise InputError(f'{project}: "spacing" is {spacing}; {WHERE}.')
    k, j, i = shape
    first, second, third = spacing
    return name, (k, j, i), (first, second, third)
