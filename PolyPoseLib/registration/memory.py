"""How much memory a registration will take, from the sizes of its study alone.

The numbers were measured (``Testing/Benchmarks/memory.py``): 1.4 million to 105 million voxels, 4 to 26 structures, 16
threads at most. They are a little larger than what was measured.
"""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.memory_need import MIB, MemoryNeed
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.study import Study
from PolyPoseLib.geometry.grid import block_factors, covering_grid
from PolyPoseLib.registration.fit.soft_modes import SoftModes
from PolyPoseLib.registration.fit.soft_tissue import FIELD_MM
from PolyPoseLib.registration.fit.soft_tissue import MARGIN_MM as FIELD_MARGIN_MM
from PolyPoseLib.registration.outputs import TRANSFORM_MM, transform_grid
from PolyPoseLib.registration.scene import WORKING_MM
from PolyPoseLib.warp.dense import VOXELS_PER_SLAB
from PolyPoseLib.warp.weights import MARGIN_MM as MAPS_MARGIN_MM
from PolyPoseLib.warp.weights import MEMORY_BUDGET_BYTES

_INPUT = 8
"""Bytes per voxel of the CT (float32), its structures and its labels."""

_WORKING = 13
"""Bytes per working voxel that the scene keeps."""

_SCENE = 25
"""Bytes per working voxel while the scene is made."""

_OUTPUT = 6
"""Bytes per voxel of the warped CT and the warped labels."""

_NODE = 56
"""Bytes per node of the transform, of its inverse, and while it is fitted to the bones."""

_SLAB = 150
"""Bytes per node of a slab of the transform that is worked on."""

_PIXEL = 40
"""Bytes per pixel of an X-ray, with its mask, its noise and its renderings."""

_COMPOSED = 24
"""More bytes per voxel where the CT is composed of rigid bones."""

_DERIVATIVE = 20
"""Bytes per pixel of a derivative of the soft tissue's rendering while it is normalised."""

SOFT_MM = 3.0
"""Finest level at which the soft tissue's motion is fitted."""

_PAPER_PIXELS = 180 * 180
_PAPER_WEIGHTS, _PAPER_MAPS, _PAPER_JACOBIANS = 768 * MIB, 384 * MIB, 256 * MIB
"""Bounds of the preset "paper" on what it keeps."""


def needed_memory(study: Study, options: Options, warps: bool = True, compiles: bool = False) -> MemoryNeed:
    """What the registration of a study takes.

    Parameters
    ----------
    study : Study
        Only its sizes count.
    options : Options
        Preset, spacing of the transform, composition and threads count.
    warps : bool
        Whether the CT is warped in the end; the search of cameras does not.
    compiles : bool
        Whether loops have still to be compiled.

    """
    voxels, count = study.ct.voxels.size, len(study.structures)
    working = voxels / np.prod(block_factors(study.ct.affine, WORKING_MM), dtype=float)
    views = [float(xray.image.size) for xray in study.xrays]
    kept = _INPUT * voxels + _PIXEL * sum(views)
    scene = kept + _SCENE * working
    _, coarse = covering_grid(study.ct.affine, study.ct.shape, FIELD_MM / 2, FIELD_MARGIN_MM)
    kept += _WORKING * working + 4 * count * np.prod(coarse, dtype=float)
    fit = kept + _fit_bytes(study, options)
    _, nodes, _ = transform_grid(study.ct, options.transform_spacing_mm or TRANSFORM_MM)
    transform = float(np.prod(nodes, dtype=float))
    warp = kept + _maps_bytes(study, MEMORY_BUDGET_BYTES) + _OUTPUT * voxels
    warp += _NODE * transform + _SLAB * min(transform, 1.2 * VOXELS_PER_SLAB)
    if options.composed:
        warp += _COMPOSED * voxels
    loaded = _INPUT * voxels + _PIXEL * sum(views) / 4
    return MemoryNeed.of_program(max(scene, fit, warp if warps else 0), loaded, options.threads, compiles)


def _fit_bytes(study: Study, options: Options) -> float:
    """What the fit of the bones takes beyond what is kept."""
    count = len(study.structures)
    extent = np.sort(np.array(study.ct.shape[::-1]) * study.ct.spacing)
    if options.preset != "paper":
        pixels = extent[1] * extent[2] / WORKING_MM**2
        bones = 24 * pixels * count + 60 * pixels * len(study.xrays)
        return max(bones, _soft_motion_bytes(study, extent))
    samples = _PAPER_PIXELS * len(study.xrays) * extent[2] / study.ct.spacing.min()
    return (
        min(4 * count * samples, _PAPER_WEIGHTS)
        + min(24 * count * _PAPER_PIXELS * len(study.xrays), _PAPER_JACOBIANS)
        + _maps_bytes(study, _PAPER_MAPS)
        + 8 * study.ct.voxels.size
    )


def _soft_motion_bytes(study: Study, extent: np.ndarray) -> float:
    """What the fit of the soft tissue's motion takes: derivatives by all modes of one view, and of the voxels."""
    grid = covering_grid(study.ct.affine, study.ct.shape, FIELD_MM, FIELD_MARGIN_MM)
    derivatives = _DERIVATIVE * 3 * SoftModes.covering(*grid).count * extent[1] * extent[2] / SOFT_MM**2
    return derivatives + 16 * float(np.prod(extent)) / SOFT_MM**3


def _maps_bytes(study: Study, most: float) -> float:
    """The distance maps on the CT's grid, which are made coarser to fit, and what making one of them takes."""
    pad = 2 * np.ceil(MAPS_MARGIN_MM / study.ct.spacing)[::-1]
    nodes = float(np.prod(np.array(study.ct.shape) + pad))
    count = len(study.structures)
    return min(4 * count * nodes, most) * (1 + 1 / count)
