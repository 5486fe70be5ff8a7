"""Renderings of a volume that is seen through a polyrigid warp, with their derivatives by the motions.

The cameras stand still, so rays, samples and (in the fixed frame) weights are made once; what remains for each set of
motions is sum w v, exp, gather and sum. Motions are given as logarithms (K, 6) [rotation rad, translation part mm]
about the warp's centre, fixed to moving.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import torch

from PolyPoseLib.baselines.published.ray_samples import sample_rays
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.warp.polyrigid import PolyrigidWarp

JACOBIAN_BYTES = 1 << 28
"""Jacobians up to this size are kept until the image's slope is known; larger ones cost a second pass."""

WEIGHTS_BYTES = 1 << 30
"""Weights of the fixed frame are kept up to this size; the rest are computed again in every pass."""

SAMPLES_PER_CHUNK = 1 << 18

Weights = TypeVar("Weights", np.ndarray, torch.Tensor)

ImageScore = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""Takes an image (H, W) and returns its score and the score's derivative by every pixel (H, W)."""


@dataclass(frozen=True)
class Scored:
    """An image's score with its derivative.

    Attributes
    ----------
    value : float
        The score.
    gradient : np.ndarray
        (K, 6) float64, its derivative by the logarithms.

    """

    value: float
    gradient: np.ndarray


@dataclass(frozen=True)
class Sampling:
    """How a projector samples its rays.

    Parameters
    ----------
    step_mm : float
        Distance of samples.
    margin_mm : float
        Rays are clipped to the volume's box, in the fixed frame, enlarged by this much.
    weights_bytes : int
        Memory in which weights of the fixed frame are kept.
    samples_per_chunk : int, optional
        Samples that are computed at once; None for the projector's own number.

    """

    step_mm: float
    margin_mm: float = 0.0
    weights_bytes: int = WEIGHTS_BYTES
    samples_per_chunk: int | None = None


class PolyrigidProjector(ABC, Generic[Weights]):
    """One camera's view of one volume through a polyrigid warp.

    Parameters
    ----------
    volume : Grid
        1/mm, moving frame, with a border of zeros.
    warp : PolyrigidWarp
        Gives the distance maps, shares, form and frame of the weights, and the centre; its poses are not used.
    camera : Camera
        Stands still.
    sampling : Sampling
        Of the rays.

    Raises
    ------
    ValueError
        For a warp with a rotation falloff.

    """

    def __init__(
        self,
        volume: Grid,
        warp: PolyrigidWarp,
        camera: Camera,
        sampling: Sampling,
        samples_per_chunk: int = SAMPLES_PER_CHUNK,
    ) -> None:
        if warp.rotation_falloff is not None:
            raise ValueError(
                "The projector renders plain means of logarithms: give a warp without rotation falloff."
            )
        self.warp = warp
        self._weights: dict[int, Weights] = {}
        self._room = sampling.weights_bytes
        self.centre = warp.center.cpu().numpy()
        self.rays = sample_rays(camera, volume, self.centre, sampling.step_mm, sampling.margin_mm)
        self.chunks = self.rays.chunks(sampling.samples_per_chunk or samples_per_chunk)
        moved = volume.affine.copy()
        moved[:3, 3] -= self.centre
        self.to_index = np.linalg.inv(moved)[:3]

    @property
    def structures(self) -> int:
        """Number of structures K."""
        return self.warp.distances.count

    def image(self, logs: np.ndarray) -> np.ndarray:
        """Line integrals (H, W) float32 for logarithms (K, 6)."""
        motion = self.motion(logs)
        return self._assemble([self.trace(motion, n, False)[0] for n in range(len(self.chunks))])

    def image_and_jacobian(self, logs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Line integrals (H, W) and their derivative by all logarithms (K, 6, H, W), float32."""
        motion = self.motion(logs)
        parts = [self._trace_fully(motion, n) for n in range(len(self.chunks))]
        image = self._assemble([values for values, _ in parts])
        jacobian = np.zeros((self.structures, 6, *image.shape), np.float32)
        if parts:
            jacobian = self.rays.to_image(np.concatenate([derivative for _, derivative in parts]))
        return image, jacobian

    def scored(self, logs: np.ndarray, score: ImageScore) -> Scored:
        """The score of the image for logarithms (K, 6), and its derivative."""
        motion = self.motion(logs)
        at_once = self.rays.rays * self.structures * 6 * 4 <= JACOBIAN_BYTES
        parts = [self.trace(motion, n, at_once) for n in range(len(self.chunks))]
        value, slope = score(self._assemble([values for values, _ in parts]))
        slope = np.asarray(slope, np.float64).ravel()
        gradient = np.zeros((self.structures, 6))
        for n, chunk in enumerate(self.chunks):
            jacobian = parts[n][1]
            if jacobian is None:
                jacobian = self._trace_fully(motion, n)[1]
            gradient += np.tensordot(slope[chunk.pixels], jacobian, 1)
        return Scored(value, gradient)

    @abstractmethod
    def motion(self, logs: np.ndarray) -> Motion:
        """What every chunk needs to know of the logarithms."""

    @abstractmethod
    def trace(self, motion: Motion, number: int, wanted: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Line integrals (r,) of one chunk of rays, and the derivative (r, K, 6) by the logarithms if wanted."""

    def _trace_fully(self, motion: Motion, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Line integrals of a chunk with their derivative."""
        values, jacobian = self.trace(motion, number, True)
        assert jacobian is not None, "it was asked for"
        return values, jacobian

    def kept_weights(self, number: int, make: Callable[[], Weights]) -> Weights:
        """Weights of a chunk, which ``make`` makes where there is no room to keep them."""
        kept = self._weights.get(number)
        if kept is None:
            kept = make()
            if kept.nbytes <= self._room:
                self._room -= kept.nbytes
                self._weights[number] = kept
        return kept

    def _assemble(self, parts: list[np.ndarray]) -> np.ndarray:
        values = np.concatenate(parts) if parts else np.zeros(0, np.float32)
        return self.rays.to_image(values.astype(np.float32, copy=False))


@dataclass(frozen=True)
class Motion:
    """Motions of the K structures in the forms that projectors need.

    Attributes
    ----------
    logs : np.ndarray
        (K, 6) float64 about the centre.
    poses : np.ndarray
        (K, 4, 4) in coordinates relative to the centre.
    left : np.ndarray
        (K, 6, 6) left Jacobians of the logarithms.

    """

    logs: np.ndarray
    poses: np.ndarray
    left: np.ndarray

    @classmethod
    def of(cls, logs: np.ndarray) -> Motion:
        """From logarithms (K, 6)."""
        vectors = torch.as_tensor(np.asarray(logs, np.float64))
        return cls(vectors.numpy(), se3.exp(vectors).numpy(), se3.left_jacobian(vectors).numpy())
