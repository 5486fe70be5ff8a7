"""The folder of a track: written whole or not at all, and read back."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from collections.abc import Sequence as Many
from functools import partial
from pathlib import Path
from typing import Any

from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track import Track
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.disk_space import require_space
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import json_text, parse_object
from PolyPoseLib.io.tracking.autoscoper import is_mirrored, volume_poses, volume_to_ct, write_tra
from PolyPoseLib.io.tracking.file_names import file_stems
from PolyPoseLib.io.tracking.frame_records import require_sound
from PolyPoseLib.io.tracking.joint_files import write_plots_of, write_tables_of, write_video_of
from PolyPoseLib.io.tracking.posed_files import (
    BYTES_OF_SURFACES,
    SURFACE_FORMATS,
    write_surfaces,
    write_warped,
)
from PolyPoseLib.io.tracking.poses_table import write_poses
from PolyPoseLib.io.tracking.readme import README, readme_text
from PolyPoseLib.io.tracking.track_fields import track_fields, track_of
from PolyPoseLib.io.whole_folders import FolderClaim, claimed_folder, existing_folder

TRACK, POSES = "track.json", "poses.csv"

MAX_BYTES = 2 << 30
"""Larger files of a track are refused: ten thousand frames of ten structures have a tenth."""

Writer = Callable[[Track, Sequence, Path], None]

MORE_FILES: tuple[Writer, ...] = (write_tables_of, write_plots_of, write_video_of)
"""What else is written into the folder, each from the track, the sequence and the folder: joint tables, plots, the
overlay video. What cannot be made is left out with a warning."""

WITHOUT = "The track is saved without some of its further files:"
"""How the warning about what was left out begins; the panel shows it."""

_LOG = logging.getLogger(__name__)


def save_track(
    track: Track,
    folder: str | Path | FolderClaim,
    sequence: Sequence | None = None,
    overwrite: bool = False,
    surfaces_of: Many[int] = (),
    warped: Many[int] = (),
    surface_format: str = "stl",
) -> Path:
    """Write the folder of a track, all of it or nothing.

    Surfaces, warped CTs and pictures that cannot be made are left out with a warning: they are no reason to lose hours
    of computation.

    Parameters
    ----------
    track : Track
        Of a sequence.
    folder : path or FolderClaim
        To write; absent, empty, or with ``overwrite`` an earlier track. A claim says already whether it is replaced.
    sequence : Sequence, optional
        What was tracked. Without it there are no files for Autoscoper, no surfaces and no warped CT.
    overwrite : bool
        Whether an earlier track is replaced.
    surfaces_of, warped : sequence of int
        Numbers of frames of which bones' surfaces, and the warped CT, are written.
    surface_format : {"stl", "vtp"}
        Of these surfaces; VTP also holds how far each vertex may be off.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        The track is not sound, the folder holds something else, or the system refuses to write; nothing is left behind.

    """
    if not isinstance(folder, FolderClaim):
        more = {"surfaces_of": surfaces_of, "warped": warped, "surface_format": surface_format}
        with claimed_folder(folder, overwrite, stranger_in_track) as claim:
            return save_track(track, claim, sequence, **more)
    if surface_format not in SURFACE_FORMATS:
        raise InputError(unknown_name("surface format", surface_format, SURFACE_FORMATS))
    _require_sound(track)
    require_space(folder.folder, expected_bytes(track, sequence, len(surfaces_of), len(warped)))
    with folder.whole() as temporary:
        write_poses(track, temporary / POSES)
        (temporary / README).write_text(
            readme_text(sequence is not None and is_mirrored(sequence.ct)), encoding="utf-8"
        )
        if sequence is not None:
            _write_for_autoscoper(track, sequence, temporary)
            surfaces = partial(write_surfaces, frames=surfaces_of, surface_format=surface_format)
            writers: list[Writer] = [surfaces] if surfaces_of else []
            writers += [partial(write_warped, frames=warped)] if warped else []
            for writer in (*writers, *MORE_FILES):
                _left_out_if_it_fails(writer, track, sequence, temporary)
        _write_fields(track, temporary)
    return folder.folder


def load_track(folder: str | Path) -> Track:
    """Read a folder that ``save_track`` or the command line wrote.

    Parameters
    ----------
    folder : path
        The folder with track.json.

    Returns
    -------
    Track
        Number for number what was saved; numbers that were not finite are NaN.

    Raises
    ------
    InputError
        The file is missing or damaged; the sentence names it and what is wrong.

    """
    path = existing_folder(folder, "tracking") / TRACK
    fields = parse_object(read_text(path, "a folder that track wrote", MAX_BYTES), str(path))
    try:
        return track_of(fields)
    except InputError as error:
        raise InputError(f"{path}: the file is damaged, track again: {error}") from error


def is_track(folder: str | Path) -> bool:
    """Whether a folder is that of a track, not of a registration's result."""
    return (Path(folder) / TRACK).is_file()


