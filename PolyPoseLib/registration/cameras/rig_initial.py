"""Initial cameras of X-rays that belong together: what is found for one X-ray of a rig places the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.cameras.initial import Regressor, initial_camera
from PolyPoseLib.registration.cameras.rig import best_for_rig, placed_rig, relative_poses
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.run import Run

SCORING_LEVEL = Level(6.0, 40.0, 0)
"""Resolution at which the initial cameras of different X-rays are compared."""


def initial_rig_cameras(
    run: Run, xrays: Sequence[Xray], method: str = "auto", model: Regressor | None = None
) -> list[FoundCamera]:
    """The initial camera of an X-ray by itself, or one for each X-ray of a rig, with the rig's relative poses.

    Of a rig: a camera that is known stays, and places those that are not. Otherwise a camera is found for one X-ray
    after the other, until one is certain, and the one that agrees best with all X-rays of the rig places the others.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    xrays : sequence of Xray
        One, or two or more with their places in one rig.
    method : str
        As :func:`initial_camera` takes it.
    model : Regressor, optional
        For "learned".

    Returns
    -------
    list of FoundCamera
        In the order of the X-rays.

    Raises
    ------
    InputError
        The method applies to none of the X-rays.
    UntrustedResultError
        No camera that was tried shows the anchor.

    """
    if len(xrays) == 1:
        return [initial_camera(run, xrays[0], method, model)]
    relative = relative_poses([_rig_extrinsic(xray) for xray in xrays])
    blank = [
        Observation(xray.image, xray.mask, Camera(xray.intrinsics, np.eye(4), *xray.image.shape))
        for xray in xrays
    ]
    for n, xray in enumerate(xrays):
        if xray.camera == "known" and xray.extrinsic is not None:
            placed = placed_rig(blank, relative, np.linalg.inv(relative[n]) @ xray.extrinsic)
            return [_known_or_placed(o.camera, x, xray.name) for o, x in zip(placed, xrays, strict=True)]
    found = _found_for_some(run, xrays, method, model)
    candidates = [(n, each.extrinsic) for n, each in found]
    best, cameras = best_for_rig(run, blank, relative, candidates, SCORING_LEVEL)
    number, first = found[best]
    how = f'{first.how}; placed by the rig with "{xrays[number].name}"'
    return [
        replace(first, extrinsic=camera.extrinsic, how=first.how if n == number else how)
        for n, camera in enumerate(cameras)
    ]


def _rig_extrinsic(xray: Xray) -> np.ndarray:
    """(4, 4) from the rig's world to the camera."""
    if xray.rig is None:
        raise InputError(f'{label_of(xray.name)} has no "rig": it cannot be placed by other X-rays.')
    return xray.rig.extrinsic


def _known_or_placed(placed: Camera, xray: Xray, other: str) -> FoundCamera:
    """The X-ray's own camera when it is known, or else where the rig with a known one puts it."""
    if xray.camera == "known" and xray.extrinsic is not None:
        return FoundCamera(xray.extrinsic, True, (0.0, 0.0), "known")
    how = f'placed by the rig with "{other}", whose camera is known'
    return FoundCamera(placed.extrinsic, True, (0.0, 0.0), how)


def _found_for_some(
    run: Run, xrays: Sequence[Xray], method: str, model: Regressor | None
) -> list[tuple[int, FoundCamera]]:
    """(number, camera) of the X-rays, until one is certain; raises the first error when none is found."""
    found: list[tuple[int, FoundCamera]] = []
    errors: list[Exception] = []
    for n, xray in enumerate(xrays):
        try:
            camera = initial_camera(run, xray, method, model)
        except (InputError, UntrustedResultError) as error:
            errors.append(error)
            continue
        found.append((n, camera))
        if camera.sure:
            break
    if not found:
        raise errors[0]
    return found
