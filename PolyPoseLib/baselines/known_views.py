"""X-rays of a study with their cameras, as systems take them that do not look for cameras."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.outputs import transform_grid
from PolyPoseLib.warp.field_grids import flat_points

FIELD_MM = 4.0
"""Coarsest spacing of a motion's field."""

SLAB_POINTS = 1 << 20


def known_views(study: Study) -> list[Observation]:
    """Every X-ray with its camera, whether it is known or initial.

    Raises
    ------
    InputError
        An X-ray has no extrinsic.

    """
    views = []
    for xray in study.xrays:
        if xray.extrinsic is None:
            raise InputError(
                f"{label_of(xray.name)} has no camera, and this system looks for none: give it an extrinsic."
            )
        height, width = xray.image.shape
        camera = Camera(xray.intrinsics, xray.extrinsic, height, width)
        views.append(Observation(xray.image, xray.mask, camera))
    return views


def over_the_ct(field: DisplacementField, ct: Volume) -> DisplacementField:
    """A field on a grid of at most FIELD_MM that covers the CT; beyond its own nodes it stays as at the nearest one."""
    affine, shape, _ = transform_grid(ct, FIELD_MM)
    vectors = np.empty((*shape, 3), np.float32)
    flat, total = vectors.reshape(-1, 3), int(np.prod(shape))
    for start in range(0, total, SLAB_POINTS):
        stop = min(start + SLAB_POINTS, total)
        flat[start:stop] = field.sample(flat_points(affine, shape, start, stop))
    return DisplacementField(vectors, affine)
