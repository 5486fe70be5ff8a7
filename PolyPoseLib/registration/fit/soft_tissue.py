"""Renderings of the soft tissue, which follows the bones by the smooth warp and moves smoothly beside it."""

from __future__ import annotations

from copy import copy

import numpy as np
import torch

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.options import USUAL_EPSILON
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.registration.fit.soft_modes import DEVIATION_MM, SoftModes
from PolyPoseLib.registration.fit.soft_size import MotionEquations
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend, IndexField
from PolyPoseLib.rendering.rigid import Body, index_rays
from PolyPoseLib.warp.dense import displacement_field
from PolyPoseLib.warp.field_grids import POINTS_PER_CHUNK, flat_points
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff, WeightFrame
from PolyPoseLib.warp.weights import DistanceMaps, WeightForm, distance_maps

FIELD_MM = 8.0
"""Grid of the displacement field that the soft tissue is rendered through."""

MARGIN_MM = 30.0
"""Room around the CT for tissue that moves out of it."""

FIELDS_KEPT = 4
"""Fields of the latest poses: one level after another, and their checks, begin with the same ones."""

ATTACHED_MM = 15.0
"""Distance from the nearest bone at which half of the displacement beside the bones' own is left; bones have none."""


class SoftTissue:
    """The smooth warp of a scene, and what the soft tissue looks like under it.

    Parameters
    ----------
    scene : Scene
        The CT with its structures.
    frame, form, epsilon
        Of the weights, as in :class:`PolyrigidWarp`.
    rotation_reach_mm : float, optional
        Distance at which tissue takes half of a bone's rotation; None for no limit.
    device : torch.device, optional
        Where torch moves the tissue and takes its derivatives; None for compiled loops where numba is installed.

    """

    def __init__(
        self,
        scene: Scene,
        frame: WeightFrame = "moving",
        form: WeightForm = "rigid",
        epsilon: float = USUAL_EPSILON,
        rotation_reach_mm: float | None = None,
        device: torch.device | None = None,
    ) -> None:
        self.scene, self.device = scene, device
        self.frame: WeightFrame = frame
        self.form: WeightForm = form
        self.epsilon = epsilon
        self._rotation_falloff = (
            RotationFalloff(rotation_reach_mm, scene.centres) if rotation_reach_mm is not None else None
        )
        affine, shape = scene.ct_affine, scene.structures.labels.shape
        self._grid = covering_grid(affine, shape, FIELD_MM, MARGIN_MM)
        self._maps: list[DistanceMaps] = []
        self._followed: dict[bytes, DisplacementField] = {}
        self.modes = SoftModes.covering(*self._grid)
        self.coefficients: np.ndarray | None = None
        self._equations: MotionEquations | None = None

    def with_motion(self, coefficients: np.ndarray, equations: MotionEquations | None = None) -> SoftTissue:
        """The same with a motion beside the bones'.

        Parameters
        ----------
        coefficients : (M, 3) ndarray
            Of the modes, mm along LPS x, y, z.
        equations : MotionEquations, optional
            Those that led to it.

        """
        other = copy(self)
        other.coefficients, other._equations = coefficients, equations
        return other

    def of_likeliest_size(self) -> SoftTissue:
        """The same with the motion that is likeliest where its size a priori is the one that the X-rays suggest."""
        if self._equations is None:
            return self
        return self.with_motion(self._equations.likeliest, self._equations)

    @property
    def sizes(self) -> np.ndarray:
        """(3,) shares of the modes' variances a priori, along LPS x, y, z, that the X-rays suggest; 1 without them."""
        return np.ones(3) if self._equations is None else self._equations.sizes

    @property
    def deviation_mm(self) -> np.ndarray | None:
        """(3,) how far tissue moves by itself where no bone holds it, along LPS x, y, z; None where nobody asked.

        Standard deviations a priori, of the size that the X-rays suggest.
        """
        return None if self.coefficients is None else DEVIATION_MM * np.sqrt(self.sizes)

    def warp(self, distances: DistanceMaps, poses: np.ndarray) -> PolyrigidWarp:
        """The warp of fixed to moving points for poses (K, 4, 4)."""
        share = self.scene.structures.volume_share()
        centre = self.scene.anchor_centre
        return PolyrigidWarp(
            distances, share, poses, self.frame, self.form, self.epsilon, centre, self._rotation_falloff
        )

    def coarse_field(self, poses: np.ndarray) -> DisplacementField:
        """Displacements (mm) on a grid of FIELD_MM."""
        return self.moved(self.following(poses))

    def following(self, poses: np.ndarray) -> DisplacementField:
        """The part of :meth:`coarse_field` that follows the bones; not to be written to."""
        key = poses.tobytes()
        if key not in self._followed:
            if len(self._followed) >= FIELDS_KEPT:
                self._followed.pop(next(iter(self._followed)))
            affine, shape = self._grid
            warp = self.warp(self._distances()[0], poses)
            self._followed[key] = displacement_field(warp, affine, shape, device=self.device)
        return self._followed[key]

    def moved(self, field: DisplacementField, freedom: np.ndarray | None = None) -> DisplacementField:
        """A field that follows the bones, with the motion beside it; freedom: its, where it is known already."""
        if self.coefficients is None:
            return field
        beside = self.modes.on_grid(self.coefficients, field.affine, field.shape, self.device)
        beside *= (self.freedom(field) if freedom is None else freedom)[..., None]
        return DisplacementField(field.vectors + beside, field.affine)

    def motion_around(self, point: np.ndarray) -> float:
        """How far (mm) the soft tissue around a bone at a fixed ``point`` (3,) LPS mm moved by itself."""
        if self.coefficients is None:
            return 0.0
        return float(np.linalg.norm(self.modes.at(point[None])[0] @ self.coefficients))

    def freedom(self, field: DisplacementField) -> np.ndarray:
        """(k, j, i) share, 0 to 1, of the motion beside the bones' that tissue at a field's nodes takes part in."""
        vectors = field.vectors.reshape(-1, 3)
        share = np.empty(len(vectors), np.float32)
        for start in range(0, len(vectors), POINTS_PER_CHUNK):
            part = slice(start, min(start + POINTS_PER_CHUNK, len(vectors)))
            nodes = flat_points(field.affine, field.shape, part.start, part.stop)
            places = torch.as_tensor((nodes + vectors[part]).astype(np.float32), device=self.device)
            squared = self._distances()[1](places)[0].cpu().numpy() ** 2
            share[part] = squared / (squared + ATTACHED_MM**2)
        return share.reshape(field.shape)

    def _distances(self) -> list[DistanceMaps]:
        """Distance maps of every structure, and of the nearest one."""
        if not self._maps:
            each = distance_maps(self.scene.structures, self.scene.ct_affine, FIELD_MM / 2, MARGIN_MM)
            each = each.to(self.device)
            self._maps += [each, DistanceMaps(each.signed.amin(dim=0, keepdim=True), each.affine)]
        return self._maps

    def render(
        self,
        field: DisplacementField,
        camera: Camera,
        correction: np.ndarray,
        size_mm: float,
        backend: Backend,
    ) -> np.ndarray:
        """Line integrals of the soft tissue warped by a field.

        Parameters
        ----------
        field : DisplacementField
            Fixed to moving, mm; see :meth:`coarse_field`.
        camera : Camera
            Of the X-ray at its resolution.
        correction : (4, 4) ndarray
            Of the camera, fixed to fixed.
        size_mm : float
            Of voxels and ray steps.
        backend : Backend
            Carries out the rays.

        Returns
        -------
        (H, W) ndarray
            float32.

        """
        body = self.scene.volume("soft", size_mm)
        rays = index_rays(body, camera, correction, (0, camera.height, 0, camera.width), size_mm)
        if not field.vectors.any():  # at rest
            return backend.project(body.voxels, rays, False, body.occupied)[0]
        index_field = in_index_units(field, body, MARGIN_MM)
        return backend.project_warped(body.voxels, index_field, rays, body.occupied)


def in_index_units(field: DisplacementField, body: Body, margin_mm: float) -> IndexField:
    """The field in the index units of a body whose axes are parallel to the field's."""
    to_field = np.linalg.inv(field.affine) @ body.affine
    vectors = field.vectors @ body.world_to_index[:3, :3].T
    margin = margin_mm / np.linalg.norm(body.affine[:3, :3], axis=0)
    return IndexField(
        np.ascontiguousarray(vectors, np.float32),
        np.diag(to_field)[:3].copy(),
        to_field[:3, 3].copy(),
        -margin,
        np.array(body.voxels.shape[::-1]) - 1 + margin,
    )
