"""Cameras by exhaustive search at coarse resolution: renderings of the anchor slid over the X-ray.

For every direction of view and distance, the CT is rendered once with the anchor in the middle.  Turns of the camera
about its axis turn the X-ray instead, and shifts come from a Fourier transform, so that tens of thousands of cameras
cost seconds.  A shift stands for a turn of the camera about its source, which is exact but for the stretching of the
image far from its middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import affine_transform, binary_dilation

from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.view_grid import ViewGrid, rotation_between, turn
from PolyPoseLib.registration.cameras.template_match import MaskedMatcher
from PolyPoseLib.registration.fit.levels import FLAT_LINE_INTEGRAL, Observation, binned
from PolyPoseLib.registration.fit.weighting import VISIBLE_LINE_INTEGRAL
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene, body_points
from PolyPoseLib.rendering.rigid import Body, BodyProjection, project_body
from PolyPoseLib.similarity.local_contrast import LocalContrast

SIZE_MM = 6.0
"""Pixels at the anchor, voxels and step."""

PATCH_MM = 40.0
"""Width of the patches of the local contrast."""

LEAST_SHARE = 0.3
"""Of the anchor's projection that must lie inside the X-ray."""


@dataclass(frozen=True)
class Candidates:
    """The best shifts for one distance and direction, one for each roll.

    Attributes
    ----------
    depth : float
        mm from the source to the anchor's centre.
    direction : int
        Index into the grid's rotations.
    rolls : np.ndarray
        (N,) indices into its rolls.
    rows, columns : np.ndarray
        (N,) pixel of the turned-back X-ray that shows the anchor's centre.
    scores : np.ndarray
        (N,) correlation times the root of the anchor's visible share.

    """

    depth: float
    direction: int
    rolls: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    scores: np.ndarray


