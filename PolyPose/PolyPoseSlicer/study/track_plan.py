"""What a request would track: cameras, frames and rate; what is missing for it, and what is odd about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.geometry.camera import Camera

from .track_request import Start, TrackRequest
from .xray_reading import XrayReader
from .xray_series import gap_after, image_count, stated_rate
from .xray_source import XraySource

RATE_TOLERANCE = 0.02
"""Share by which stated frame rates may differ: times in nodes and in DICOM are rounded."""


@dataclass(frozen=True)
class Missing:
    """What has to be done before tracking can start: in a few words for a button, and as a sentence."""

    short: str
    sentence: str


@dataclass(frozen=True, eq=False)
class PlannedCamera:
    """One row that holds a sequence.

    name: in results. count: of its images. first: number of the image that belongs to frame 0. rate: frames per second
    that it states, or None. found: the camera that a registration found, or None. known: extrinsic (4, 4) of a
    camera that is known exactly, or None. mirrored: whether its images are stored the other way round than seen from
    the source. ready: whether its geometry is complete.
    """

    source: XraySource
    name: str
    count: int
    first: int
    rate: float | None = None
    found: Camera | None = None
    known: np.ndarray | None = None
    mirrored: bool = False
    ready: bool = True


@dataclass(frozen=True)
class TrackPlan:
    """What a request comes to.

    cameras: rows that hold a sequence. available: frames that all cameras have. frames: those to be tracked. rate:
    frames per second, None where nothing says. missing: the first thing that is missing, or None. notes: what is odd
    but not wrong.
    """

    cameras: tuple[PlannedCamera, ...] = ()
    available: int = 0
    frames: range = range(0)
    rate: float | None = None
    missing: Missing | None = None
    notes: tuple[str, ...] = ()


def plan_of(request: TrackRequest, reader: XrayReader) -> TrackPlan:
    """What would be tracked; reader: reads X-rays, and remembers them."""
    cameras = _cameras(request, reader)
    available = max(0, min((each.count - each.first for each in cameras), default=0))
    frames = _frames(request, cameras, available)
    rate = request.settings.frames_per_second or _common_rate(cameras)
    missing = (
        _missing_bones(request)
        or _missing_cameras(request, cameras)
        or _missing_rate(cameras, rate)
        or _missing_frames(available, frames)
        or _missing_start(request)
    )
    return TrackPlan(cameras, available, frames, rate, missing, tuple(_notes(request, cameras, frames)))


def _cameras(request: TrackRequest, reader: XrayReader) -> tuple[PlannedCamera, ...]:
    """The rows that hold several images, each with the image of frame 0.

    The images that the rows show belong together, as for a registration: the row with the earliest one gives the frames
    their numbers.
    """
    rows = [(number, source, image_count(source)) for number, source in enumerate(request.sources())]
    rows = [row for row in rows if row[2] > 1]
    earliest = min((source.frame or 0 for _number, source, _count in rows), default=0)
    cameras = []
    for number, source, count in rows:
        xray = reader.report(source).xray
        found = request.found.get(source.series)
        known = xray.extrinsic if xray is not None and xray.camera == "known" else None
        cameras.append(
            PlannedCamera(
                source,
                str(source.fields.get("name") or view_name(number)),
                count,
                (source.frame or 0) - earliest,
                stated_rate(source),
                None if found is None else found.camera,
                known,
                xray is not None and xray.mirrored,
                xray is not None,
            )
        )
    return tuple(cameras)


def _frames(request: TrackRequest, cameras: tuple[PlannedCamera, ...], available: int) -> range:
    """Numbers of the frames to be tracked; empty where there is none."""
    settings = request.settings
    first = settings.first
    if first is None:
        first = (registered_frame(request, cameras) or 0) if settings.start is Start.RESULT else 0
    last = available - 1 if settings.last is None else min(settings.last, available - 1)
    return range(first, last + 1)


def registered_frame(request: TrackRequest, cameras: tuple[PlannedCamera, ...]) -> int | None:
    """The frame of which the result's poses are; None where its images do not belong to one frame of the sequence."""
    frames = {
        request.found[each.source.series].frame - each.first
        for each in cameras
        if each.source.series in request.found
    }
    return frames.pop() if len(frames) == 1 and min(frames) >= 0 else None


def _common_rate(cameras: tuple[PlannedCamera, ...]) -> float | None:
    """The rate that the sequences state; None where none does, or two state different ones."""
    rates = [each.rate for each in cameras if each.rate]
    return rates[0] if rates and not _differ(rates) else None


def _differ(rates: list[float]) -> bool:
    return max(rates) - min(rates) > RATE_TOLERANCE * max(rates)


