"""A camera to start from for one X-ray, by the best way at hand, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.imaging.xray import Xray
from PolyPoseLib.registration.monitor import Monitor
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

GIVEN_RADIUS = (5.0, 20.0)
"""Degrees and mm within which an extrinsic that a study gives as a guess is taken to be true."""


@dataclass(frozen=True)
class Guess:
    """A camera before stage A.

    camera: where to start; sure: whether it may be believed without a look; radius: (degrees, mm) within which the
    truth is expected; how: one line for people; warnings: what is doubtful, one line each.
    """

    camera: Camera
    sure: bool
    radius: tuple[float, float]
    how: str
    warnings: tuple[str, ...] = ()


def initial_camera(scene: Scene, xray: Xray, backend: Backend, monitor: Monitor, stage: str) -> Guess:
    """A camera for an X-ray whose camera is not known, from which stage A can start.

    An extrinsic in the study is taken as it is; one guessed from DICOM is the centre of a search within its own
    radius; without either, the camera is searched for.
    """
    if xray.extrinsic is not None and xray.initial_radius is None:
        camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
        return Guess(camera, True, GIVEN_RADIUS, "the guess given in the study")
    from PolyPoseLib.registration.search import search_camera

    return search_camera(scene, xray, backend, monitor, stage)
