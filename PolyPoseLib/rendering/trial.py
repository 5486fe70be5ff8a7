"""Which of several backends renders faster on this machine."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body

SECONDS = 2.0
"""For the whole trial; what a backend does once, as compiling and copying, comes on top."""

_EDGE, _PIXELS, _STEP_MM = 96, 200, 2.0

_LOG = logging.getLogger(__name__)


def faster_of(backends: Sequence[Backend], seconds: float = SECONDS) -> Backend:
    """The backend that renders a bone of 10 cm, with its derivatives and without, in the least time.

    Parameters
    ----------
    backends : sequence of Backend
        At least one; the first of those that are equally fast is taken.
    seconds : float
        Shared by all of them; every one renders at least once.

    Returns
    -------
    Backend
        One of them.

    """
    body, camera = sample()
    took = [_seconds_of(backend, body, camera, seconds / len(backends)) for backend in backends]
    best = int(np.argmin(took))
    told = ", ".join(f"{each.name} {1e3 * t:.1f} ms" for each, t in zip(backends, took, strict=True))
    _LOG.info("Rendering with %s: a bone takes %s.", backends[best].name, told)
    return backends[best]


def _seconds_of(backend: Backend, body: Body, camera: Camera, seconds: float) -> float:
    """Median time of a rendering with derivatives and one without."""
    times: list[float] = []
    rng = np.random.default_rng(0)
    until = None
    while until is None or not times or time.perf_counter() < until:
        pose = about(perturbation(rng.normal(0, [0.05] * 3 + [3.0] * 3)), body.centre)
        start = time.perf_counter()
        for jacobian in (False, True):
            project_body(body, camera, pose, _STEP_MM, backend, jacobian)
        if until is None:  # compiled and copied only now
            until = time.perf_counter() + seconds
        else:
            times.append(time.perf_counter() - start)
    return float(np.median(times))


def sample() -> tuple[Body, Camera]:
    """A ball with texture in the middle of a view."""
    middle = (_EDGE - 1) / 2
    grid = np.indices((_EDGE,) * 3) - middle
    shape = (grid**2).sum(axis=0) < (0.45 * _EDGE) ** 2
    texture = np.random.default_rng(0).uniform(0.02, 0.05, shape.shape)
    affine = np.eye(4)
    affine[:3, 3] = -middle
    body = Body(np.where(shape, texture, 0.0).astype(np.float32), affine, np.zeros(3))
    extrinsic = np.eye(4)
    extrinsic[2, 3] = 800.0
    centre = (_PIXELS - 1) / 2
    intrinsics = np.array([[1200.0, 0.0, centre], [0.0, 1200.0, centre], [0.0, 0.0, 1.0]])
    return body, Camera(intrinsics, extrinsic, _PIXELS, _PIXELS)