def _missing_bones(request: TrackRequest) -> Missing | None:
    short, structures = _("Choose the bones first"), request.by_structure()
    if request.ct is None:
        return Missing(short, _("Choose the CT."))
    if request.segmentation is None:
        return Missing(short, _("Choose the segmentation of the CT's bones."))
    if not structures:
        return Missing(
            short, _("Assign at least one segment to a structure, or have the structures proposed.")
        )
    if request.reference not in structures:
        return Missing(
            short, _("Choose the reference: the structure relative to which motions are reported.")
        )
    if set(structures) <= set(request.settings.still):
        return Missing(
            _("Let a bone move"), _("Every structure stands still: uncheck those that move in the sequence.")
        )
    return None


def _missing_cameras(request: TrackRequest, cameras: tuple[PlannedCamera, ...]) -> Missing | None:
    if not cameras:
        return Missing(
            _("Add an X-ray sequence first"),
            _("None of the X-rays is a sequence: add one for each camera in the section X-rays."),
        )
    for each in cameras:
        if not each.ready:
            sentence = _("The X-ray '{name}' is not ready: complete its geometry, or remove it.")
            return Missing(_("Complete the X-rays first"), sentence.format(name=each.source.name))
    names = [each.name for each in cameras]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        sentence = _('Two X-rays have the name "{name}": give each camera its own.')
        return Missing(_("Name the X-rays first"), sentence.format(name=twice))
    if all(each.found is not None for each in cameras):
        return None
    unknown = next((each for each in cameras if each.known is None), None)
    if unknown is None:
        return None
    sentence = _(
        "The camera of '{name}' is not known: register one frame of all sequences first, whose cameras are then kept, "
        "or state that the camera is known exactly."
    )
    return Missing(_("Find the cameras first"), sentence.format(name=unknown.source.name))


def _missing_rate(cameras: tuple[PlannedCamera, ...], rate: float | None) -> Missing | None:
    if rate:
        return None
    rates = [each.rate for each in cameras if each.rate]
    sentence = _("The images do not state how many frames there are in a second: enter it.")
    if rates:
        stated = ", ".join(f"{each:.4g}" for each in rates)
        sentence = _(
            "The sequences state different numbers of frames per second ({rates}): enter the true one."
        ).format(rates=stated)
    return Missing(_("Enter the frame rate"), sentence)


def _missing_frames(available: int, frames: range) -> Missing | None:
    if len(frames):
        return None
    sentence = _("No frame is left: there are {count}, counted from 0. Check the first and the last frame.")
    if available < 1:
        sentence = _("No frame is left that every camera has: check which image each X-ray shows (Frame).")
    return Missing(_("Check the frames"), sentence.format(count=available))


def _missing_start(request: TrackRequest) -> Missing | None:
    if request.settings.start is not Start.RESULT or request.poses:
        return None
    return Missing(
        _("Register one frame first"),
        _("There is no result to start from: register one frame, or choose another start."),
    )


def _notes(request: TrackRequest, cameras: tuple[PlannedCamera, ...], frames: range) -> list[str]:
    notes = []
    left = len(request.sources()) - len(cameras)
    if cameras and left:
        notes.append(_("{count} X-rays are single images and are not tracked.").format(count=left))
    counts = {each.name: each.count - each.first for each in cameras}
    if len(set(counts.values())) > 1:
        each = ", ".join(f"{name}: {count}" for name, count in counts.items())
        notes.append(
            _(
                "The sequences have different numbers of images from frame 0 on ({each}): what one of them lacks is "
                "not tracked."
            ).format(each=each)
        )
    stated = _common_rate(cameras)
    entered = request.settings.frames_per_second
    if entered and stated and _differ([entered, stated]):
        notes.append(
            _("The images state {rate:.4g} frames per second, another number than was entered.").format(
                rate=stated
            )
        )
    for each in cameras:
        gap = gap_after(each.source)
        if gap is not None:
            notes.append(
                _(
                    "{name}: by their times, images are missing after image {number}; frames are taken as evenly "
                    "spaced."
                ).format(name=each.name, number=gap + 1)
            )
    if len(cameras) == 1:
        notes.append(_("One camera shows next to nothing of motion along its rays: two are better."))
    if request.settings.start is Start.RESULT and request.poses and len(frames):
        registered = registered_frame(request, cameras)
        if registered != frames.start:
            notes.append(
                _(
                    "The result's poses belong to another frame than {frame}, which starts from them nevertheless."
                ).format(frame=frames.start)
            )
        notes += _notes_on_still(request)
    return notes


def _notes_on_still(request: TrackRequest) -> list[str]:
    """What stands still at a given pose is taken there as exact, and no X-ray is asked about it."""
    doubtful = [each for each in request.uncertain if each in request.settings.still]
    if not doubtful:
        return []
    return [
        _(
            "The result's poses of structures that stand still are flagged as uncertain ({names}), but the track takes "
            "them as exact and flags nothing: let them move, or correct them and register again."
        ).format(names=", ".join(doubtful))
    ]
