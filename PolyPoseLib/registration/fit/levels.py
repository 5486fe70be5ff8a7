"""Resolution levels, and one X-ray at one of them."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.camera_prior import CameraPrior
from PolyPoseLib.registration.fit.problem import View
from PolyPoseLib.similarity.local_contrast import LocalContrast
from PolyPoseLib.similarity.noise import noise_map

FLAT_LINE_INTEGRAL = 0.03
"""Local standard deviation (line integral) below which a patch counts as flat."""


@dataclass(frozen=True)
class Level:
    """One level of the resolution pyramid.

    Parameters
    ----------
    size_mm : float
        Of pixels (at the anchor) and voxels, and step along rays.
    patch_mm : float
        Width of the patches of the local contrast, at the anchor.
    iterations : int
        Of the solver at most.
    joint_weight : float
        Of the prior that joints keep together (:mod:`PolyPoseLib.registration.articulations`), in units of the
        images' cost.

    """

    size_mm: float
    patch_mm: float
    iterations: int
    joint_weight: float = 0.0


COMPARISON_LEVEL = Level(3.0, 20.0, 0)
"""Resolution at which a result is compared with its X-rays: coarse enough that neither noise nor texture decides."""


@dataclass(frozen=True)
class Observation:
    """An X-ray with the present estimate of its camera.

    Parameters
    ----------
    image : (H, W) ndarray
        float32 line integrals.
    mask : (H, W) ndarray
        bool, True where a pixel counts.
    camera : Camera
        The present estimate.
    expected : CameraPrior, optional
        Where the camera is expected, if it may move.
    clipped : (H, W) ndarray, optional
        bool, True where a pixel does not count because its value is clipped.
    foreign : (H, W) ndarray, optional
        bool, True where it does not because of metal or an instrument that the CT does not have.

    """

    image: np.ndarray
    mask: np.ndarray
    camera: Camera
    expected: CameraPrior | None = None
    clipped: np.ndarray | None = None
    foreign: np.ndarray | None = None
    noise: np.ndarray = field(init=False, repr=False)
    """(H, W) standard deviation of the image's noise in line integrals, estimated from the image."""

    def __post_init__(self) -> None:
        """Estimate the noise once; :meth:`with_camera` shares it."""
        object.__setattr__(self, "noise", noise_map(self.image, self.mask))

    @property
    def given(self) -> np.ndarray:
        """(H, W) bool: the pixels that counted before any were left out."""
        given = self.mask
        for left_out in (self.clipped, self.foreign):
            given = given if left_out is None else given | left_out
        return given

    def without(self, foreign: np.ndarray) -> Observation:
        """The same X-ray where objects (H, W) bool that the CT does not have are left out."""
        objects = foreign & self.mask
        if not objects.any():
            return self
        known = objects if self.foreign is None else objects | self.foreign
        return replace(self, mask=self.mask & ~objects, foreign=known)

    def with_camera(self, camera: Camera) -> Observation:
        """The same X-ray with another camera."""
        other = copy(self)
        object.__setattr__(other, "camera", camera)
        return other


def pixel_size_mm(camera: Camera, point: np.ndarray) -> float:
    """Size in mm of a pixel at the depth of ``point`` (3,) LPS mm."""
    depth = float(camera.extrinsic[2, :3] @ point + camera.extrinsic[2, 3])
    return max(depth, 1.0) / float(camera.intrinsics[0, 0])


def view_at(level: Level, observation: Observation, centre: np.ndarray, expect_noise: bool = True) -> View:
    """An X-ray at a level's resolution.

    Parameters
    ----------
    level : Level
        The resolution.
    observation : Observation
        The X-ray.
    centre : (3,) ndarray
        LPS mm, where the level's millimetres are observation.
    expect_noise : bool
        Compare and weigh as the X-ray's noise suggests; without it residuals are those of local correlation.

    Returns
    -------
    View
        Without static image, every pixel of the mask weighted 1.

    """
    pixel = pixel_size_mm(observation.camera, centre)
    factor = max(1, round(level.size_mm / pixel))
    factor = min(factor, max(1, min(observation.image.shape) // 16))
    image, mask = binned(observation.image, observation.mask, factor)
    camera = observation.camera.binned(factor)
    size = 2 * max(1, round(level.patch_mm / (pixel * factor) / 2)) + 1
    noise = (
        binned(observation.noise, observation.mask, factor)[0] / factor
        if expect_noise
        else np.zeros((), np.float32)
    )
    contrast = LocalContrast(mask, size, FLAT_LINE_INTEGRAL, noise)
    target = contrast.normalise(image, noisy=True)
    return View(
        camera=camera,
        contrast=contrast,
        target=target.values,
        static=np.zeros(image.shape, np.float32),
        weight=mask.astype(np.float32),
        noise_share=np.minimum(noise / target.deviation, 1.0) ** 2,
        expected=observation.expected,
    )


def binned(image: np.ndarray, mask: np.ndarray, factor: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of factor x factor blocks over the pixels that count; a block counts when half of its pixels do."""
    if factor == 1:
        return image.astype(np.float32), mask.copy()
    rows, columns = (n // factor for n in image.shape)
    blocks = (slice(0, rows * factor), slice(0, columns * factor))
    shape = (rows, factor, columns, factor)
    weight = mask[blocks].astype(np.float32)
    share = weight.reshape(shape).mean(axis=(1, 3))
    total = np.where(mask[blocks], image[blocks], 0).astype(np.float32).reshape(shape).mean(axis=(1, 3))
    return (total / np.maximum(share, 1e-6)).astype(np.float32), share >= 0.5


def enlarged(small: np.ndarray, factor: int, shape: tuple[int, ...]) -> np.ndarray:
    """A binned mask at full resolution, of that shape; rows and columns beyond the last whole block are not in it."""
    large = np.zeros(shape, bool)
    blocks = small.repeat(factor, axis=0).repeat(factor, axis=1)
    large[: blocks.shape[0], : blocks.shape[1]] = blocks
    return large
