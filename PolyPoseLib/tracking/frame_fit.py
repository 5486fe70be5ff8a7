"""One frame: all structures fitted to its X-rays from a starting pose each, coarse to fine.

The fit takes place in the world in which the reference structure's starting pose is the identity, whatever the rig's
world is: there the soft tissue, which is interpolated between the structures' motions, has small motions to follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between, rigid_inverse
from PolyPoseLib.geometry.windows import Window
from PolyPoseLib.registration.bones.agreement import Agreement, agreement_in
from PolyPoseLib.registration.fit.device_problem import as_solved
from PolyPoseLib.registration.fit.levels import COMPARISON_LEVEL, Level, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.levenberg_marquardt import SolverOptions, minimise
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.views import REACH_MM, LevelViews
from PolyPoseLib.registration.fit.weighting import region_around, robust_weight
from PolyPoseLib.rendering.rigid import footprint
from PolyPoseLib.tracking.patient import Patient, cropped, seen_from

COARSE = replace(COMPARISON_LEVEL, iterations=8)
"""At which a prediction is corrected, and structures are compared with the X-rays."""

FINE = Level(1.2, 10.0, 8)

FOLLOWING = (COARSE, FINE)
"""Levels of a frame whose poses are predicted from those beside it."""

ARRIVING = (Level(6.0, 40.0, 20, 0.01), Level(3.0, 20.0, 15, 0.002), FINE)
"""Levels of a frame without one beside it: from several pixels of an X-ray away."""

TOLERANCE, DAMPING = 1e-6, 1e-4
"""Of the solver: along the beam of a single view the cost is so flat that it would stop, or be slowed, elsewhere."""

REFRESH_EVERY = 4
"""Iterations after which weights are renewed."""

SOFT_TISSUE_PX = 0.5
"""Motion, in pixels, after which the soft tissue is rendered again."""

LARGEST_TURN_DEG = 165.0
"""Against the reference, of bones as the soft tissue follows them."""

BLANK = 0.02
"""Share of an X-ray's pixels around which anything is to be seen, up to which it is blank."""

BLANK_PIXELS = 100
"""Rows or columns of an X-ray that are looked at for that."""

STANDS_OUT = 3.0
"""Standard deviations of noise beyond which contrast is something to be seen."""


@dataclass(frozen=True)
class FrameFit:
    """What a fit of one frame found.

    Attributes
    ----------
    poses : (K, 4, 4) ndarray
        The rig's world to moving.
    problem, state
        Of the finest level, in a world of their own.
    agreement : Agreement
        Of the K structures with the X-rays that are not blank.
    names : tuple of str
        Of these X-rays.

    """

    poses: np.ndarray
    problem: RigidProblem
    state: State
    agreement: Agreement
    names: tuple[str, ...]


class Frame:
    """The X-rays of one frame.

    Parameters
    ----------
    patient : Patient
        What they are compared with.
    number : int
        Of the frame in the sequence.

    Attributes
    ----------
    observations : list of Observation
        In the rig's world, without those that are blank.
    shown : list of int
        Numbers of their views.

    """

    def __init__(self, patient: Patient, number: int) -> None:
        self.patient, self.number = patient, number
        every = patient.observations(number)
        self.shown = [n for n, each in enumerate(every) if not is_blank(each)]
        self.observations = [every[n] for n in self.shown]

    def fit(self, start: np.ndarray, levels: Sequence[Level], free: Sequence[int]) -> FrameFit:
        """Fit the structures ``free`` from poses (K, 4, 4); there must be an X-ray that is not blank."""
        base = start[self.patient.reference]
        observations = self.around([start], base)
        fits: dict[Level, LevelFit] = {}
        state = State.of_poses(start @ rigid_inverse(base), len(observations))
        for level in levels:
            fits[level] = LevelFit(self.patient, observations, level, free)
            state = fits[level].fit(state)
        compared = fits.get(COARSE) or LevelFit(self.patient, observations, COARSE, ())
        compared.refresh(state)
        finest = fits[levels[-1]]
        agreement = agreement_in(compared.problem, state)
        names = tuple(self.patient.sequence.views[n].name for n in self.shown)
        return FrameFit(state.poses @ base, finest.problem, state, agreement, names)

    def posed(self, poses: np.ndarray) -> tuple[RigidProblem, State]:
        """All structures at poses (K, 4, 4), as they are compared with the X-rays, in a world of their own."""
        base = poses[self.patient.reference]
        compared = LevelFit(self.patient, self.around([poses], base), COARSE, ())
        state = State.of_poses(poses @ rigid_inverse(base), len(self.observations))
        compared.follow(state)
        return compared.problem, state

    def around(self, starts: Sequence[np.ndarray], base: np.ndarray) -> list[Observation]:
        """The X-rays in a base's world, cropped to where the structures are at any of some poses (K, 4, 4)."""
        scene = self.patient.scene
        found = []
        for each, near in zip(self.observations, seen_from(self.observations, base), strict=True):
            pixel = pixel_size_mm(near.camera, scene.anchor_centre)
            margin = int(np.ceil((REACH_MM + COARSE.patch_mm) / pixel))
            windows = [
                footprint(body, each.camera, pose)
                for poses in starts
                for body, pose in zip(scene.bodies(COARSE.size_mm), poses, strict=True)
            ]
            found.append(_cropped_to(near, windows, margin))
        return found


