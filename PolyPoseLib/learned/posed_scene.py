"""Renderings of a CT whose bones, but for the anchor, are in random postures: what the regressor is trained on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.articulations import Articulation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.rigid import Body, project_body

ROTATION_DEG = 12.0
SLIDE_MM = 4.0
"""Standard deviations of every joint's rotation and displacement."""

SOFT_ROTATION_DEG = 3.0
SOFT_SHIFT_MM = 8.0
"""Standard deviations of the soft tissue's own motion: it stands for all that the model cannot follow."""

BONE_GAIN = (0.7, 1.3)
SOFT_GAIN = (0.6, 1.4)
"""Attenuation of each bone and of soft tissue, relative to the CT (another tube voltage, other tissue)."""

ABSENT_SHARE = 0.05
"""How often a bone other than the anchor is left out."""


@dataclass(frozen=True)
class PosedScene:
    """The CT's parts at one resolution; small enough to be sent to another process.

    Attributes
    ----------
    bodies : tuple[Body, ...]
        One per structure.
    soft : Body
        Soft tissue with the bones filled in.
    anchor : int
        Its index among the structures.
    chain : tuple[tuple[int, int, np.ndarray], ...]
        (bone, the bone that carries it or -1, pivot (3,) LPS mm), carriers first.
    size_mm : float
        Of voxels, and of steps along the rays.
    centre : (3,) array
        The anchor's, LPS mm.

    """

    bodies: tuple[Body, ...]
    soft: Body
    anchor: int
    chain: tuple[tuple[int, int, np.ndarray], ...]
    size_mm: float
    centre: np.ndarray

    @classmethod
    def of(cls, scene: Scene, size_mm: float) -> PosedScene:
        """Take a scene's parts at voxels of about ``size_mm``."""
        return cls(
            tuple(scene.bodies(size_mm)),
            scene.volume("soft", size_mm),
            scene.anchor,
            carried(scene.articulations, scene.centres, scene.anchor),
            size_mm,
            scene.anchor_centre,
        )

    def render(
        self, camera: Camera, poses: np.ndarray, gains: np.ndarray, soft_pose: np.ndarray, backend: Backend
    ) -> np.ndarray:
        """Render a posture.

        Parameters
        ----------
        camera : Camera
            The view.
        poses : (K, 4, 4) array
            Fixed to moving.
        gains : (K + 1,) array
            Factors of the bones and, last, of soft tissue.
        soft_pose : (4, 4) array
            Fixed to moving, of soft tissue.
        backend : Backend
            What computes the line integrals.

        Returns
        -------
        (H, W) array of float32
            Line integrals.

        """
        image = np.zeros((camera.height, camera.width), np.float32)
        parts = [*zip(self.bodies, poses, gains[:-1], strict=True), (self.soft, soft_pose, gains[-1])]
        for body, pose, gain in parts:
            if gain:
                part = project_body(body, camera, pose, self.size_mm, backend)
                image[part.slices] += np.float32(gain) * part.image
        return image

    def draw(self, rng: np.random.Generator, camera: Camera, backend: Backend) -> np.ndarray:
        """A rendering (H, W) in a random posture with random attenuation."""
        poses = random_posture(self.chain, len(self.bodies), rng)
        gains = np.append(rng.uniform(*BONE_GAIN, len(self.bodies)), rng.uniform(*SOFT_GAIN))
        absent = rng.uniform(size=len(gains)) < ABSENT_SHARE
        absent[[self.anchor, -1]] = False
        gains[absent] = 0
        soft = _moved(self.centre, rng, SOFT_ROTATION_DEG, SOFT_SHIFT_MM)
        return self.render(camera, poses, gains, soft, backend)


def carried(
    articulations: list[Articulation], centres: np.ndarray, anchor: int
) -> tuple[tuple[int, int, np.ndarray], ...]:
    """(bone, its carrier or -1, pivot) of every bone but the anchor, starting at the anchor's neighbours."""
    chain: list[tuple[int, int, np.ndarray]] = []
    reached = [anchor]
    for carrier in reached:
        for joint in articulations:
            pair = (joint.first, joint.second)
            if carrier in pair:
                bone = pair[1 - pair.index(carrier)]
                if bone not in reached:
                    reached.append(bone)
                    chain.append((bone, carrier, joint.point))
    chain += [(n, -1, centres[n]) for n in range(len(centres)) if n not in reached]
    return tuple(chain)


def random_posture(
    chain: tuple[tuple[int, int, np.ndarray], ...], count: int, rng: np.random.Generator
) -> np.ndarray:
    """(count, 4, 4) fixed to moving; bones turn about their joints and take along what they carry."""
    forward = np.stack([np.eye(4)] * count)
    for bone, carrier, pivot in chain:
        own = _moved(pivot, rng, ROTATION_DEG, SLIDE_MM)
        forward[bone] = own if carrier < 0 else forward[carrier] @ own
    return np.linalg.inv(forward)


def _moved(pivot: np.ndarray, rng: np.random.Generator, rotation_deg: float, shift_mm: float) -> np.ndarray:
    """(4, 4) normally distributed rotation about ``pivot`` (3,) and shift; standard deviations per axis / sqrt(3)."""
    motion = np.eye(4)
    vector = rng.normal(size=3) * np.radians(rotation_deg) / np.sqrt(3)
    motion[:3, :3] = Rotation.from_rotvec(vector).as_matrix()
    motion[:3, 3] = pivot + rng.normal(size=3) * shift_mm / np.sqrt(3) - motion[:3, :3] @ pivot
    return motion
