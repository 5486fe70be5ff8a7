"""The training of a network on pairs with a known motion: loop, held-out error, checkpoints."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from PolyPoseLib.baselines.trained.trained_weights import SIDES, TrainedWeights
from PolyPoseLib.baselines.trained.training_pairs import PreparedPair
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.errors import InputError
from PolyPoseLib.similarity.torch_threads import torch_threads

_LOG = logging.getLogger(__name__)

STAGE = "training"
DECAY, DECAY_EPOCHS = 0.8, 30
"""The learning rate falls by this factor every so many passes over the training set, as in the published code."""

LEAST_GAIN = 0.02
"""Share of the held-out error, of doing nothing and of the untrained network, that a training must take away. The
weights kept are the best of hundreds of looks at few pairs, and a network that has learned nothing hardly moves
anything: some look falls below doing nothing by microns. The small trainings that were measured, and beat doing nothing
in tests, took 4 % and more."""


@dataclass(frozen=True)
class TrainingPlan:
    """How to train.

    Attributes
    ----------
    minutes : float, optional
        Longest wall time; no limit when None.
    steps : int
        Largest number of steps.
    batch : int
        Pairs of a step.
    learning_rate : float
        Of Adam, at first.
    components : int
        Principal components of LiftReg, at most.
    gradient_weight : float
        Of the penalty on the displacement's gradient.
    validate_every : int
        Steps between two looks at the held-out pairs.
    seed : int
        Of the first weights and the order of the pairs.
    threads : int
        Of the processor.
    device : str
        "cpu" or "cuda".

    """

    minutes: float | None = 30.0
    steps: int = 1_000_000
    batch: int = 4
    learning_rate: float = 1e-3
    components: int = 56
    gradient_weight: float = 0.01
    validate_every: int = 50
    seed: int = 0
    threads: int = 1
    device: str = "cpu"

    def __post_init__(self) -> None:
        """Check the ranges; raises InputError."""
        for name in ("steps", "batch", "components", "validate_every", "threads"):
            if getattr(self, name) < 1:
                raise InputError(f"The training's {name} is {getattr(self, name)}: give 1 or more.")
        if not (self.minutes is None or self.minutes > 0) or not self.learning_rate > 0:
            raise InputError("The training's minutes and learning rate must be above 0.")

    def identity(self) -> dict[str, Any]:
        """What must not change between a checkpoint and its resumption."""
        return {
            name: value
            for name, value in asdict(self).items()
            if name not in ("minutes", "steps", "threads", "device")
        }


class TrainedMethod(Protocol):
    """What tells one trained system from another."""

    name: str

    def new_network(self, pairs: TrainingSet, plan: TrainingPlan) -> nn.Module:
        """An untrained network; its random numbers are torch's. Called with CTs (B, 1, ...) and X-rays (B, V, ...)."""
        ...

    def loss(self, displacement: Tensor, pair: PreparedPair, plan: TrainingPlan) -> Tensor:
        """Of a displacement (1, 3, k, j, i) that the network found for a pair."""
        ...


@dataclass
class TrainingState:
    """The network, its optimizer, and how far the training is."""

    network: nn.Module
    optimizer: torch.optim.Optimizer
    step: int = 0
    earlier_seconds: float = 0.0
    best_mm: float = math.inf
    best: dict[str, Tensor] = field(default_factory=dict)
    history: list[dict[str, float]] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)
    began: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        """Time that the training has taken, interruptions left out."""
        return self.earlier_seconds + time.monotonic() - self.began

    def checkpoint(self, identity: dict[str, Any]) -> dict[str, Any]:
        """Plain values and tensors to go on from."""
        return {
            "identity": identity,
            "network": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
            "best_mm": self.best_mm,
            "best": self.best,
            "history": self.history,
            "losses": self.losses,
        }

    def restore(self, fields: dict[str, Any], identity: dict[str, Any]) -> None:
        """Go on from a checkpoint; raises InputError when it belongs to another training or is damaged."""
        if fields.get("identity") != identity:
            raise InputError(
                "The checkpoint belongs to another training set, system or plan: leave out --resume, or choose "
                "another --output."
            )
        try:
            self.network.load_state_dict(fields["network"])
            self.optimizer.load_state_dict(fields["optimizer"])
            self.step, self.earlier_seconds = int(fields["step"]), float(fields["seconds"])
            self.best_mm, self.best = float(fields["best_mm"]), dict(fields["best"])
            self.history, self.losses = list(fields["history"]), list(fields["losses"])
        except (KeyError, TypeError, ValueError, RuntimeError, AttributeError) as error:
            raise InputError("The checkpoint is damaged: leave out --resume.") from error
        self.began = time.monotonic()


