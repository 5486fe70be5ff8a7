"""What moves and renders soft tissue and warps volumes, timed part by part: torch on a device, and compiled loops."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import torch
from memory_phantom import draw, draw_poses

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.soft_jacobian import SoftJacobian
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.outputs import TRANSFORM_MM, transform_grid
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.select import torch_device_of
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.simulation.simulate import view_cameras
from PolyPoseLib.warp.dense import displacement_field, jacobian_determinant, warp_labels, warp_volume
from PolyPoseLib.warp.inverse import invert_field
from PolyPoseLib.warp.weights import DistanceMaps, distance_maps

SHAPE = (128, 160, 160)
"""Voxels of the CT with 26 structures."""

SOFT_MM, REACH_MM, PIXELS = 3.0, 40.0, 160
"""Finest level at which soft tissue moves by itself, reach of a bone's rotation, and pixels of a view there."""

REPEATS = 3

NAMES = {
    "field": "polyrigid field of the transform",
    "ct": "warped CT",
    "labels": "warped labels",
    "inverse": "inverse of the transform",
    "determinants": "its Jacobian determinants",
    "soft_field": "field that soft tissue follows",
    "soft_motion": "its own motion added",
    "soft_image": "its rendering",
    "soft_derivative": "derivative of its rendering",
}


def parts(device: str) -> dict[str, dict[str, float]]:
    """Seconds of every part, {part: {backend: seconds}}."""
    ct, structures = draw(shape=SHAPE)
    scene = Scene(ct, structures, structures.names[0])
    each = draw_poses(0)
    poses = np.stack([each[name] for name in scene.names])
    maps = distance_maps(structures, ct.affine)
    times: dict[str, dict[str, float]] = {name: {} for name in NAMES}
    for backend in (TorchBackend(device), NumbaBackend()):
        for name, action in actions(scene, maps, ct, poses, backend).items():
            times[name][backend.name] = seconds_of(action, device, REPEATS)
    return times


def actions(
    scene: Scene, maps: DistanceMaps, ct: Volume, poses: np.ndarray, backend: Backend
) -> dict[str, Callable[[], object]]:
    """What is timed on a backend, in the order of NAMES."""
    device = torch_device_of(backend)
    soft = SoftTissue(scene, rotation_reach_mm=REACH_MM, device=device)
    maps = maps.to(device)
    camera = view_cameras(ct, (0.0,), PIXELS)[0]
    labels = Volume(scene.structures.labels, ct.affine)
    affine, shape, _ = transform_grid(ct, TRANSFORM_MM)
    field = displacement_field(soft.warp(maps, poses), affine, shape, device=device)
    following = soft.following(poses)
    freedom = soft.freedom(following)
    rng = np.random.default_rng(0)
    moving = soft.with_motion(rng.normal(0, np.sqrt(soft.modes.variances)[:, None], (soft.modes.count, 3)))
    moved = moving.moved(following, freedom)
    # The soft tissue keeps the fields of its latest poses: each time it gets others.
    turns = iter(range(1, 1 << 30))

    def follow() -> object:
        shifted = poses.copy()
        shifted[1:, 0, 3] += 1e-3 * next(turns)
        return soft.freedom(soft.following(shifted))

    return {
        "field": lambda: displacement_field(soft.warp(maps, poses), affine, shape, device=device),
        "ct": lambda: warp_volume(ct, field, device=device),
        "labels": lambda: warp_labels(labels, field, device=device),
        "inverse": lambda: invert_field(field, device=device),
        "determinants": lambda: jacobian_determinant(field, device),
        "soft_field": follow,
        "soft_motion": lambda: moving.moved(following, freedom),
        "soft_image": lambda: soft.render(moved, camera, np.eye(4), SOFT_MM, backend),
        "soft_derivative": lambda: derivative(soft, SoftJacobian(moving, moved, freedom, SOFT_MM), camera),
    }


def derivative(soft: SoftTissue, jacobian: SoftJacobian, camera: Camera) -> object:
    """Left where it is computed: the fit takes only sums of it from a device."""
    make = jacobian.of_view if soft.device is None else jacobian.on_device
    return make(camera, np.eye(4))


def seconds_of(action: Callable[[], object], device: str, repeats: int) -> float:
    """Median seconds of an action; the first time does not count."""
    times = []
    for _ in range(repeats + 1):
        start = time.perf_counter()
        action()
        if device == "cuda":
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return float(np.median(times[1:]))


def part_lines(times: dict[str, dict[str, float]]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of the table, in ms."""
    backends = list(next(iter(times.values())))
    rows = [[NAMES[name], *(f"{1e3 * times[name][each]:.1f}" for each in backends)] for name in NAMES]
    return ["ms", *backends], rows
