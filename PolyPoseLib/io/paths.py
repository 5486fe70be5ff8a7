"""Which files a study may name: those in its own folder, unless the user allows others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PolyPoseLib.errors import InputError, cut, shown
from PolyPoseLib.io.detached_data import HEADER_ENDINGS, data_place, names_several_files
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.nifti import pair_of


def resolve(name: str, field: str, folder: Path, allow_outside: bool) -> Path:
    """The existing path that a field names, relative to the study's folder.

    Links are followed first, so a link that leaves the folder is refused as "../" is. Raises InputError.
    """
    target = _named(name, field, folder, allow_outside)
    refuse_special_file(target, f'"{field}" names {_shown(name)}')
    if not allow_outside:
        for part, place in _parts(target, field, name):
            if not _is_inside(place, folder):
                raise InputError(
                    f'"{field}" names {_shown(name)}, which reads "{part.name}" outside the study\'s folder: '
                    "move that into the folder, or allow it with --allow-outside."
                )
    return target


def _named(name: str, field: str, folder: Path, allow_outside: bool) -> Path:
    """The existing path that a field names, whatever reading it would open besides; raises InputError."""
    _require_name(name, field)
    path = folder / name
    try:
        target = path.resolve()
        exists = target.exists()
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(
            f'"{field}" names {_shown(name)}, a path that cannot be followed: correct it.'
        ) from error
    if not allow_outside and not _is_inside(target, folder):
        raise InputError(
            f'"{field}" names {_shown(name)}, outside the study\'s folder: move it into the folder, or allow it '
            "with --allow-outside."
        )
    if not exists:
        raise InputError(
            f'"{field}" names {_shown(name)}, but there is no such file in {folder}: correct the name.'
        )
    return target


def _shown(name: str) -> str:
    """A name in quotation marks, cut where it is too long for any file."""
    return f'"{cut(name, 200)}"'


def _require_name(name: object, field: str) -> None:
    """Raise InputError when a field holds nothing that could be a path."""
    if not isinstance(name, str) or not name.strip() or "\0" in name:
        raise InputError(
            f'"{field}" is {shown(name)}: give the path of a file, relative to the study\'s folder.'
        )


def require_different_images(images: Sequence[tuple[Path, int | None]]) -> None:
    """Refuse X-rays that are one image under two names, which would count twice.

    Links were followed, and further names that the system gives one file ("hard links", other capitals) are known by
    the file itself.  Two frames of one run are two images, but the frame that is taken where none is given may be any.

    Parameters
    ----------
    images : sequence of (Path, int or None)
        Resolved path, and frame counted from 0, of each X-ray in the study's order.

    Raises
    ------
    InputError
        Two are the same; the sentence names both by their numbers.

    """
    seen: dict[tuple[object, ...], dict[int | None, int]] = {}
    for number, (path, frame) in enumerate(images):
        frames = seen.setdefault(_identity(path), {})
        other = frames.get(frame, frames.get(None))
        if other is None and frame is None and frames:
            other = min(frames.values())
        if other is not None:
            raise InputError(
                f'"xrays"[{number}] is the same image as "xrays"[{other}] ({path.name}): remove one of them, or '
                'give each the "frame" that it means.'
            )
        frames[frame] = number


def _identity(path: Path) -> tuple[object, ...]:
    """What all names of one file have in common."""
    status = path.stat()
    return (status.st_dev, status.st_ino) if status.st_ino else (path,)


def resolve_output(name: str, field: str, folder: Path, allow_outside: bool) -> Path:
    """The path of a file to write that a field names, in the study's folder; its folder exists. Raises InputError."""
    _require_name(name, field)
    path = folder / name
    parent = _named(str(path.parent), field, folder, allow_outside)
    if path.is_symlink() or path.is_dir():
        raise InputError(f'"{field}" names {_shown(name)}, which is a folder or a link: name a file.')
    return parent / path.name


def _parts(target: Path, field: str, name: str) -> list[tuple[Path, Path]]:
    """The further files of a field's file, and where each really is; raises InputError that names the field."""
    try:
        return [(part, part.resolve()) for part in files_behind(target)]
    except InputError as error:
        raise InputError(f'"{field}": {error}') from None
    except (OSError, RuntimeError) as error:
        raise InputError(
            f'"{field}" names {_shown(name)}, which cannot be read or followed: check its links and permissions.'
        ) from error


def _is_inside(target: Path, folder: Path) -> bool:
    """Whether a resolved path is in the folder or below it."""
    return target.is_relative_to(folder.resolve())


def files_behind(path: Path) -> list[Path]:
    """Further files that reading this one opens: a folder's slices, the data of a detached header.

    Raises InputError for headers that name a list or a sequence of files, whose members are not followed here.
    """
    if path.is_dir():
        return [file for file in path.rglob("*") if file.is_symlink()]
    if not path.name.lower().endswith(HEADER_ENDINGS):
        return pair_of(path)
    place = data_place(path)
    if place is None:
        return []
    if names_several_files(place):
        raise InputError(
            f"{path.name} reads its voxels from a list of files: save it as one file, or allow it with "
            "--allow-outside."
        )
    return [path.parent / place]