def stranger_in_track(folder: Path) -> str | None:
    """The first file in a folder that the tracking whose track.json is there did not write, or None."""
    if not (folder / TRACK).is_file():  # a folder of anything, perhaps of a whole disk
        return next((each.name for each in folder.iterdir()), None)
    found = sorted(each.relative_to(folder).as_posix() for each in folder.rglob("*") if not _is_folder(each))
    try:
        listed = parse_object(read_text(folder / TRACK, "a track", MAX_BYTES), TRACK).get("files")
    except InputError:
        listed = []
    ours = set(map(str, listed)) if isinstance(listed, list) else set()
    return next((name for name in found if name not in ours), None)


def expected_bytes(track: Track | None, sequence: Sequence | None, surfaces: int, warped: int) -> float:
    """About how many bytes a track takes on the disk, with so many frames of surfaces and of the warped CT."""
    frames = len(track.frames) if track is not None else (sequence.frame_count if sequence else 0)
    structures = len(track.names) if track is not None else (len(sequence.structures) if sequence else 0)
    voxels = sequence.ct.voxels.size if sequence is not None else 0
    return 2500.0 * frames * structures + BYTES_OF_SURFACES * surfaces + 1.5 * voxels * warped + 1e6


def _require_sound(track: Track) -> None:
    """Refuse what could not be read again; raises InputError."""
    for frame in track.frames:
        require_sound(
            frame,
            len(track.names),
            lambda k, number=frame.frame: f'The pose of "{track.names[k]}" in frame {number}',
        )


def _write_for_autoscoper(track: Track, sequence: Sequence, folder: Path) -> None:
    """Write a .tra file for every structure."""
    volume = volume_to_ct(sequence.ct)
    for k, stem in enumerate(file_stems(track.names)):
        write_tra(folder / f"{stem}.tra", volume_poses(track, k, volume), sequence.available)


def _write_fields(track: Track, folder: Path) -> None:
    """Write track.json, which lists all files, one line a frame."""
    fields: dict[str, Any] = track_fields(track)
    frames = fields.pop("frames")
    names = [each.relative_to(folder).as_posix() for each in folder.rglob("*") if not _is_folder(each)]
    fields["files"] = sorted([*names, TRACK])
    lines = ",\n  ".join(json.dumps(each, allow_nan=False) for each in frames)
    text = json_text(fields).rstrip().removesuffix("}").rstrip()
    (folder / TRACK).write_text(f'{text},\n "frames": [\n  {lines}\n ]\n}}\n', encoding="utf-8")


def _left_out_if_it_fails(writer: Writer, track: Track, sequence: Sequence, folder: Path) -> None:
    """Turn a failure to make what is not the track itself into a warning, and remove what it began.

    Raises OSError when the system refuses to write.
    """
    before = set(folder.rglob("*"))
    try:
        writer(track, sequence, folder)
        return
    except OSError as error:
        if error.errno is not None:
            raise
        reason = str(error)
    except InputError as error:
        reason = str(error)
    except Exception as error:  # drawing and warping can fail in ways of their own
        reason = f"{type(error).__name__}: {error}"
    for each in sorted(set(folder.rglob("*")) - before, reverse=True):
        each.rmdir() if _is_folder(each) else each.unlink()
    _LOG.warning("%s %s", WITHOUT, " ".join(reason.split())[:400])


def _is_folder(path: Path) -> bool:
    """Whether a path is a folder and no link."""
    return path.is_dir() and not path.is_symlink()
