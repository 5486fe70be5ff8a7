"""Volumes carried through the dense transform."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.carried import require_frame
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.warp.dense import warp_labels, warp_volume
from PolyPoseLib.warp.inverse import invert_field


def carry_volume(result: Result, volume: Volume, to: str, labels: bool) -> Volume:
    """A volume in the frame ``to``, on its own grid and in its own type; see ``Result.transform_image``."""
    field = resampling_field(result, to)
    if labels:
        return warp_labels(volume, field)
    outside = float(volume.voxels.min())
    carried = warp_volume(volume, field, outside=outside)
    kind = volume.voxels.dtype
    if not np.issubdtype(kind, np.integer):
        return carried.with_voxels(carried.voxels.astype(kind))
    limits = np.iinfo(kind)
    return carried.with_voxels(np.clip(np.rint(carried.voxels), limits.min, limits.max).astype(kind))


def resampling_field(result: Result, to: str) -> DisplacementField:
    """Displacements of points of the frame ``to``, through which images are resampled into it."""
    if require_frame(to) == "xray":
        return result.transform
    if result.inverse_transform is not None:
        return result.inverse_transform
    return invert_field(result.transform).field
