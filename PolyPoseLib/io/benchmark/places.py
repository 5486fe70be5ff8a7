"""Where a data set's files lie: inside the folder that was given, and called without a patient's name."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from PolyPoseLib.errors import InputError, cut
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.paths import files_behind

MAX_ENTRIES = 20_000
"""A folder with more entries is no data set's."""

IMAGE_ENDINGS = (".nii.gz", ".nii", ".nrrd", ".mha")


def require_root(root: str | Path, what: str, folder: bool = True) -> Path:
    """The data set's place with links followed; raises InputError with what belongs there when it is not one.

    Parameters
    ----------
    root : path
        As the user gave it.
    what : str
        What should be there and where it is to be had, for the sentence.
    folder : bool
        Whether it must be a folder.

    """
    root = Path(root)
    refuse_special_file(root)
    if not root.exists():
        raise InputError(f"{root}: there is no such folder: give {what}.")
    if folder and not root.is_dir():
        raise InputError(f"{root}: this is a file, not a folder: give {what}.")
    try:
        return root.resolve(strict=True)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{root}: cannot be followed (a loop of links, perhaps): give {what}.") from error


def inside(path: Path, root: Path) -> Path:
    """A file or folder of a data set with links followed, together with what reading it would open besides.

    Raises
    ------
    InputError
        It, or what it names, lies outside the data set's folder, or is a pipe or device.

    """
    try:
        targets = [path.resolve(strict=True)]
        refuse_special_file(targets[0], str(path))
        if targets[0].is_relative_to(root):  # what lies elsewhere is not looked into
            targets += [part.resolve(strict=True) for part in files_behind(path)]
    except (OSError, RuntimeError) as error:
        raise InputError(
            f"{path}: a link in it leads nowhere or in a circle: copy the file itself."
        ) from error
    for target in targets:
        if not target.is_relative_to(root):
            raise InputError(
                f"{path}: it leads out of the data set's folder: copy what it names into {root}, links are not "
                "followed out of it."
            )
    return targets[0]


def entries(folder: Path) -> list[str]:
    """Names in a folder, sorted, without hidden ones; raises InputError for a folder that cannot be listed."""
    try:
        with os.scandir(folder) as found:
            names = [each.name for each in islice(found, MAX_ENTRIES + 1)]
    except OSError as error:
        raise InputError(f"{folder}: cannot be listed ({error.strerror}): check its permissions.") from error
    if len(names) > MAX_ENTRIES:
        raise InputError(f"{folder}: it holds more than {MAX_ENTRIES} files: give the data set's own folder.")
    return sorted(name for name in names if not name.startswith("."))


def folders(root: Path, wanted: Callable[[str], object] = bool) -> list[Path]:
    """The folders in a data set's folder whose names are wanted, sorted by name.

    Raises InputError as `entries`, and for a link out of the root, before anything is looked for behind it.
    """
    found = [path for name in entries(root) if wanted(name) and (path := root / name).is_dir()]
    for path in found:
        if path.is_symlink():
            inside(path, root)
    return found


def files_below(place: Path, root: Path) -> Iterator[Path]:
    """Every file in a folder and below, or the file itself, as far as it lies inside the root.

    Links within the root are followed, once to every folder. Those out of it are left out: whoever needs what is
    behind them refuses them.
    """
    if not place.is_dir():
        yield place
        return
    seen = {os.path.realpath(place)}
    for folder, names, files in os.walk(place, followlinks=True):
        behind = {name: os.path.realpath(Path(folder, name)) for name in sorted(names)}
        names[:] = [
            name for name, real in behind.items() if real not in seen and Path(real).is_relative_to(root)
        ]
        seen.update(behind.values())
        for path in (Path(folder, name) for name in files):
            if Path(os.path.realpath(path)).is_relative_to(root) and path.is_file():
                yield path


def image_named(folder: Path, stem: str) -> Path | None:
    """The image of a name in any known format, or the folder of that name; None without one."""
    for ending in IMAGE_ENDINGS:
        if (folder / (stem + ending)).exists():
            return folder / (stem + ending)
    return folder / stem if (folder / stem).is_dir() else None


def subject_name(folder: Path, known: str) -> str:
    """What a subject is called: its folder's name where it is one of the data set's own, else a hash of the name.

    Folders of one's own data may be named after patients, and tables are published.

    Parameters
    ----------
    folder : Path
        Of the subject.
    known : str
        Regular expression of names that tell nothing of a person.

    """
    if re.fullmatch(known, folder.name, re.ASCII):
        return folder.name
    return "s" + hashlib.sha256(folder.name.encode("utf-8", "surrogateescape")).hexdigest()[:10]


def named_subject(subjects: dict[str, Path], name: str, where: str) -> Path:
    """The place of a subject; raises InputError with those that there are."""
    if name not in subjects:
        there = ", ".join(list(subjects)[:20]) + (", ..." if len(subjects) > 20 else "")
        raise InputError(
            f'{where}: there is no subject "{cut(str(name), 60)}": give one of {there or "(none)"}.'
        )
    return subjects[name]