@dataclass(frozen=True)
class Training:
    """One training, as a whole; :meth:`run` does it.

    Attributes
    ----------
    method : TrainedMethod
        LiftReg or RegNet.
    pairs : TrainingSet
        What it learns from.
    plan : TrainingPlan
        How.
    checkpoint : Callable, optional
        Called with plain values and tensors after every look at the held-out pairs.

    """

    method: TrainedMethod
    pairs: TrainingSet
    plan: TrainingPlan
    checkpoint: Callable[[dict[str, Any]], None] | None = None

    def run(self, monitor: Monitor, resume_from: dict[str, Any] | None = None) -> TrainedWeights:
        """Train until the time or the steps are over.

        Parameters
        ----------
        monitor : Monitor
            Progress and cancelling.
        resume_from : dict, optional
            What `checkpoint` was called with; the result is that of a training without interruption.

        Returns
        -------
        TrainedWeights
            Those of the smallest held-out error; its report has the curve.

        Raises
        ------
        InputError
            The checkpoint belongs to another training, or the grid's side does not fit the networks.
        CancelledError
            The caller cancelled; the last checkpoint remains.

        """
        if self.pairs.side not in SIDES:
            raise InputError(f"The grid's side is {self.pairs.side}: give a multiple of 16 from 16 to 256.")
        with torch_threads(self.plan.threads), torch.random.fork_rng(devices=[]):
            torch.manual_seed(self.plan.seed)
            network = self.method.new_network(self.pairs, self.plan).to(self.plan.device)
            optimizer = torch.optim.Adam(network.parameters(), lr=self.plan.learning_rate)
            state = TrainingState(network, optimizer)
            identity = {
                "system": self.method.name,
                "plan": self.plan.identity(),
                "pairs": self.pairs.fingerprint(),
            }
            if resume_from is not None:
                state.restore(resume_from, identity)
            self._run(state, identity, monitor)
        return self._weights(state)

    def _run(self, state: TrainingState, identity: dict[str, Any], monitor: Monitor) -> None:
        """Steps with looks at the held-out pairs in between, the first before any step."""
        if state.step == 0 and not state.history:
            self._validate(state, identity)
        while self._share(state) < 1:
            self._step(state)
            error = f" ({state.history[-1]['held_out_mm']:.2f} mm)"
            monitor.step(STAGE + error, int(1000 * self._share(state)), 1000, None)
            if state.step % self.plan.validate_every == 0:
                self._validate(state, identity)
        if state.history[-1]["step"] != state.step:
            self._validate(state, identity)

    def _share(self, state: TrainingState) -> float:
        """How much of the training is done, by time or by steps, 0 to 1."""
        by_time = state.seconds / (60 * self.plan.minutes) if self.plan.minutes else 0.0
        return min(1.0, max(by_time, state.step / self.plan.steps))

    def _step(self, state: TrainingState) -> None:
        """Improve the network on one batch, pair by pair: pairs may have different cameras."""
        plan, pairs = self.plan, self.pairs.training
        epoch = state.step * plan.batch // len(pairs)
        for group in state.optimizer.param_groups:
            group["lr"] = plan.learning_rate * DECAY ** (epoch // DECAY_EPOCHS)
        state.network.train()
        state.optimizer.zero_grad(set_to_none=True)
        total = 0.0
        for number in range(state.step * plan.batch, (state.step + 1) * plan.batch):
            turn, place = divmod(number, len(pairs))
            order = np.random.default_rng((plan.seed, turn)).permutation(len(pairs))
            pair = pairs[order[place]]
            loss = self.method.loss(self._found(state.network, pair), pair, plan) / plan.batch
            loss.backward()
            total += float(loss.detach())
        if not math.isfinite(total):
            raise InputError("The training's loss is no finite number: lower the learning rate.")
        torch.nn.utils.clip_grad_norm_(state.network.parameters(), 1.0)
        state.optimizer.step()
        state.step += 1
        state.losses.append(total)

    def _found(self, network: nn.Module, pair: PreparedPair) -> Tensor:
        """The network's displacement (1, 3, k, j, i) of a pair."""
        device = self.plan.device
        return network(pair.moving[None].to(device).float(), pair.lifted[None].to(device).float())

    def _validate(self, state: TrainingState, identity: dict[str, Any]) -> None:
        """Measure the held-out pairs, keep the best weights and write a checkpoint."""
        state.network.eval()
        errors, losses = [], []
        with torch.no_grad():
            for pair in self.pairs.held_out:
                found = self._found(state.network, pair)
                errors.append(pair.error_mm(found[0].cpu()))
                losses.append(float(self.method.loss(found, pair, self.plan)))
        error, held_out = float(np.mean(errors)), float(np.mean(losses))
        entry = {
            "step": state.step,
            "loss": float(np.mean(state.losses)) if state.losses else held_out,
            "held_out_loss": held_out,
            "held_out_mm": error,
            "seconds": state.seconds,
        }
        state.losses = []
        state.history.append(entry)
        if error < state.best_mm:
            state.best_mm = error
            state.best = {
                name: value.detach().cpu().clone() for name, value in state.network.state_dict().items()
            }
        _LOG.info("step %d: loss %.4f, held out %.2f mm", state.step, entry["loss"], error)
        if self.checkpoint is not None:
            self.checkpoint(state.checkpoint(identity))

    def _weights(self, state: TrainingState) -> TrainedWeights:
        """The best weights with the training's numbers."""
        report = {
            "pairs": len(self.pairs.training),
            "held_out_pairs": len(self.pairs.held_out),
            "rest_mm": float(np.mean([pair.rest_mm for pair in self.pairs.held_out])),
            "held_out_mm": state.best_mm,
            "steps": state.step,
            "seconds": state.seconds,
            "plan": self.plan.identity(),
            "curve": state.history,
        }
        return TrainedWeights(
            self.method.name,
            self.pairs.side,
            self.pairs.directions,
            self.pairs.extent_mm,
            self.pairs.sources_mm,
            state.best,
            report,
            self.pairs.cts,
        )


def is_gain(report: Mapping[str, Any]) -> bool:
    """Whether the weights that a training's report is of are better on held-out pairs by LEAST_GAIN.

    Better than doing nothing, and than the network before its first step: with few pairs some random field points the
    right way.
    """
    return report["held_out_mm"] < (1 - LEAST_GAIN) * min(
        report["rest_mm"], report["curve"][0]["held_out_mm"]
    )
