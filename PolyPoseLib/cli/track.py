"""Subcommand track: a sequence in, the folder of a track out; an interrupted run goes on where it ended."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence as Many
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import add_progress, new_parser
from PolyPoseLib.cli._console import progress_display, table
from PolyPoseLib.cli._track_on import add_continuation, correction_of, options_of_earlier
from PolyPoseLib.data.tracking.track_options import TRACK_CHOICES
from PolyPoseLib.errors import InputError, UntrustedResultError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from PolyPoseLib.data.tracking.correction import Correction
    from PolyPoseLib.data.tracking.sequence import Sequence
    from PolyPoseLib.data.tracking.track import Track
    from PolyPoseLib.io.tracking.checkpoint import Checkpoint
    from PolyPoseLib.io.whole_folders import FolderClaim

_LOG = logging.getLogger(__name__)

MOST_FRAMES = 10_000
"""Frames that one list of a flag may name."""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "track",
        "follow bones through an X-ray sequence of calibrated cameras",
        "walk/TRACK.json --output walk/track",
    )
    parser.add_argument("sequence", type=Path, help="the sequence's JSON file")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="folder for the track")
    parser.add_argument(
        "--overwrite",
        action="store_true",
        help="replace an earlier track in DIR, or begin an interrupted run anew",
    )
    parser.add_argument(
        "--resume", action="store_true", help="go on with an interrupted run, whose frames are in DIR.partial"
    )
    parser.add_argument(
        "--allow-outside",
        action="store_true",
        help="read files outside the sequence's folder if it names them",
    )
    parser.add_argument("--first", type=int, metavar="N", help="first frame, counted from 0 (default: 0)")
    parser.add_argument("--last", type=int, metavar="N", help="last frame, tracked too (default: the end)")
    parser.add_argument(
        "--start",
        choices=TRACK_CHOICES["start"],
        help="where structures without an initial pose begin: where the CT has them, or by a registration of the "
        "first frame (default: rest)",
    )
    parser.add_argument(
        "--prediction",
        choices=TRACK_CHOICES["prediction"],
        help="where a frame's fit starts (default: constant_velocity)",
    )
    parser.add_argument(
        "--backward",
        action=argparse.BooleanOptionalAction,
        help="go through the sequence a second time, backward, and keep the better poses (default: yes)",
    )
    parser.add_argument(
        "--smooth",
        action=argparse.BooleanOptionalAction,
        help="smooth the poses with their own covariances; marked in the output (default: no)",
    )
    parser.add_argument(
        "--frames-of-surfaces",
        type=_frames,
        default=(),
        metavar="LIST",
        help="write bones of frames 0,10,20 as surfaces",
    )
    parser.add_argument(
        "--surface-format",
        choices=("stl", "vtp"),
        default="stl",
        help="of these surfaces; VTP also holds how far each vertex may be off (default: stl)",
    )
    parser.add_argument(
        "--warp-frames",
        type=_frames,
        default=(),
        metavar="LIST",
        help="write the CT in the posture of these frames",
    )
    parser.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: all)")
    add_continuation(parser)
    add_progress(parser)
    parser.set_defaults(run=run, computes=True)


def run(arguments: argparse.Namespace) -> int:
    """Track and save; raises UntrustedResultError after saving when the track must not be trusted."""
    from PolyPoseLib.io.tracking.checkpoint import checkpoint_path, opened_checkpoint
    from PolyPoseLib.io.tracking.fingerprint import fingerprint
    from PolyPoseLib.io.tracking.sequences import load_sequence
    from PolyPoseLib.io.tracking.tracks import save_track, stranger_in_track
    from PolyPoseLib.io.whole_folders import claimed_folder

    surfaces, warped = arguments.frames_of_surfaces, arguments.warp_frames
    with claimed_folder(arguments.output, arguments.overwrite, stranger_in_track) as claim:
        path = checkpoint_path(arguments.output)
        _refuse_to_discard(path, arguments)
        earlier = correction_of(arguments)
        options = _given_options(arguments) | options_of_earlier(earlier)
        sequence = load_sequence(arguments.sequence, arguments.allow_outside, options)
        _require_possible(sequence, arguments)
        digest = fingerprint(sequence, earlier)
        names = sequence.structures.names
        with (
            opened_checkpoint(path, digest, names, arguments.resume) as checkpoint,
            _telling_what_is_kept(checkpoint, claim),
        ):
            track = _track(sequence, checkpoint, arguments.progress, earlier)
            output = save_track(
                track, claim, sequence, False, surfaces, warped, surface_format=arguments.surface_format
            )
        path.unlink(missing_ok=True)
    if arguments.progress != "json":
        print(summary_table(track))
        print("".join(f"\n{line}" for line in doubt_lines(track)), end="")
        print(f"\nTrack: {output}")
    if track.distrust:
        raise UntrustedResultError(
            f"The track was saved in {output} but must not be trusted: {track.distrust_clauses}."
        )
    return 0


def _track(sequence: Sequence, checkpoint: Checkpoint, kind: str, earlier: Correction | None) -> Track:
    """Track a sequence with its progress shown, every frame kept once it is fitted."""
    from PolyPoseLib.tracking.follow import track

    if checkpoint.done:
        frames = sequence.frame_count if earlier is None else len(earlier.renewed)
        again = len(checkpoint.done) - checkpoint.kept
        back = f", {again} looked at again on the way back" if again else ""
        _LOG.info("Going on after %d of %d frames%s.", checkpoint.kept, frames, back)
    display = progress_display(kind)
    try:
        found = track(sequence, progress=display, done=checkpoint.done, keep=checkpoint.keep, earlier=earlier)
    finally:
        display.close()
    for warning in found.warnings:
        if warning not in sequence.warnings:
            _LOG.warning(warning)
    return found


def _frames(text: str) -> tuple[int, ...]:
    """Numbers of frames, 0,10,20, or 0:100:10 for a range with a step."""
    numbers: list[int] = []
    for part in text.split(","):
        ends = part.split(":")
        if len(ends) > 3 or not all(each.strip().isascii() and each.strip().isdigit() for each in ends):
            raise argparse.ArgumentTypeError(
                f"{part[:40]!r} is no frame: give numbers such as 0,10,20 or 0:100:10"
            )
        first, *more = (int(each) for each in ends)
        last, step = (more[0] if more else first), (more[1] if len(more) > 1 else 1)
        if step < 1 or last < first or len(numbers) + (last - first) // step >= MOST_FRAMES:
            raise argparse.ArgumentTypeError(f"{part[:40]!r} is no range of frames, or a very long one")
        numbers.extend(range(first, last + 1, step))
    return tuple(dict.fromkeys(numbers))


def _given_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options that were given on the command line."""
    names = ("first", "last", "start", "prediction", "backward", "smooth", "threads")
    given = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in given.items() if value is not None}