class CoarseSearch:
    """One X-ray and one scene, prepared for many directions and distances.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observation : Observation
        The X-ray; of its camera only the intrinsics and the size count.
    grid : ViewGrid
        Directions and rolls.
    depths : (Z,) ndarray
        mm from the source to the anchor's centre that will be tried.

    """

    def __init__(self, run: Run, observation: Observation, grid: ViewGrid, depths: np.ndarray) -> None:
        scene = run.scene
        self.centre = scene.anchor_centre
        self.whole = scene.volume("whole", SIZE_MM)
        self.anchor = scene.bodies(SIZE_MM)[scene.anchor]
        self.reach = float(np.linalg.norm(body_points(self.anchor) - self.centre, axis=1).max())
        self.backend, self.grid, self.depths = run.backend, grid, depths
        full = observation.camera
        middle = float(np.sqrt(depths.min() * depths.max()))
        factor = max(1, round(SIZE_MM * full.intrinsics[0, 0] / middle))
        factor = min(factor, max(1, min(observation.image.shape) // 16))
        self.camera = full.binned(factor)
        self.patch = 2 * max(1, round(PATCH_MM * self.camera.intrinsics[0, 0] / middle / 2)) + 1
        image, mask = binned(observation.image, observation.mask, factor)
        self.images, self.masks, self.principal = self._rolled(image, mask)

    def run(self, depth: float, direction: int, matcher: MaskedMatcher) -> Candidates:
        """Best shift for every allowed roll at one depth (mm) and direction."""
        which = np.flatnonzero(self.grid.allowed[direction])
        template, weight = self._template(self.grid.rotations[direction], depth, matcher.half)
        peaks = matcher.best(template, weight, LEAST_SHARE, which)
        scores = peaks.correlation * np.sqrt(np.clip(peaks.share, 0, 1))
        return Candidates(depth, direction, which, peaks.row, peaks.column, scores)

    def extrinsic(self, candidates: Candidates, number: int) -> np.ndarray:
        """(4, 4) of the camera whose turned-back X-ray shows the anchor's centre where a candidate says."""
        intrinsics = self.camera.intrinsics.copy()
        intrinsics[:2, 2] = self.principal
        ray = np.linalg.solve(intrinsics, [candidates.columns[number], candidates.rows[number], 1.0])
        ray /= np.linalg.norm(ray)
        back = turn(float(self.grid.rolls[candidates.rolls[number]]))
        tilt = rotation_between(np.array([0.0, 0.0, 1.0]), ray)
        extrinsic = np.eye(4)
        extrinsic[:3, :3] = back @ tilt @ self.grid.rotations[candidates.direction]
        extrinsic[:3, 3] = back @ ray * candidates.depth - extrinsic[:3, :3] @ self.centre
        return extrinsic

    def matcher(self, depth: float) -> MaskedMatcher:
        """A matcher for templates at ``depth`` mm."""
        focal = float(max(self.camera.intrinsics[0, 0], self.camera.intrinsics[1, 1]))
        half = int(np.ceil(self.reach * focal / max(depth - self.reach, 0.2 * depth))) + self.patch // 2 + 2
        return MaskedMatcher(self.images, self.masks, min(half, max(self.images.shape[1:])))

    def _template(self, rotation: np.ndarray, depth: float, half: int) -> tuple[np.ndarray, np.ndarray]:
        """Normalised rendering (s, s) with the anchor's centre in the middle, and the weight of its pixels."""
        side = 2 * half + 1
        intrinsics = self.camera.intrinsics.copy()
        intrinsics[:2, 2] = half
        extrinsic = np.eye(4)
        extrinsic[:3, :3] = rotation
        extrinsic[:3, 3] = (0, 0, depth) - rotation @ self.centre
        camera = Camera(intrinsics, extrinsic, side, side)
        bone = self._project(self.anchor, camera)
        shows = binary_dilation(bone > VISIBLE_LINE_INTEGRAL, np.ones((3, 3)))
        contrast = LocalContrast(np.ones((side, side), bool), self.patch, FLAT_LINE_INTEGRAL)
        return contrast.normalise(self._project(self.whole, camera)).values, shows.astype(np.float32)

    def _project(self, body: Body, camera: Camera) -> np.ndarray:
        image = np.zeros((camera.height, camera.width), np.float32)
        part: BodyProjection = project_body(body, camera, np.eye(4), SIZE_MM, self.backend)
        image[part.slices] = part.image
        return image

    def _rolled(self, image: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normalised X-rays (R, S, S) as seen by cameras turned back by each roll, masks and principal point (2,)."""
        intrinsics = self.camera.intrinsics
        corners = np.array(
            [[c, r] for c in (0, image.shape[1] - 1) for r in (0, image.shape[0] - 1)], dtype=float
        )
        half = int(np.ceil(np.linalg.norm(corners - intrinsics[:2, 2], axis=1).max())) + 1
        square = intrinsics.copy()
        square[:2, 2] = half
        images, masks = [], []
        filled = np.where(mask, image, image[mask].mean() if mask.any() else 0.0)
        for roll in self.grid.rolls:
            # A pixel of the turned-back camera looks where the real camera's pixel ``mapping @ pixel`` looks.
            mapping = intrinsics @ turn(roll) @ np.linalg.inv(square)
            swap = np.array([[0.0, 1.0], [1.0, 0.0]])
            matrix, offset = swap @ mapping[:2, :2] @ swap, swap @ mapping[:2, 2]
            size = (2 * half + 1, 2 * half + 1)
            turned = affine_transform(filled, matrix, offset, size, order=1, mode="nearest")
            seen = affine_transform(mask.astype(np.float32), matrix, offset, size, order=1) > 0.5
            contrast = LocalContrast(seen, self.patch, FLAT_LINE_INTEGRAL)
            images.append(contrast.normalise(turned).values)
            masks.append(contrast.support > 0)
        return np.stack(images), np.stack(masks), square[:2, 2]


def compared_points(scene: Scene) -> np.ndarray:
    """Points (N, 3) LPS mm of the anchor by whose projections cameras are compared."""
    return body_points(scene.bodies(SIZE_MM)[scene.anchor], 300)
