"""Batches of renderings with their cameras; every batch follows from a seed and its number alone."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network_input import network_input
from PolyPoseLib.learned.posed_scene import PosedScene
from PolyPoseLib.learned.randomise import randomised
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.select import select_backend

TRAINING, VALIDATION = 0, 1
"""Streams of random numbers."""

COPY_ROTATION_RAD = np.array([0.06, 0.06, 0.15])
"""Largest rotations of a copy's camera about its source: about both sides, and about the axis."""


@dataclass(frozen=True)
class Batch:
    """images: (B, C, S, S) float32; extrinsics: (B, 4, 4) float64; views: (B,) index of each camera's standard view.

    Arrays, not tensors: they pass from one process to another without torch's shared memory.
    """

    images: np.ndarray
    extrinsics: np.ndarray
    views: np.ndarray

    def tensors(self, device: str) -> tuple[Tensor, Tensor, Tensor]:
        """The three as tensors."""
        images, extrinsics, views = (
            torch.from_numpy(each).to(device) for each in (self.images, self.extrinsics, self.views)
        )
        return images, extrinsics, views


@dataclass(frozen=True)
class Sampler:
    """Draws batches.

    Attributes
    ----------
    scene : PosedScene
        The CT's parts.
    views : ViewRange
        The cameras to draw.
    detector : VirtualDetector
        Of every image.
    seed : int
        Of every random number.
    renderings : int
        Per batch.
    copies : int
        Of each rendering, seen by cameras rotated about their source, each with its own contrast, noise and
        collimation (a copy costs a fraction of a rendering).
    kernel : {"auto", "numba", "torch"}
        Of the renderer.

    """

    scene: PosedScene
    views: ViewRange
    detector: VirtualDetector
    seed: int
    renderings: int
    copies: int
    kernel: str = "auto"

    def draw(self, stream: int, number: int, backend: Backend) -> Batch:
        """Batch ``number`` of a stream of ``renderings * copies`` images."""
        rng = np.random.default_rng([self.seed, stream, number])
        drawn = [sample for _ in range(self.renderings) for sample in self._draw_one(rng, backend)]
        images, extrinsics, views = zip(*drawn, strict=True)
        return Batch(np.stack(images), np.stack(extrinsics), np.array(views, np.int64))

    def _draw_one(
        self, rng: np.random.Generator, backend: Backend
    ) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
        """(network input, extrinsic, view) of one rendering and its copies."""
        view, extrinsic = self.views.draw(rng, self.scene.centre)
        clean = self.scene.draw(rng, self.detector.camera(extrinsic), backend)
        for copy in range(self.copies):
            turn = np.eye(4)
            image, mask = clean, np.ones(clean.shape, bool)
            if copy:
                vector = rng.uniform(-1, 1, 3) * COPY_ROTATION_RAD
                turn[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
                image, mask = self.detector.rotated(clean, turn[:3, :3])
            image, mask = randomised(image, mask, rng)
            seen = network_input(image, mask, self.detector, self.views.distance_mm)
            yield seen, turn @ extrinsic, view


class TrainingBatches(Dataset):
    """The training stream, indexed by number."""

    def __init__(self, sampler: Sampler) -> None:
        self.sampler = sampler
        self._backend: Backend | None = None

    def __getitem__(self, number: int) -> Batch:
        """Draw a batch; the renderer is made where it is used, be it another process."""
        if self._backend is None:
            self._backend = select_backend(self.sampler.kernel, "cpu", 1)
        return self.sampler.draw(TRAINING, number, self._backend)


def training_batches(sampler: Sampler, first: int, last: int, workers: int) -> Iterator[Batch]:
    """Batches first to last - 1, rendered in ``workers`` processes beside this one, or in this one when 0."""
    loader = DataLoader(
        TrainingBatches(sampler),
        batch_size=None,
        sampler=range(first, last),
        num_workers=workers,
        multiprocessing_context="spawn" if workers else None,
        prefetch_factor=4 if workers else None,
        collate_fn=_as_it_is,
        worker_init_fn=_leave_interrupts_to_the_parent if workers else None,
    )
    return iter(loader)


def validation_batches(sampler: Sampler, batches: int) -> list[Batch]:
    """Views that are never trained on."""
    backend = select_backend(sampler.kernel, "cpu", 1)
    return [sampler.draw(VALIDATION, number, backend) for number in range(batches)]


def _as_it_is(batch: Any) -> Any:
    """A batch is drawn as a whole: nothing is to be collated."""
    return batch


def _leave_interrupts_to_the_parent(_worker: int) -> None:
    """Ctrl+C ends the training, which ends its workers; they need not print tracebacks themselves."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
