"""The published method (preset "paper"): gmNCC of the whole warped CT, maximised by Adam.

V. Gopalakrishnan et al., "PolyPose: deformable 2D/3D registration via polyrigid transformations", 2025. Each camera
is found from the anchor alone, cut out of the CT; then all poses jointly, on voxels of 4 mm, 2 mm and the CT's own
size, 51 iterations each. Details are those of the published program unless :class:`PaperOptions` says otherwise. What
differs for certain: poses turn about the structures' centroids (there, about the CT's centre), cameras are perturbed
in se(3) (there, in Euler angles), air is 0 at -1000 HU (there, at -800), a coarse level averages attenuation (there,
it resamples HU).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch

from PolyPoseLib.baselines.published.adam import Adam, pose_rates
from PolyPoseLib.baselines.published.objective import (
    PolyrigidObjective,
    View,
    gmncc_with_gradient,
    poses_of,
)
from PolyPoseLib.baselines.published.plateau import Plateaus
from PolyPoseLib.data.paper_options import PUBLISHED, PaperOptions
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.geometry.rigid import about
from PolyPoseLib.registration.fit.levels import Level, Observation, binned
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import JointResult, RigidProblem, State, corrected
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.warp.weights import distance_maps

LEVEL = Level(2.0, 14.0, 0)
"""Resolution at which the uncertainty of the found poses is computed."""

MAPS_BYTES = 3 << 27
"""Memory of the distance maps; they are made coarser to fit."""

PREVIEW_EVERY = 10


@dataclass(frozen=True)
class PaperLevel:
    """One step of the pyramid.

    Attributes
    ----------
    voxel_mm : float | None
        Of the CT, and distance of ray samples; None for the CT's own.
    iterations : int
        Of the optimiser.
    pixels : int
        X-rays are averaged to about this many a side.

    """

    voxel_mm: float | None
    iterations: int = 51
    pixels: int = 180


PAPER_LEVELS = (PaperLevel(4.0), PaperLevel(2.0), PaperLevel(None))

CAMERA_LEVELS = (PaperLevel(4.0, pixels=50), PaperLevel(2.0, pixels=100), PaperLevel(None, pixels=200))
"""Cameras start further off, so their images are coarse at first, as in the rigid registration that precedes the
paper's (its scales 24, 12 and 6 leave 52, 103 and 206 pixels)."""

PLATEAU_ITERATIONS = 500
"""At most, of a camera level that goes on until its similarity stays level."""

BONE_HU = 350.0
"""Above this the published program multiplies HU."""

SMALLEST_PIXELS = 17
"""A side of an image in which a patch of the blurred gradients fits."""


def find_camera_by_anchor(
    run: Run,
    ct: Volume,
    observation: Observation,
    levels: Sequence[PaperLevel] = CAMERA_LEVELS,
    options: PaperOptions = PUBLISHED,
) -> Camera:
    """Refine one X-ray's camera: Adam on a perturbation of se(3) about the anchor's centroid.

    The anchor, cut out of the CT, is compared with the whole X-ray.

    Parameters
    ----------
    run : Run
        The patient, the renderer and the monitor.
    ct : Volume
        In HU.
    observation : Observation
        The X-ray with its initial camera.
    levels : sequence of PaperLevel
        Coarse to fine.
    options : PaperOptions
        With ``camera_plateaus`` every level has an Adam of its own and at most PLATEAU_ITERATIONS iterations, whatever
        its own number; step sizes start at 1, 1/2, 1/8, ... of the usual ones.

    Returns
    -------
    Camera
        The refined one.

    """
    adam, parameters = Adam(pose_rates()), np.zeros(6)
    if options.camera_plateaus:
        levels = [replace(level, iterations=PLATEAU_ITERATIONS) for level in levels]
    total, done, divisor = sum(level.iterations for level in levels), 0, 1.0
    for number, level in enumerate(levels):
        plateaus, divisor = Plateaus(), divisor * 2**number
        if options.camera_plateaus:
            adam = Adam(pose_rates() / divisor)
        view = view_of(observation, level.pixels)
        score = gmncc_with_gradient(view.image, view.mask)
        body = anchor_body(ct, run.scene, level.voxel_mm)
        for iteration in range(level.iterations):
            vector = torch.as_tensor(parameters)
            pose = about(se3.exp(vector).numpy(), body.centre)
            step = sample_distance(ct, level)
            part = project_body(body, view.camera, pose, step, run.backend, jacobian=True)
            image = np.zeros(view.image.shape, np.float32)
            image[part.slices] = part.image
            similarity, slope = score(image)
            run.at_level(voxel_size(ct, level)).step(done + iteration, total, similarity)
            assert part.jacobian is not None, "it was asked for"
            by_left = np.tensordot(part.jacobian, slope[part.slices], 2)
            parameters = adam.ascend(parameters, se3.left_jacobian(vector).numpy().T @ by_left)
            if options.camera_plateaus:
                plateaus.after(similarity)
                adam.rates = pose_rates() / divisor * plateaus.factor
                if plateaus.over:
                    break
        done += level.iterations
    correction = about(se3.exp(torch.as_tensor(parameters)).numpy(), run.scene.anchor_centre)
    return corrected(observation.camera, correction)


