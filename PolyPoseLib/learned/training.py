"""Training of a camera regressor on renderings of one CT."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.learned import pose_code
from PolyPoseLib.learned.camera_model import CameraModel
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.image_loss import ImageLoss
from PolyPoseLib.learned.loss import geodesic_mm, projection_mm
from PolyPoseLib.learned.network import Architecture
from PolyPoseLib.learned.posed_scene import PosedScene
from PolyPoseLib.learned.samples import Batch, Sampler, training_batches, validation_batches
from PolyPoseLib.learned.training_state import TrainingState
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.registration.scene import Scene, body_points
from PolyPoseLib.rendering.select import select_backend
from PolyPoseLib.similarity.torch_threads import torch_threads

_LOG = logging.getLogger(__name__)

STAGE = "training"
WORST_MM = 100.0
"""A validation error counts as this at most, so that single views do not dominate."""


@dataclass(frozen=True)
class TrainingPlan:
    """How to train; the defaults suit two CPU cores and half an hour.

    Attributes
    ----------
    minutes : float, optional
        Longest wall time; no limit when None.
    steps : int
        Largest number of steps.
    side : int
        Pixels of the virtual detector.
    blocks, channels : tuple[int, int, int, int]
        Of the network.
    size_mm : float
        Voxels and steps of the renderings.
    renderings, copies : int
        Renderings of a step, and copies of each.
    learning_rate : float
        The largest one of the schedule.
    validate_every : int
        Steps between validations.
    validation_batches : int
        Batches of a validation, of `renderings` views each.
    patience : int
        Validations without a better one before the training ends early.
    geodesic_weight : float
        Of the geodesic, relative to the projection error.
    image_weight : float
        Of the image loss.
    image_from : float
        Share of the training from which the image loss counts.
    image_views : int
        Views of a step for which the image loss is computed.
    workers : int
        Processes that render, besides this one.
    threads : int
        CPU threads of the network.
    device : {"cpu", "cuda"}
        Of the network; renderings are made on the CPU.
    seed : int
        Of every random number.

    """

    minutes: float | None = 30.0
    steps: int = 1_000_000
    side: int = 64
    blocks: tuple[int, int, int, int] = (1, 1, 1, 1)
    channels: tuple[int, int, int, int] = (32, 64, 128, 256)
    size_mm: float = 6.0
    renderings: int = 16
    copies: int = 2
    learning_rate: float = 1e-3
    validate_every: int = 200
    validation_batches: int = 12
    patience: int = 15
    geodesic_weight: float = 0.2
    image_weight: float = 0.0
    image_from: float = 0.6
    image_views: int = 16
    workers: int = 0
    threads: int = 1
    device: str = "cpu"
    seed: int = 0

    def identity(self) -> dict[str, Any]:
        """What must not change between a checkpoint and its resumption: all but time, device, end and processes."""
        kept = asdict(self)
        for name in ("minutes", "steps", "workers", "threads", "device", "patience"):
            del kept[name]
        return {name: list(value) if isinstance(value, tuple) else value for name, value in kept.items()}


def train(
    scene: Scene,
    fingerprint: str,
    views: ViewRange,
    detector: VirtualDetector,
    plan: TrainingPlan,
    monitor: Monitor,
    checkpoint: Callable[[dict[str, Any]], None] | None = None,
    resume_from: dict[str, Any] | None = None,
) -> CameraModel:
    """Train until the time is over, the steps are done, or the validation has not improved for long.

    Parameters
    ----------
    scene : Scene
        The CT with its anchor.
    fingerprint : str
        Of the CT, by :func:`PolyPoseLib.learned.camera_model.ct_fingerprint`; goes into the model.
    views : ViewRange
        Cameras to train for.
    detector : VirtualDetector
        What X-rays are resampled to.
    plan : TrainingPlan
        How to train.
    monitor : Monitor
        Progress and cancelling.
    checkpoint : Callable[[dict[str, Any]], None], optional
        Called with plain values and tensors after every validation.
    resume_from : dict[str, Any], optional
        Such values of an earlier run to go on from; the result is that of a training without interruption.

    Returns
    -------
    CameraModel
        The weights of the smallest validation error.

    Raises
    ------
    InputError
        MONAI is missing, or the checkpoint belongs to another training.
    CancelledError
        The caller cancelled; the checkpoint remains.

    """
    with torch_threads(plan.threads):
        return _train(Trainer(scene, views, detector, plan), fingerprint, monitor, checkpoint, resume_from)


def _train(
    trainer: Trainer,
    fingerprint: str,
    monitor: Monitor,
    checkpoint: Callable[[dict[str, Any]], None] | None,
    resume_from: dict[str, Any] | None,
) -> CameraModel:
    """See :func:`train`."""
    views, detector, plan = trainer.sampler.views, trainer.sampler.detector, trainer.plan
    identity = {"fingerprint": fingerprint, "plan": plan.identity(), "detector": asdict(detector)}
    identity["views"] = {**asdict(views), "views": list(views.views)}
    if resume_from is not None:
        trainer.state.restore(resume_from, identity)
    state = trainer.state

    def validate() -> None:
        state.keep_if_best(trainer.validation_mm())
        _LOG.info("step %d: validation %.1f mm, best %.1f mm", state.step, trainer.last_mm, state.best_mm)
        if checkpoint is not None:
            checkpoint(state.checkpoint(identity))

    trainer.run(validate, monitor)
    if not state.best:
        validate()
    architecture = Architecture(len(views.views), plan.blocks, plan.channels)
    return CameraModel(fingerprint, views, detector, architecture, state.best, state.best_mm)


class Trainer:
    """The network with its data; see :func:`train`."""

    def __init__(self, scene: Scene, views: ViewRange, detector: VirtualDetector, plan: TrainingPlan) -> None:
        self.plan, self.last_mm = plan, float("nan")
        self.device = device = plan.device
        self.half_tangent, self.depth_mm = detector.half_tangent, views.distance_mm
        architecture = Architecture(len(views.views), plan.blocks, plan.channels)
        self.state = TrainingState.new(architecture, plan.learning_rate, plan.seed, device)
        posed = PosedScene.of(scene, plan.size_mm)
        self.sampler = Sampler(posed, views, detector, plan.seed, plan.renderings, plan.copies)
        self.centre = torch.as_tensor(scene.anchor_centre, dtype=torch.float64, device=device)
        self.rotations = torch.as_tensor(views.centres, dtype=torch.float64, device=device)
        points = body_points(posed.bodies[scene.anchor], 200)
        self.points = torch.as_tensor(points, dtype=torch.float64, device=device)
        self.radius_mm = float((self.points - self.centre).norm(dim=1).mean())
        single = Sampler(posed, views, detector, plan.seed, plan.renderings, 1)
        self.validation = validation_batches(single, plan.validation_batches)
        self.image_loss = None
        if plan.image_weight:
            backend = select_backend(self.sampler.kernel, "cpu", None)
            camera = detector.camera(np.eye(4))
            self.image_loss = ImageLoss.of(scene, camera, 9, plan.size_mm, backend)

    @property
    def share(self) -> float:
        """How much of the training is done, by time or by steps, 0 to 1."""
        by_time = self.state.seconds / (60 * self.plan.minutes) if self.plan.minutes else 0.0
        return min(1.0, max(by_time, self.state.step / self.plan.steps))

    def run(self, validate: Callable[[], None], monitor: Monitor) -> None:
        """Take steps until the plan's time, steps or patience run out."""
        state, plan = self.state, self.plan
        monitor.step(STAGE, int(1000 * self.share), 1000, None)
        batches = training_batches(self.sampler, state.step, plan.steps, plan.workers)
        waiting = next(batches, None)
        state.began = time.monotonic()  # the start-up does not count
        while waiting is not None and self.share < 1 and state.stagnant < plan.patience:
            batch = waiting
            if state.bfloat16 is None:
                state.bfloat16 = self._bfloat16_pays(batch.tensors(self.device)[0])
            self.step(batch)
            error = "" if math.isnan(self.last_mm) else f" ({self.last_mm:.1f} mm)"
            monitor.step(STAGE + error, int(1000 * self.share), 1000, None)
            if state.step % plan.validate_every == 0 or self.share >= 1:
                validate()
            waiting = next(batches, None) if self.share < 1 else None

    def step(self, batch: Batch) -> float:
        """Improve the network on one batch; returns the loss."""
        state = self.state
        # The renderer's threads become torch's where both share one OpenMP runtime, and wait for each other.
        torch.set_num_threads(self.plan.threads)
        for group in state.optimizer.param_groups:
            group["lr"] = self._learning_rate()
        state.network.train()
        loss = self.loss(batch)
        state.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(state.network.parameters(), 1.0)
        state.optimizer.step()
        state.average.update_parameters(state.network)
        state.step += 1
        return float(loss.detach())

    def loss(self, batch: Batch) -> Tensor:
        """Projection error and geodesic in units of 10 mm, wrong standard views, and images late in the training."""
        plan = self.plan
        images, true, views = batch.tensors(self.device)
        logits, codes = self._forward(self.state.network, images)
        predicted = self._decoded(codes[torch.arange(len(views)), views], views)
        apart = projection_mm(predicted, true, self.points)
        motion = geodesic_mm(predicted, true, self.centre, self.radius_mm)
        loss = (apart + plan.geodesic_weight * motion).mean() / 10
        if len(self.rotations) > 1:
            loss = loss + torch.nn.functional.cross_entropy(logits, views)
        if self.image_loss is not None and self.share >= plan.image_from:
            some = slice(0, plan.image_views)
            unlike = self.image_loss(predicted[some], images[some, 1], images[some, 2])
            loss = loss + plan.image_weight * unlike.mean()
        return loss

    def validation_mm(self) -> float:
        """Median projection error of the averaged network on the views kept for validation."""
        errors = []
        torch.set_num_threads(self.plan.threads)
        network = self.state.average.module.eval()
        with torch.no_grad():
            for batch in self.validation:
                images, true, _ = batch.tensors(self.device)
                logits, codes = self._forward(network, images)
                best = logits.argmax(1)
                predicted = self._decoded(codes[torch.arange(len(best)), best], best)
                errors.append(projection_mm(predicted, true, self.points))
        self.last_mm = float(torch.cat(errors).nan_to_num(nan=WORST_MM).clamp(max=WORST_MM).median())
        return self.last_mm

    def _decoded(self, codes: Tensor, views: Tensor) -> Tensor:
        """Cameras (B, 4, 4) of codes that refer to standard views (B,)."""
        return pose_code.decode(
            codes.double(), self.rotations[views], self.centre, self.half_tangent, self.depth_mm
        )

    def _forward(self, network: torch.nn.Module, images: Tensor) -> tuple[Tensor, Tensor]:
        """The network's answer, in the precision that was found to be faster."""
        with torch.autocast(self.device, torch.bfloat16, enabled=bool(self.state.bfloat16)):
            return network(images)

    def _bfloat16_pays(self, images: Tensor) -> bool:
        """Whether the network is clearly faster in bfloat16 here: on some processors it is, on others far slower."""
        seconds: dict[bool, list[float]] = {False: [], True: []}
        network = self.state.average.module.eval()
        with torch.no_grad():
            for half in (False, True) * 6:
                self.state.bfloat16 = half
                start = time.perf_counter()
                self._forward(network, images)[1].sum().item()
                seconds[half].append(time.perf_counter() - start)
        return min(seconds[True]) < 0.8 * min(seconds[False])

    def _learning_rate(self) -> float:
        """Rises over the first 2 % and falls as a cosine to a hundredth."""
        share = self.share
        return self.plan.learning_rate * min(
            1.0, share / 0.02 + 0.01, 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * share))
        )
