"""A large CT with 26 bones, a chain like pelvis, spine and ribs in soft tissue, drawn in any posture of the bones.

Bones are ellipsoids, or balls along an arc, with a dense shell; they are drawn where their motions put them, so the
true posture needs no resampling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import zoom
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume

SHAPE = (400, 512, 512)
SPACING_MM = (0.75, 0.75, 1.0)
SPONGE_HU, CORTEX_HU, SOFT_HU, LUNG_HU = 250.0, 1100.0, 40.0, -800.0
SHELL_MM = 2.5
RIB_RADIUS_MM = 5.0
TURN_DEG, SHIFT_MM = 4.0, 3.0


@dataclass(frozen=True)
class Ball:
    """An ellipsoid: centre (3,) and half axes (3,) in LPS mm."""

    centre: np.ndarray
    radii: np.ndarray


def bones() -> dict[str, list[Ball]]:
    """26 bones about the origin: a pelvis (the anchor), nine vertebrae upon it, and eight pairs of ribs."""
    chain = {
        "pelvis": [
            Ball(np.array([0.0, 60.0, -145.0]), np.array([50.0, 14.0, 30.0])),
            *(Ball(np.array([sign * 75.0, 25.0, -145.0]), np.array([16.0, 45.0, 36.0])) for sign in (1, -1)),
            *(Ball(np.array([sign * 60.0, 20.0, -180.0]), np.array([12.0, 14.0, 16.0])) for sign in (1, -1)),
            Ball(np.array([0.0, -45.0, -172.0]), np.array([38.0, 9.0, 10.0])),
        ]
    }
    for n, z in enumerate(-100 + 32.0 * np.arange(9)):
        chain[f"vertebra_{n + 1}"] = [
            Ball(np.array([0.0, 55.0, z]), np.array([20.0, 17.0, 13.0])),
            *(Ball(np.array([sign * 26.0, 70.0, z]), np.array([15.0, 5.0, 5.0])) for sign in (1, -1)),
            Ball(np.array([0.0, 82.0, z - 5]), np.array([4.0, 16.0, 6.0])),
        ]
    for n, z in enumerate(np.linspace(-30, 165, 8)):
        for side, sign in (("left", 1), ("right", -1)):
            chain[f"rib_{side}_{n + 1}"] = [
                Ball(
                    np.array([sign * 135 * np.sin(angle), -75 * np.cos(angle), z - 18 * np.sin(angle)]),
                    np.full(3, RIB_RADIUS_MM),
                )
                for angle in np.linspace(0.45, 2.7, 110)
            ]
    return chain


def draw_poses(seed: int) -> dict[str, np.ndarray]:
    """Motions (4, 4) fixed to moving of a few degrees and mm about each bone's middle; the anchor rests."""
    rng = np.random.default_rng(seed)
    poses = {}
    for n, (name, balls) in enumerate(bones().items()):
        motion = np.eye(4)
        if n:
            middle = np.mean([ball.centre for ball in balls], axis=0)
            motion[:3, :3] = Rotation.from_rotvec(np.radians(TURN_DEG) * _direction(rng)).as_matrix()
            motion[:3, 3] = middle - motion[:3, :3] @ middle + SHIFT_MM * _direction(rng)
        poses[name] = motion
    return poses


def draw(
    poses: dict[str, np.ndarray] | None = None, shape: tuple[int, int, int] = SHAPE
) -> tuple[Volume, Structures]:
    """The CT (HU) and its structures, bones at ``poses`` {bone: (4, 4) fixed to moving} or at rest."""
    chain = bones()
    affine = np.eye(4)
    affine[:3, :3] = np.diag(np.array(SPACING_MM) * np.array(SHAPE[::-1]) / np.array(shape[::-1]))
    affine[:3, 3] = -affine[:3, :3] @ ((np.array(shape[::-1]) - 1) / 2)
    hu = _body(affine, shape)
    labels = np.zeros(shape, np.int16)
    for number, (name, balls) in enumerate(chain.items(), start=1):
        back = np.linalg.inv(poses[name]) if poses else np.eye(4)
        for ball in balls:
            _draw_ball(hu, labels, number, ball, back, affine)
    return Volume(hu, affine), Structures(tuple(chain), labels)


def _body(affine: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Soft tissue of uneven density with two lungs, in air; (k, j, i) float32 HU."""
    spacing = np.diag(affine)[:3]
    k, j, i = (affine[n, 3] + spacing[n] * np.arange(shape[2 - n]) for n in (2, 1, 0))
    inside = (i / 165)[None, :] ** 2 + (j / 110)[:, None] ** 2 < 1
    lungs = ((np.abs(i) - 70) / 45)[None, :] ** 2 + (j / 70)[:, None] ** 2 < 1
    texture = np.random.default_rng(0).normal(SOFT_HU, 40, (12, 14, 14)).astype(np.float32)
    hu = zoom(texture, np.array(shape) / texture.shape, order=1)
    hu[:, ~inside] = -1000
    hu[np.ix_(k > -40, *map(np.arange, shape[1:]))] = np.where(lungs, LUNG_HU, hu[k > -40])
    return hu


def _draw_ball(
    hu: np.ndarray, labels: np.ndarray, number: int, ball: Ball, back: np.ndarray, affine: np.ndarray
) -> None:
    """Draw one ellipsoid in place, moved by ``back`` (4, 4) moving to fixed; earlier bones keep their voxels."""
    spacing, origin = np.diag(affine)[:3], affine[:3, 3]
    centre = back[:3, :3] @ ball.centre + back[:3, 3]
    reach = ball.radii.max()
    low = np.clip(np.floor((centre - reach - origin) / spacing).astype(int), 0, None)
    high = np.clip(np.ceil((centre + reach - origin) / spacing).astype(int) + 1, None, hu.shape[::-1])
    axes = [origin[n] + spacing[n] * np.arange(low[n], high[n]) - centre[n] for n in range(3)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    radius = np.zeros(x.shape)
    for axis in range(3):
        row = back[:3, :3].T[axis]
        radius += ((row[0] * x + row[1] * y + row[2] * z) / ball.radii[axis]) ** 2
    box = tuple(slice(low[n], high[n]) for n in (2, 1, 0))
    mine = (radius < 1) & ((labels[box] == 0) | (labels[box] == number))
    core = (1 - SHELL_MM / ball.radii.min()) ** 2
    # The inside of a chain of balls stays inside where the next ball's shell crosses it.
    sponge = mine & ((radius < core) | ((labels[box] == number) & (hu[box] == SPONGE_HU)))
    hu[box][mine] = CORTEX_HU
    hu[box][sponge] = SPONGE_HU
    labels[box][mine] = number


def _direction(rng: np.random.Generator) -> np.ndarray:
    """A random unit vector (3,)."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