def fit_structures_by_gmncc(
    run: Run,
    ct: Volume,
    observations: Sequence[Observation],
    optimizer: str = "adam",
    levels: Sequence[PaperLevel] = PAPER_LEVELS,
    options: PaperOptions = PUBLISHED,
) -> JointResult:
    """Fit all structures, or all but the anchor, from rest, with the cameras held.

    Parameters
    ----------
    run : Run
        The patient with the weights' frame and form, the renderer and the monitor.
    ct : Volume
        In HU.
    observations : sequence of Observation
        The X-rays with their cameras.
    optimizer : str
        "adam", or "lm" for Levenberg-Marquardt on the same objective.
    levels : sequence of PaperLevel
        Coarse to fine, at least one.
    options : PaperOptions
        The anchor, restarts of Adam, attenuation of bone, blur of gradients.

    Returns
    -------
    JointResult
        Its problem is that of the default method at these poses, for their uncertainty.

    """
    run, scene = run.named("bones"), run.scene
    maps = distance_maps(scene.structures, scene.ct_affine, budget_bytes=MAPS_BYTES)
    warp = run.soft_tissue.warp(maps, scene.rest_poses)
    parameters = np.zeros((len(scene.names), 6))
    adam = Adam(pose_rates())
    total, done = sum(level.iterations for level in levels), 0

    def report(run: Run, before: int, iteration: int, parameters: np.ndarray, similarity: float) -> None:
        number, field = before + iteration, None
        if number % PREVIEW_EVERY == 0:
            field = partial(run.soft_tissue.coarse_field, poses_of(parameters, scene.centres))
        run.step(number, total, similarity, field)

    for level in levels:
        views = [view_of(each, level.pixels) for each in observations]
        grid = attenuation_grid(ct, level.voxel_mm, options.bone_multiplier)
        objective = PolyrigidObjective(run, grid, warp, views, sample_distance(ct, level), options)
        adam = Adam(pose_rates()) if options.restart_adam else adam
        said = partial(report, run.at_level(voxel_size(ct, level)), done)
        if optimizer == "lm":
            parameters = _minimised(objective, parameters, level.iterations, said)
        else:
            for iteration in range(level.iterations):
                similarity, gradient = objective(parameters)
                said(iteration, parameters, similarity)
                if options.anchor == "held":
                    gradient[scene.anchor] = 0
                parameters = adam.ascend(parameters, gradient)
        done += level.iterations
    state = State.of_poses(poses_of(parameters, scene.centres), len(observations))
    problem = rigid_problem_at(run, observations, state)
    return JointResult([each.camera for each in observations], problem, state)


