"""Renderings of the soft tissue, which follows the bones by the smooth warp."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend, IndexField
from PolyPoseLib.rendering.rigid import Body, index_rays
from PolyPoseLib.warp.dense import displacement_field
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff, WeightFrame
from PolyPoseLib.warp.weights import DistanceMaps, WeightForm, distance_maps

FIELD_MM = 8.0
"""Grid of the displacement field that the soft tissue is rendered through."""

MARGIN_MM = 30.0
"""Room around the CT for tissue that moves out of it."""


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

    """

    def __init__(
        self,
        scene: Scene,
        frame: WeightFrame = "moving",
        form: WeightForm = "rigid",
        epsilon: float = 0.1,
        rotation_reach_mm: float | None = None,
    ) -> None:
        self.scene = scene
        self.frame: WeightFrame = frame
        self.form: WeightForm = form
        self.epsilon = epsilon
        self._rotation_falloff = (
            RotationFalloff(rotation_reach_mm, scene.centres) if rotation_reach_mm is not None else None
        )
        self._coarse: DistanceMaps | None = None
        affine, shape = scene.ct_affine, scene.structures.labels.shape
        self._grid = covering_grid(affine, shape, FIELD_MM, MARGIN_MM)

    def warp(self, distances: DistanceMaps, poses: np.ndarray) -> PolyrigidWarp:
        """The warp of fixed to moving points for poses (K, 4, 4)."""
        share = self.scene.structures.volume_share()
        centre = self.scene.anchor_centre
        return PolyrigidWarp(
            distances, share, poses, self.frame, self.form, self.epsilon, centre, self._rotation_falloff
        )

    def coarse_field(self, poses: np.ndarray) -> DisplacementField:
        """Displacements (mm) on a grid of FIELD_MM."""
        if self._coarse is None:
            structures, affine = self.scene.structures, self.scene.ct_affine
            self._coarse = distance_maps(structures, affine, FIELD_MM / 2, MARGIN_MM)
        affine, shape = self._grid
        return displacement_field(self.warp(self._coarse, poses), affine, shape)

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
