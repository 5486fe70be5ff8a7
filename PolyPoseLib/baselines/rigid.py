"""One rigid body: the whole CT in one motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from PolyPoseLib.baselines.known_views import FIELD_MM, known_views
from PolyPoseLib.baselines.published.adam import Adam, pose_rates
from PolyPoseLib.baselines.published.method import (
    CAMERA_LEVELS,
    PLATEAU_ITERATIONS,
    PaperLevel,
    attenuation_grid,
    sample_distance,
    view_of,
)
from PolyPoseLib.baselines.published.objective import gmncc_with_gradient
from PolyPoseLib.baselines.published.plateau import Plateaus
from PolyPoseLib.baselines.published.projector import ImageScore
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about, rigid_inverse
from PolyPoseLib.registration.cameras.initial import Regressor
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.outputs import transform_grid
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.similarity.torch_threads import torch_threads
from PolyPoseLib.warp.field_grids import flat_points

LoadModel = Callable[[Study, Path], Regressor]
"""Reads a camera model for a study, such as :func:`PolyPoseLib.pipeline.camera_regressor`."""


class Rigid:
    """The rigid registration that precedes the published method (xvr), with known cameras.

    There a network proposes a camera for one X-ray, which is refined by the rendered CT. Here the cameras are given, so
    that what remains is one motion of the whole CT, fitted to all X-rays together: gmNCC without a blur, X-rays of
    about 50, 100 and 200 pixels, for each level a new Adam with step sizes of 0.01 rad and 1 mm, halved at the second
    level and an eighth at the third, which go on until the similarity stays level. Rotations are about the CT's middle
    and in se(3) (there, Euler angles); the CT is coarser for coarse X-rays (there, it never is), which saves time.

    Parameters
    ----------
    load_model : callable, optional
        Reads the file that a setting's weights name for "rigid": a camera model that this program trained for the CT.
        The motions by which its cameras differ from the given ones are then tried as a start, beside rest.

    References
    ----------
    github.com/eigenvivek/xvr, src/xvr/registrar/base.py; V. Gopalakrishnan et al., "Rapid patient-specific neural
    networks for intraoperative X-ray to volume registration", 2025.

    """

    name = "rigid"
    needs: tuple[str, ...] = ()

    def __init__(self, load_model: LoadModel | None = None) -> None:
        self.load_model = load_model

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """See :class:`PolyPoseLib.data.benchmark.system.System`; every structure has the same pose."""
        observations = known_views(study)
        with torch_threads(setting.threads):
            backend = select_backend("auto", setting.device, setting.threads)
            starts = [np.eye(4), *self._learned(study, setting, observations)]
            pose, chosen = _fitted(study.ct, observations, starts, backend, setting)
        start = "rest" if chosen == 0 else "the camera model"
        poses = {name: pose.copy() for name in study.structures.names}
        return Motion(
            field_of(pose, study.ct), poses, (f"{backend.name}, torch {torch.__version__}", f"from {start}")
        )

    def _learned(
        self, study: Study, setting: SystemSetting, observations: Sequence[Observation]
    ) -> list[np.ndarray]:
        """Motions (4, 4) that a camera model proposes, by X-ray."""
        path = setting.weights.get(self.name)
        if path is None:
            return []
        if self.load_model is None:
            raise InputError(
                'This use of the system "rigid" reads no camera models: leave out its weights, or run it by "polypose '
                'benchmark".'
            )
        model = self.load_model(study, path)
        return [
            rigid_inverse(camera.extrinsic) @ each.camera.extrinsic
            for xray, each in zip(study.xrays, observations, strict=True)
            if model.covers(xray)
            for camera in model.starts(xray)
        ]


def field_of(pose: np.ndarray, ct: Volume) -> DisplacementField:
    """The displacement field of a rigid motion (4, 4), fixed to moving, over the CT."""
    affine, shape, _ = transform_grid(ct, FIELD_MM)
    points = flat_points(affine, shape, 0, int(np.prod(shape)))
    vectors = points @ (pose[:3, :3] - np.eye(3)).T + pose[:3, 3]
    return DisplacementField(vectors.reshape(*shape, 3), affine)


@dataclass(frozen=True)
class _LevelScore:
    """The similarity of one body with all X-rays, at one level."""

    body: Body
    cameras: Sequence[Camera]
    scores: Sequence[ImageScore]
    sizes: Sequence[tuple[int, int]]
    step_mm: float
    backend: Backend

    @classmethod
    def of(
        cls, ct: Volume, observations: Sequence[Observation], level: PaperLevel, backend: Backend
    ) -> _LevelScore:
        views = [view_of(each, level.pixels) for each in observations]
        grid = attenuation_grid(ct, level.voxel_mm)
        return cls(
            Body(grid.voxels, grid.affine, middle(ct)),
            [view.camera for view in views],
            [gmncc_with_gradient(view.image, view.mask) for view in views],
            [view.image.shape for view in views],
            sample_distance(ct, level),
            backend,
        )

    def __call__(self, pose: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean similarity, and its derivative (6,) by the pose's perturbation about the CT's middle."""
        total, slopes = 0.0, np.zeros(6)
        for camera, score, size in zip(self.cameras, self.scores, self.sizes, strict=True):
            part = project_body(self.body, camera, pose, self.step_mm, self.backend, jacobian=True)
            image = np.zeros(size, np.float32)
            image[part.slices] = part.image
            similarity, slope = score(image)
            assert part.jacobian is not None, "it was asked for"
            slopes += np.tensordot(part.jacobian, slope[part.slices], 2) / len(self.cameras)
            total += similarity / len(self.cameras)
        return total, slopes


def middle(ct: Volume) -> np.ndarray:
    """The middle (3,) of a CT in LPS mm."""
    return ct.affine[:3, :3] @ ((np.array(ct.shape[::-1]) - 1) / 2) + ct.affine[:3, 3]


def _fitted(
    ct: Volume,
    observations: Sequence[Observation],
    starts: Sequence[np.ndarray],
    backend: Backend,
    setting: SystemSetting,
) -> tuple[np.ndarray, int]:
    """The motion (4, 4) from the best of the starts, and which of them it was."""
    parameters, chosen, divisor = np.zeros(6), 0, 1.0
    total, centre = PLATEAU_ITERATIONS * len(CAMERA_LEVELS), middle(ct)
    for number, level in enumerate(CAMERA_LEVELS):
        score, plateaus, divisor = (
            _LevelScore.of(ct, observations, level, backend),
            Plateaus(),
            divisor * 2**number,
        )
        if number == 0 and len(starts) > 1:
            chosen = int(np.argmax([score(start)[0] for start in starts]))
            at_middle = starts[chosen].copy()
            at_middle[:3, 3] += at_middle[:3, :3] @ centre - centre
            parameters = se3.log(torch.as_tensor(at_middle)).numpy()
        adam = Adam(pose_rates() / divisor)
        for iteration in range(PLATEAU_ITERATIONS):
            if setting.cancelled():
                raise CancelledError("The fit was cancelled.")
            vector = torch.as_tensor(parameters)
            similarity, slope = score(about(se3.exp(vector).numpy(), centre))
            parameters = adam.ascend(parameters, se3.left_jacobian(vector).numpy().T @ slope)
            setting.progress(number * PLATEAU_ITERATIONS + iteration, total, similarity)
            plateaus.after(similarity)
            adam.rates = pose_rates() / divisor * plateaus.factor
            if plateaus.over:
                break
    return about(se3.exp(torch.as_tensor(parameters)).numpy(), centre), chosen