def _minimised(
    objective: PolyrigidObjective,
    parameters: np.ndarray,
    iterations: int,
    report: Callable[[int, np.ndarray, float], None],
) -> np.ndarray:
    """Parameters (K, 6) after Levenberg-Marquardt."""

    def before_step(parameters: np.ndarray, iteration: int, cost: float) -> None:
        report(iteration, parameters, 1 - cost / 2 if iteration else objective.value(parameters))

    return minimise(objective, parameters, SolverOptions(iterations), before_step).state


def view_of(observation: Observation, pixels: int) -> View:
    """The X-ray at about ``pixels`` a side, with its camera."""
    height, width = observation.image.shape
    factor = max(1, min(round(max(height, width) / pixels), min(height, width) // SMALLEST_PIXELS))
    image, mask = binned(observation.image, observation.mask, factor)
    return View(image, mask, observation.camera.binned(factor))


def voxel_size(ct: Volume, level: PaperLevel) -> float:
    """Size of a level's voxels in mm."""
    return level.voxel_mm or float(np.min(ct.spacing))


def sample_distance(ct: Volume, level: PaperLevel) -> float:
    """Distance of ray samples in mm; at the CT's own voxels no larger than at 2 mm ones."""
    return level.voxel_mm or min(2.0, float(np.min(ct.spacing)))


def attenuation_grid(ct: Volume, voxel_mm: float | None, bone_multiplier: float = 1.0) -> Grid:
    """The CT in 1/mm at voxels of about ``voxel_mm``, or its own, with a border of zeros.

    bone_multiplier: of HU above BONE_HU.
    """
    if voxel_mm is not None:
        mu = attenuation(ct.voxels, bone_multiplier).astype(np.float32, copy=False)
        return Grid(mu, ct.affine).coarsened(voxel_mm).padded()
    voxels = np.zeros(np.array(ct.voxels.shape) + 2, np.float32)
    for k, slab in enumerate(ct.voxels, start=1):  # no second copy of a large CT
        voxels[k, 1:-1, 1:-1] = attenuation(slab, bone_multiplier)
    affine = ct.affine.copy()
    affine[:3, 3] -= affine[:3, :3] @ np.ones(3)
    return Grid(voxels, affine)


def attenuation(hu: np.ndarray, bone_multiplier: float) -> np.ndarray:
    """Attenuation in 1/mm of HU, those above BONE_HU multiplied first; an array of the same shape."""
    if bone_multiplier != 1:
        hu = np.where(hu > BONE_HU, np.float32(bone_multiplier) * hu, hu)
    return hounsfield_to_attenuation(hu)


def anchor_body(ct: Volume, scene: Scene, voxel_mm: float | None) -> Body:
    """The anchor cut out of the CT, at voxels of about ``voxel_mm`` or its own."""
    mask = scene.structures.labels == scene.anchor + 1
    occupied = [np.flatnonzero(mask.any(axis=axes)) for axes in ((1, 2), (0, 2), (0, 1))]
    box = tuple(slice(int(o[0]), int(o[-1]) + 1) for o in occupied)
    mu = (hounsfield_to_attenuation(ct.voxels[box]) * mask[box]).astype(np.float32)
    affine = ct.affine.copy()
    affine[:3, 3] += affine[:3, :3] @ np.array([s.start for s in reversed(box)], float)
    grid = Grid(mu, affine)
    grid = (grid if voxel_mm is None else grid.coarsened(voxel_mm)).padded()
    return Body(grid.voxels, grid.affine, scene.anchor_centre)


def rigid_problem_at(run: Run, observations: Sequence[Observation], state: State) -> RigidProblem:
    """All structures but the anchor as rigid bodies in front of soft tissue that follows ``state``.

    The poses need not be its optimum: residuals that they leave count as noise, and widen the intervals.
    """
    views = LevelViews(run, observations, LEVEL)
    problem = views.structures(run.scene.moving)
    views.render_soft_tissue(state)
    views.weigh_structures(problem, state)
    return problem
