"""A camera that was found for an X-ray, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from PolyPoseLib.geometry.camera import Camera

if TYPE_CHECKING:
    from PolyPoseLib.data.study import Study


def camera_report(study: Study, guesses: dict[int, InitialCamera]) -> dict[str, Any]:
    """What was found, for programs: one entry an X-ray that was looked for, with its number in the study.

    extrinsic: (4, 4) world LPS mm to camera, for the view from the source; mirrored: whether the file shows the other
    side; within: [degrees, mm]; similarity, runner_up: local correlation of the best and of the next view, null when
    there was no search.
    """
    entries = [
        {
            "number": n,
            "name": study.xrays[n].name,
            "extrinsic": guess.camera.extrinsic.tolist(),
            "mirrored": study.xrays[n].mirrored,
            "sure": guess.sure,
            "within": list(guess.radius),
            "how": guess.how,
            "warnings": list(guess.warnings),
            "similarity": guess.similarity,
            "runner_up": guess.runner_up,
        }
        for n, guess in guesses.items()
    ]
    return {"version": 1, "cameras": entries}


@dataclass(frozen=True)
class InitialCamera:
    """A camera before stage A.

    camera: where to start; sure: whether it may be believed without a look; radius: (degrees, mm) within which the
    truth is expected; how: one line for people; warnings: what is doubtful, one line each; similarity, runner_up: local
    correlation of the best hypothesis and of the best one that is clearly another view, when searched.
    """

    camera: Camera
    sure: bool
    radius: tuple[float, float]
    how: str
    warnings: tuple[str, ...] = ()
    similarity: float | None = None
    runner_up: float | None = None
