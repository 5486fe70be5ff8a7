"""The compiled ray kernel, and a whole registration, against what the processor's cores can do.

The same rays are followed three times: as the kernel does; only loading the eight voxels of each sample's cell; and
only interpolating, between eight numbers that stay in registers. A kernel that loads and interpolates at every sample
cannot be faster than the slower of the two.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.rendering import kernels, pose_kernels
from PolyPoseLib.rendering.kernels import _cell, _flat_index, _march
from PolyPoseLib.rendering.numba_backend import flat_voxels
from PolyPoseLib.rendering.rigid import Body, index_rays

BYTES_PER_SAMPLE = 32
"""Eight voxels of four bytes."""

LOADS, ARITHMETIC = "eight loads a sample, nothing else", "interpolation in registers, no load"


@numba.njit(parallel=True, fastmath=True)
def count_samples(size, rays, near, far, counts):
    """Number of samples of every ray."""
    depth, height, width = size
    high = (width - 1.0, height - 1.0, depth - 1.0)
    rows, columns = counts.shape
    for row in numba.prange(rows):
        for column in range(columns):
            counts[row, column] = _march(row, column, rays, (near, far), (0.0, 0.0, 0.0), high)[0]


@numba.njit(parallel=True, fastmath=True)
def load_only(volume, size, rays, near, far, image):
    """Sums of the eight voxels around every sample."""
    depth, height, width = size
    high = (width - 1.0, height - 1.0, depth - 1.0)
    last_i, last_j, last_k = np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    next_j, next_k = np.int32(width), np.int32(width * height)
    rows, columns = image.shape
    for row in numba.prange(rows):
        for column in range(columns):
            count, _s, _ds, x, y, z, sx, sy, sz = _march(
                row, column, rays, (near, far), (0.0, 0.0, 0.0), high
            )
            total = np.float32(0.0)
            for n in range(count):
                m = np.float32(n)
                i, _f = _cell(x + m * sx, last_i)
                j, _f = _cell(y + m * sy, last_j)
                k, _f = _cell(z + m * sz, last_k)
                at = _flat_index(i, j, k, next_j, next_k)
                near_side = volume[at] + volume[at + 1] + volume[at + next_j] + volume[at + next_j + 1]
                far_side = volume[at + next_k] + volume[at + next_k + 1]
                far_side += volume[at + next_k + next_j] + volume[at + next_k + next_j + 1]
                total += near_side + far_side
            image[row, column] = total


@numba.njit(parallel=True, fastmath=True)
def interpolate_only(corners, size, rays, near, far, image):
    """Interpolation at every sample between the same eight numbers, ``corners`` (8,)."""
    depth, height, width = size
    high = (width - 1.0, height - 1.0, depth - 1.0)
    last_i, last_j, last_k = np.int32(width - 2), np.int32(height - 2), np.int32(depth - 2)
    rows, columns = image.shape
    for row in numba.prange(rows):
        a, b, c, d, e, f, g, h = corners
        for column in range(columns):
            count, _s, _ds, x, y, z, sx, sy, sz = _march(
                row, column, rays, (near, far), (0.0, 0.0, 0.0), high
            )
            total = np.float32(0.0)
            for n in range(count):
                m = np.float32(n)
                _i, fx = _cell(x + m * sx, last_i)
                _j, fy = _cell(y + m * sy, last_j)
                _k, fz = _cell(z + m * sz, last_k)
                c00, c01, c10, c11 = a + fx * (b - a), c + fx * (d - c), e + fx * (f - e), g + fx * (h - g)
                c0, c1 = c00 + fy * (c01 - c00), c10 + fy * (c11 - c10)
                total += c0 + fz * (c1 - c0)
            image[row, column] = total


def ray_limits(
    body: Body, camera: Camera, step_mm: float, take_turns: Callable[[dict[str, Callable[[], object]]], dict]
) -> dict:
    """Samples, seconds of the kernel and of its limits, and bytes a second that the memory copies.

    Parameters
    ----------
    body : Body
        What is rendered.
    camera : Camera
        Of the image.
    step_mm : float
        Distance of samples.
    take_turns : callable
        From {name: action} to {name: {"median": seconds}}.

    """
    rays = index_rays(body, camera, np.eye(4), (0, camera.height, 0, camera.width), step_mm)
    volume, size = flat_voxels(body.voxels), body.voxels.shape
    tiles = tuple(-(-edge // kernels.TILE) for edge in rays.shape)
    near, far = np.zeros(tiles), np.full(tiles, kernels.FARTHEST)
    image, counts = np.zeros(rays.shape, np.float32), np.zeros(rays.shape, np.int64)
    moments = np.zeros((*rays.shape, 6), np.float32)
    count_samples(size, rays, near, far, counts)
    corners = tuple(np.float32(value) for value in np.random.default_rng(0).random(8))
    block = np.zeros(1 << 28, np.uint8)
    target = np.ones_like(block)
    contestants: dict[str, Callable[[], object]] = {
        "image": lambda: kernels.project(volume, size, rays, near, far, image),
        "image and moments": lambda: kernels.project_with_moments(
            volume, size, rays, near, far, image, moments
        ),
        LOADS: lambda: load_only(volume, size, rays, near, far, image),
        ARITHMETIC: lambda: interpolate_only(corners, size, rays, near, far, image),
        "copy": lambda: np.copyto(target, block),
    }
    times = {name: each["median"] for name, each in take_turns(contestants).items()}
    copied = 2 * len(block) / times.pop("copy")
    return {
        "samples": int(counts.sum()),
        "voxels": int(volume.size),
        "seconds": times,
        "copied_bytes_per_second": copied,
    }


@contextmanager
def watched_kernels(found: dict[str, float]) -> Iterator[None]:
    """Add the seconds that this process spends inside the ray kernels to ``found``, {kernel: seconds}."""
    watched = [(kernels, "project"), (kernels, "project_with_moments"), (kernels, "project_warped")]
    watched += [(pose_kernels, "project_poses"), (pose_kernels, "project_poses_with_jacobian")]
    kept = [(module, name, getattr(module, name)) for module, name in watched]
    for module, name, function in kept:
        setattr(module, name, _timed(function, name, found))
    try:
        yield
    finally:
        for module, name, function in kept:
            setattr(module, name, function)


def _timed(function: Callable[..., Any], name: str, found: dict[str, float]) -> Callable[..., Any]:
    def run(*arguments: Any) -> Any:
        start = time.perf_counter()
        result = function(*arguments)
        found[name] = found.get(name, 0.0) + time.perf_counter() - start
        return result

    return run
