"""What a training consists of at one moment, and its checkpoints."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor
from torch.optim.swa_utils import AveragedModel

from PolyPoseLib.errors import InputError
from PolyPoseLib.learned.network import Architecture, CameraNetwork

AVERAGING = 0.999
"""Share of the old in the running average of the weights, which is what is validated and kept."""

WEIGHT_DECAY = 1e-4


@dataclass
class TrainingState:
    """The network, its optimizer and how far the training is.

    Attributes
    ----------
    network, average, optimizer
        The network, the running average of its weights, and its optimizer.
    step : int
        Steps done so far.
    earlier_seconds : float
        Time used before a resumption.
    best_mm, best
        Smallest validation error, and the averaged weights that gave it.
    stagnant : int
        Validations since then.
    bfloat16 : bool, optional
        Whether the network computes in that precision; None until it was tried.
    began : float
        When this run began, by the monotonic clock.

    """

    network: CameraNetwork
    average: AveragedModel
    optimizer: torch.optim.Optimizer
    step: int = 0
    earlier_seconds: float = 0.0
    best_mm: float = float("inf")
    best: dict[str, Tensor] = field(default_factory=dict)
    stagnant: int = 0
    bfloat16: bool | None = None
    began: float = field(default_factory=time.monotonic)

    @classmethod
    def new(cls, architecture: Architecture, learning_rate: float, seed: int, device: str) -> TrainingState:
        """Untrained; the weights follow from the seed."""
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            network = CameraNetwork(architecture).to(device)
            network.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]
        average = AveragedModel(network, avg_fn=_averaged, use_buffers=True).eval()
        optimizer = torch.optim.AdamW(network.parameters(), lr=learning_rate, weight_decay=WEIGHT_DECAY)
        return cls(network, average, optimizer)

    @property
    def seconds(self) -> float:
        """Time that the training has taken, interruptions left out."""
        return self.earlier_seconds + time.monotonic() - self.began

    def keep_if_best(self, error_mm: float) -> None:
        """Remember the averaged weights when they are the best so far."""
        if error_mm < self.best_mm:
            self.best_mm, self.stagnant = error_mm, 0
            weights = self.average.module.state_dict()
            self.best = {name: value.detach().cpu().clone() for name, value in weights.items()}
        else:
            self.stagnant += 1

    def checkpoint(self, identity: dict[str, Any]) -> dict[str, Any]:
        """Plain values and tensors to go on from; `identity` says which training they belong to."""
        return {
            "identity": identity,
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
            "best_mm": self.best_mm,
            "best": self.best,
            "fruitless": self.stagnant,
            "bfloat16": self.bfloat16,
        }

    def restore(self, fields: dict[str, Any], identity: dict[str, Any]) -> None:
        """Go on from a checkpoint; raises InputError when it belongs to another training or is damaged."""
        if fields.get("identity") != identity:
            raise InputError(
                "The checkpoint belongs to another CT, range of views or plan: leave out --resume, or choose "
                "another --output."
            )
        try:
            self.network.load_state_dict(fields["network"])
            self.average.load_state_dict(fields["average"])
            self.optimizer.load_state_dict(fields["optimizer"])
            self.step, self.earlier_seconds = int(fields["step"]), float(fields["seconds"])
            self.best_mm, self.best = float(fields["best_mm"]), dict(fields["best"])
            self.stagnant, self.bfloat16 = int(fields["fruitless"]), fields["bfloat16"]
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise InputError("The checkpoint is damaged: leave out --resume.") from error
        self.began = time.monotonic()


def _averaged(average: Tensor, now: Tensor, count: Tensor | int) -> Tensor:
    """Running average that forgets its beginning; counts are taken as they are."""
    if not now.is_floating_point():
        return now
    share = min(AVERAGING, (1 + float(count)) / (10 + float(count)))
    return average + (now - average) * (1 - share)
