"""Images of a simulated sequence, made when they are read."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.moving_degradations import Screws, Surroundings, bare
from PolyPoseLib.simulation.xray_physics import XrayPhysics

if TYPE_CHECKING:
    from PolyPoseLib.data.tracking.sequence import FrameImages
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.simulation.motion_laws import TimedMotion
    from PolyPoseLib.simulation.moving_scene import MovingScene
    from PolyPoseLib.simulation.sequence_options import SequenceOptions


@dataclass
class Studio:
    """The patient in motion, the cameras before them, and how they measure.

    Attributes
    ----------
    scene : MovingScene
        The patient.
    motion : TimedMotion
        What they do.
    cameras : tuple of Camera
        In the rig's world.
    options : SequenceOptions
        How frames are made.
    seed : int
        Of the noise.
    surroundings : tuple of Surroundings
        What stands before each camera besides the patient; none of them when empty.
    screws : Screws, optional
        Metal that moves with a bone.

    """

    scene: MovingScene
    motion: TimedMotion
    cameras: tuple[Camera, ...]
    options: SequenceOptions
    seed: int
    surroundings: tuple[Surroundings, ...] = ()
    screws: Screws | None = None
    _last: tuple[float, Volume] | None = field(default=None, init=False, repr=False)

    def clean(self, view: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Line integrals (H, W) at a time, averaged over the exposure: of the patient alone, and with screws."""
        camera, options = self.cameras[view], self.options
        middle = self.poses(np.array([seconds]))[0]
        soft = self.scene.project_soft(self._soft(seconds, middle), middle, camera)
        half = options.shutter / options.frames_per_second / 2
        marks = (np.arange(options.exposures) + 0.5) / options.exposures * 2 - 1
        postures = self.poses(seconds + half * marks) if half > 0 else middle[None]
        bones = [self.scene.project_bones(each, camera) for each in postures]
        body = soft + _averaged(bones)
        if self.screws is None:
            return body, body
        metal = [self.screws.line(each, camera) for each in postures]
        return body, soft + _averaged([bone + each for bone, each in zip(bones, metal, strict=True)])

    def measured(self, view: int, seconds: float, rng: np.random.Generator) -> np.ndarray:
        """Line integrals (H, W) float32 as the detector reports them."""
        body, line = self.clean(view, seconds)
        measure_by = self.surroundings[view].measured if self.surroundings else bare
        return measure_by(body, line, self.cameras[view], self.options.physics, rng)

    def poses(self, seconds: np.ndarray) -> np.ndarray:
        """(F, K, 4, 4) the rig's world to the CT's at seconds (F,)."""
        return np.linalg.inv(self.motion.bones.at(seconds)) @ self.options.world

    def _soft(self, seconds: float, poses: np.ndarray) -> Volume:
        """Posed soft tissue; the last one is kept, as all cameras see it at the same time."""
        if self._last is None or self._last[0] != seconds:
            self._last = seconds, self.scene.soft_tissue(poses, self.motion.soft_at(seconds))
        return self._last[1]


@dataclass(frozen=True)
class SimulatedFrames:
    """One camera's images.

    Attributes
    ----------
    studio : Studio
        What is before the camera.
    view : int
        The camera.

    """

    studio: Studio
    view: int

    @property
    def count(self) -> int:
        """Number of images: the sequence's frames, and those before it."""
        return self.studio.options.frames + self.studio.options.first_of(self.view)

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """One image (H, W) float32 line integrals and its mask (H, W) bool; raises InputError."""
        if not 0 <= index < self.count:
            raise InputError(f"There is no image {index}: view {self.view + 1} has {self.count} images.")
        options = self.studio.options
        while index > 0 and index in options.repeated.get(self.view, ()):
            index -= 1
        rng = np.random.default_rng([self.studio.seed, self.view, index, zlib.crc32(b"frame")])
        camera = self.studio.cameras[self.view]
        if index in options.blank.get(self.view, ()):
            image = _dark((camera.height, camera.width), options.physics, rng)
        else:
            image = self.studio.measured(self.view, options.seconds(self.view, index), rng)
        return image, np.ones(image.shape, dtype=bool)


@dataclass(frozen=True)
class KeptFrames:
    """Images that stay in memory once they were read."""

    images: FrameImages
    _kept: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict, repr=False)

    @property
    def count(self) -> int:
        """Number of images."""
        return self.images.count

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """One image (H, W) float32 line integrals and its mask (H, W) bool; raises InputError."""
        if index not in self._kept:
            self._kept[index] = self.images.read(index)
        return self._kept[index]


def _averaged(lines: list[np.ndarray]) -> np.ndarray:
    """Line integrals (H, W) of an exposure that several were parts of: a detector adds up intensities."""
    if len(lines) == 1:
        return lines[0]
    return -np.log(np.mean([np.exp(-line) for line in lines], axis=0))


def _dark(shape: tuple[int, int], physics: XrayPhysics, rng: np.random.Generator) -> np.ndarray:
    """What a detector reads without any exposure: a few counts of noise, (H, W) float32 line integrals."""
    counts = np.maximum(rng.poisson(2.0, shape), 0.5)
    return (-np.log(counts / physics.photons)).astype(np.float32)
