"""First cameras of X-rays that belong together: what is found for one X-ray of a rig places the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.initial import Regressor, initial_camera
from PolyPoseLib.registration.cameras.rig import best_for_rig, placed_rig, relative_poses
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

SCORING_LEVEL = Level(6.0, 40.0, 0)
"""Resolution at which guesses of different X-rays are compared."""


def initial_rig_cameras(
    scene: Scene,
    xrays: Sequence[Xray],
    backend: Backend,
    monitor: Monitor,
    stage: str,
    method: str = "auto",
    model: Regressor | None = None,
) -> list[FoundCamera]:
    """A first camera for an X-ray that stands by itself, or for each of one rig, with the rig's relative pose.

    Of a rig: a camera that is known stays, and places those that are not. Otherwise each X-ray is asked for a guess,
    until one is sure, and the guess that explains all X-rays of the rig best places the others.

    Args:
        scene: the CT with its anchor.
        xrays: one, or two or more with their places in one rig.
        backend: renders.
        monitor: progress and cancelling.
        stage: name in the progress.
        method: as :func:`initial_camera` takes it.
        model: for "learned".

    Raises:
        InputError: the method applies to none of the X-rays.
        UntrustedResultError: no camera that was tried shows the anchor.

    """
    if len(xrays) == 1:
        return [initial_camera(scene, xrays[0], backend, monitor, stage, method, model)]
    relative = relative_poses([xray.rig.extrinsic for xray in xrays])
    blank = [
        Observation(xray.image, xray.mask, Camera(xray.intrinsics, np.eye(4), *xray.image.shape))
        for xray in xrays
    ]
    known = next((n for n, xray in enumerate(xrays) if xray.camera == "known"), None)
    if known is not None:
        first = np.linalg.inv(relative[known]) @ xrays[known].extrinsic
        placed = placed_rig(blank, relative, first)
        return [_known(m.camera, xray, xrays[known].name) for m, xray in zip(placed, xrays, strict=True)]
    guesses = _asked(scene, xrays, backend, monitor, stage, method, model)
    candidates = [(n, guess.extrinsic) for n, guess in guesses]
    best, cameras = best_for_rig(scene, blank, relative, candidates, SCORING_LEVEL, backend)
    number, guess = guesses[best]
    how = f'{guess.how}; placed by the rig with "{xrays[number].name}"'
    return [
        replace(guess, extrinsic=camera.extrinsic, how=guess.how if n == number else how)
        for n, camera in enumerate(cameras)
    ]


def _known(placed: Camera, xray: Xray, other: str) -> FoundCamera:
    """The X-ray's own camera when it is known, or else where the rig with a known one puts it."""
    if xray.camera == "known":
        return FoundCamera(xray.extrinsic, True, (0.0, 0.0), "known")
    return FoundCamera(
        placed.extrinsic, True, (0.0, 0.0), f'placed by the rig with "{other}", whose camera is known'
    )


def _asked(
    scene: Scene,
    xrays: Sequence[Xray],
    backend: Backend,
    monitor: Monitor,
    stage: str,
    method: str,
    model: Regressor | None,
) -> list[tuple[int, FoundCamera]]:
    """(number, guess) of the X-rays, until one is sure; raises the first error when none has a guess."""
    guesses: list[tuple[int, FoundCamera]] = []
    errors: list[Exception] = []
    for n, xray in enumerate(xrays):
        try:
            guess = initial_camera(scene, xray, backend, monitor, stage, method, model)
        except (InputError, UntrustedResultError) as error:
            errors.append(error)
            continue
        guesses.append((n, guess))
        if guess.sure:
            break
    if not guesses:
        raise errors[0]
    return guesses
