"""The resolution pyramid: which image and voxel sizes, and the X-rays at each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.problem import View
from PolyPoseLib.similarity.local_contrast import LocalContrast
from PolyPoseLib.similarity.noise import noise_map

FLAT_LINE_INTEGRAL = 0.03
"""Local standard deviation (line integral) below which a patch counts as flat."""


@dataclass(frozen=True)
class Level:
    """One step of the pyramid.

    size_mm: of pixels (at the anchor) and voxels, and step along rays; patch_mm: width of the patches of the local
    contrast, at the anchor; iterations: of the solver at most; joint_weight: of the expectation that joints keep
    together (:mod:`PolyPoseLib.registration.articulations`), in units of the images' cost.
    """

    size_mm: float
    patch_mm: float
    iterations: int
    joint_weight: float = 0.0


@dataclass(frozen=True)
class Observation:
    """An X-ray as the solver takes it.

    image: (H, W) float32 line integrals; mask: (H, W) bool, True where it counts; camera: the present guess; noise:
    (H, W) standard deviation of the image's noise in line integrals, read off the image where it is not given.
    """

    image: np.ndarray
    mask: np.ndarray
    camera: Camera
    noise: np.ndarray | None = None

    def __post_init__(self) -> None:
        """Look at the noise once; X-rays made by :meth:`with_camera` share it."""
        if self.noise is None:
            object.__setattr__(self, "noise", noise_map(self.image, self.mask))

    def with_camera(self, camera: Camera) -> Observation:
        """The same X-ray with another camera."""
        return replace(self, camera=camera)


def pixel_size_mm(camera: Camera, point: np.ndarray) -> float:
    """Size in mm of a pixel at the depth of ``point`` (3,) LPS mm."""
    depth = float(camera.extrinsic[2, :3] @ point + camera.extrinsic[2, 3])
    return max(depth, 1.0) / float(camera.intrinsics[0, 0])


def view_at(level: Level, measured: Observation, centre: np.ndarray, expect_noise: bool = True) -> View:
    """The X-ray at a level's resolution; ``centre`` (3,) LPS mm is where the level's millimetres are measured.

    expect_noise: compare and weigh as the X-ray's noise suggests; without it residuals are those of local correlation.
    """
    pixel = pixel_size_mm(measured.camera, centre)
    factor = max(1, round(level.size_mm / pixel))
    factor = min(factor, max(1, min(measured.image.shape) // 16))
    image, mask = binned(measured.image, measured.mask, factor)
    camera = measured.camera.binned(factor)
    size = 2 * max(1, round(level.patch_mm / (pixel * factor) / 2)) + 1
    noise = (
        binned(measured.noise, measured.mask, factor)[0] / factor
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
