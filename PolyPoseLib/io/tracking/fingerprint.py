"""A run's fingerprint: two runs that find the same poses have the same, so that one can go on where another ended."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict

from PolyPoseLib import __version__
from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.io.json_records import plain
from PolyPoseLib.io.tracking.frame_records import frame_fields


def fingerprint(sequence: Sequence, earlier: Correction | None = None) -> str:
    """A digest of all on which the poses that are kept of an interrupted run depend.

    Smoothing and joints with their landmarks come after them, threads change nothing, and without the pass backward
    the frames of the passes before it are the same. The range of frames counts, because the images' scale is decided
    on it. Of the images, a few spread over the frames count.

    Parameters
    ----------
    sequence : Sequence
        To be tracked.
    earlier : Correction, optional
        From which it is tracked on: the correction counts, and all of the earlier track's frames.

    Returns
    -------
    str
        64 hexadecimal digits.

    """
    options = sequence.options
    texts = {
        "version": __version__,
        "names": sequence.structures.names,
        "frames_per_second": sequence.frames_per_second,
        "reference": sequence.reference,
        "still": sequence.still,
        "initial_poses": dict(sorted(sequence.initial_poses.items())),
        "options": [options.start, options.prediction, options.kernel],
        "inputs": asdict(sequence.inputs),
        "cameras": [
            [
                view.name,
                view.first,
                view.camera.intrinsics,
                view.camera.extrinsic,
                view.camera.height,
                view.camera.width,
            ]
            for view in sequence.views
        ],
        "correction": None if earlier is None else _fields(earlier),
    }
    return hashlib.sha256(json.dumps(plain(texts), sort_keys=True).encode()).hexdigest()


def _fields(earlier: Correction) -> dict[str, object]:
    """All of a correction that changes what is found."""
    return {
        "frame": earlier.frame,
        "poses": dict(earlier.poses),
        "renewed": [earlier.renewed.start, earlier.renewed.stop],
        "frames": [frame_fields(each) for each in earlier.track.frames],
    }