def _refuse_to_discard(path: Path, arguments: argparse.Namespace) -> None:
    """Refuse to begin anew where an interrupted run has left frames, unless that is asked for; raises InputError."""
    from PolyPoseLib.io.tracking.checkpoint import frames_left

    left = frames_left(path)
    if left is None and arguments.resume:
        _LOG.info("There is no interrupted run of this output: it begins with the first frame.")
    if not left or arguments.resume:
        return
    if not arguments.overwrite:
        raise InputError(
            f"{path}: an interrupted run has left {left} frames here: add --resume to go on, or --overwrite to begin "
            "anew."
        )
    _LOG.warning("%d frames of an interrupted run are discarded.", left)


def _require_possible(sequence: Sequence, arguments: argparse.Namespace) -> None:
    """Refuse, before hours of computation, files that could not be written at their end; raises InputError."""
    from PolyPoseLib.io.carried.meshes import require_vtk
    from PolyPoseLib.io.disk_space import require_space
    from PolyPoseLib.io.tracking.posed_files import require_frames
    from PolyPoseLib.io.tracking.tracks import expected_bytes

    surfaces, warped = arguments.frames_of_surfaces, arguments.warp_frames
    require_frames(surfaces, sequence.frames, "--frames-of-surfaces")
    require_frames(warped, sequence.frames, "--warp-frames")
    if surfaces:
        require_vtk()
    # Frames are in the checkpoint and in the track for a while.
    need = expected_bytes(None, sequence, 0, 0) + expected_bytes(None, sequence, len(surfaces), len(warped))
    require_space(arguments.output, need)


@contextmanager
def _telling_what_is_kept(checkpoint: Checkpoint, claim: FolderClaim) -> Iterator[None]:
    """Let whatever ends a run say how many frames the next one can go on with."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        said = f"the track was written to {claim.folder}" if claim.written else _kept(checkpoint)
        raise KeyboardInterrupt(said) from interrupt
    except Exception:
        if checkpoint.kept:
            _LOG.warning("%s.", _kept(checkpoint))
        raise


def _kept(checkpoint: Checkpoint) -> str:
    """What an interrupted run has left."""
    if not checkpoint.kept:
        return "no frame was fitted"
    return f"{checkpoint.kept} frames are kept in {checkpoint.path}: add --resume to go on"


def summary_table(track: Track) -> str:
    """How a track went, structure by structure, and how long a frame took."""
    from PolyPoseLib.data.tracking.summary import summary_of

    rows = [
        (each.name, each.lost, each.doubtful, each.rotation_deg, each.translation_mm, each.residual)
        for each in summary_of(track)
    ]
    header = ("structure", "lost", "doubtful", "range deg", "range mm", "residual")
    frames = len(track.frames)
    seconds = sum(each.cpu_seconds for each in track.frames)
    lines = [
        table(header, rows),
        f'(ranges of motion relative to "{track.reference}", its own in the rig\'s world)',
        "",
        f"{frames} frames, {_any_lost(track)} with a lost structure, {int(track.doubtful.any(axis=1).sum())} with a "
        f"doubtful one; {seconds / max(frames, 1):.2f} CPU seconds a frame{', smoothed' if track.smoothed else ''}",
    ]
    return "\n".join(lines)


def doubt_lines(track: Track, most: int = 10) -> list[str]:
    """Why not to rely on poses, a line for the first doubtful frames."""
    lines = [
        f"frame {frame.frame}, {name}: {'; '.join(doubts)}"
        for frame in track.frames
        for name, doubts in zip(track.names, frame.doubts, strict=True)
        if doubts
    ]
    more = len(lines) - most
    return lines[:most] + ([f"and {more} more, see poses.csv"] if more > 0 else [])


def _any_lost(track: Track) -> int:
    """Frames in which any structure was lost."""
    return sum("none" in frame.sources for frame in track.frames)


__all__: Many[str] = ["add_parser", "doubt_lines", "run", "summary_table"]