class LevelFit:
    """The X-rays at one resolution, with weights and soft tissue that follow the state."""

    def __init__(
        self, patient: Patient, observations: Sequence[Observation], level: Level, free: Sequence[int]
    ) -> None:
        self.patient, self.level = patient, level
        self.views = LevelViews(patient.run, observations, level)
        # Along the beam of a single view, nothing else tells how well a pose is known.
        self.problem = self.views.structures(list(free))
        self._rendered: np.ndarray | None = None

    def fit(self, state: State) -> State:
        """The state at the level's optimum."""

        def before_step(now: State, iteration: int, _cost: float) -> None:
            if iteration % REFRESH_EVERY == 0:
                self.refresh(now)

        options = SolverOptions(self.level.iterations, TOLERANCE, DAMPING)
        return minimise(as_solved(self.problem), state, options, before_step).state

    def refresh(self, state: State) -> None:
        """Renew the weights, and the soft tissue where bones moved."""
        self.follow(state)
        for n, view in enumerate(self.problem.views):
            region = region_around(self.problem, state, n, range(len(state.poses)), REACH_MM)
            view.weight = robust_weight(view, self.problem.residual(state, n), region)

    def follow(self, state: State) -> None:
        """Render the soft tissue anew where bones moved since it was."""
        if self._rendered is not None and self._moved(state.poses) <= SOFT_TISSUE_PX * self.level.size_mm:
            return
        if self.patient.has_soft_tissue:
            poses = with_limited_rotations(state.poses, self.patient.scene.centres)
            self.views.render_soft_tissue(State(poses, state.corrections))
        self._rendered = state.poses

    def _moved(self, poses: np.ndarray) -> float:
        """How far (mm) the corners of structures moved since the soft tissue was rendered."""
        assert self._rendered is not None
        shifts = [
            np.abs((pose - before) @ np.c_[body.corners, np.ones(8)].T).max()
            for body, pose, before in zip(self.problem.bodies, poses, self._rendered, strict=True)
        ]
        return float(max(shifts))


def with_limited_rotations(poses: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Poses (K, 4, 4) whose rotations about the centroids (K, 3) are at most LARGEST_TURN_DEG.

    The soft tissue between bones half a turn apart has no direction to turn in, and its warp refuses them: a hand
    against the upper arm, or a bone that is lost.
    """
    limited = poses.copy()
    for k, pose in enumerate(poses):
        step = perturbation_between(np.eye(4), pose, centres[k])
        angle = float(np.degrees(np.linalg.norm(step[:3])))
        if angle > LARGEST_TURN_DEG:
            step[:3] *= LARGEST_TURN_DEG / angle
            limited[k] = about(perturbation(step), centres[k])
    return limited


def is_blank(observation: Observation) -> bool:
    """Whether an X-ray shows nothing, wherever the patient is: no exposure, a closed shutter, a frame that was dropped.

    True where hardly a pixel differs from those a few hundredths of the image away by more than noise.
    """
    factor = max(1, min(observation.image.shape) // BLANK_PIXELS)
    values = observation.image[::factor, ::factor]
    used = observation.mask[::factor, ::factor]
    if used.sum() < 64:
        return True
    noise = observation.noise[::factor, ::factor]
    across = np.abs(values[:, 3:] - values[:, :-3]), used[:, 3:] & used[:, :-3], noise[:, 3:]
    down = np.abs(values[3:] - values[:-3]), used[3:] & used[:-3], noise[3:]
    differences, pairs, noises = (
        np.concatenate([a.ravel(), b.ravel()]) for a, b in zip(across, down, strict=True)
    )
    threshold = STANDS_OUT * np.sqrt(2.0) * noises + 0.01
    return not pairs.any() or float((differences > threshold)[pairs].mean()) < BLANK


def _cropped_to(observation: Observation, windows: Sequence[Window], margin: int) -> Observation:
    """The part of an X-ray that holds all windows, and a margin (px); the whole where they are outside."""
    camera = observation.camera
    inside = [w for w in windows if w[1] > w[0] and w[3] > w[2]]
    if not inside:
        return observation
    row0, column0 = (max(min(w[i] for w in inside) - margin, 0) for i in (0, 2))
    row1 = min(max(w[1] for w in inside) + margin, camera.height)
    column1 = min(max(w[3] for w in inside) + margin, camera.width)
    return cropped(observation, slice(row0, row1), slice(column0, column1))
