"""Metal and instruments in an X-ray: attenuation that the CT cannot explain, wherever its bones may have moved.

Least squares are drawn to such objects, and the local contrast around them drowns what lies beside: their pixels are
left out before anything is fitted. A pixel is foreign where the X-ray lies above the largest value that the rendering
of the CT takes nearby, the bones moved by any amount within reach, and belongs to a connected object with sharp edges.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import (
    binary_dilation,
    binary_erosion,
    binary_propagation,
    find_objects,
    gaussian_gradient_magnitude,
    label,
    maximum_filter,
    white_tophat,
)

from PolyPoseLib.geometry.grid import grown_box
from PolyPoseLib.registration.fit.levels import Level, Observation, binned, enlarged, pixel_size_mm
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.run import Run

LEVEL = Level(2.0, 14.0, 0)
"""Resolution at which objects are looked for."""

INITIAL_REACH_MM, REFINED_REACH_MM = 20.0, 12.0
"""How far soft tissue and anchor may be from where an initial camera puts them, and a refined one."""

BONE_REACH_MM = 60.0
"""How far bones may have moved."""

SURE, POSSIBLE = 0.4, 0.15
"""Line integrals above the explicable beyond which a pixel starts an object, and beyond which it continues one. A
Kirschner wire of 2 mm steel adds about 0.6, soft tissue of another density 0.2."""

EDGE_QUANTILE = 99.0
"""Percentile of the gradients of rendering and X-ray that an object's sharpest tenth must reach: gas, contrast medium
and another gray-level curve have soft edges."""

SHARPER = 1.05
"""How much sharper than anatomy an object's edges are: metal's 1.07 to 4, those of processed anatomy up to 1.03, with
few exceptions."""

THIN_MM = 10.0
"""Half the width of objects that are followed by their own contrast beyond what is surely foreign: rods over dense
anatomy."""

LEAST_PIXELS = 6
"""Of an object; smaller ones are noise."""

BORDER_MM = 3.0
"""Left out around an object: its edge is blurred."""

LARGEST_SHARE = 0.3
"""Of an X-ray; where more seems to be foreign, the X-ray and the CT are not comparable, and nothing is left out."""

_NEIGHBOURS = np.ones((3, 3), bool)


@dataclass(frozen=True)
class _Expected:
    """Renderings (H, W) of the CT at rest: whole, its soft tissue, and its moving bones alone."""

    whole: np.ndarray
    soft: np.ndarray
    bones: np.ndarray

    def largest(self, anatomy_px: int, bone_px: int) -> np.ndarray:
        """(H, W) the largest line integral that the anatomy can have at each pixel."""
        near, tissue = (maximum_filter(each, 2 * anatomy_px + 1) for each in (self.whole, self.soft))
        return np.maximum(near, tissue + maximum_filter(self.bones, 2 * bone_px + 1))


def foreign_objects(run: Run, observation: Observation, reach_mm: float = INITIAL_REACH_MM) -> np.ndarray:
    """Where an X-ray shows metal or instruments that the CT does not have.

    Parameters
    ----------
    run : Run
        The patient, at rest, and the renderer.
    observation : Observation
        The X-ray with its camera.
    reach_mm : float
        How far the camera may put soft tissue and anchor from where they are.

    Returns
    -------
    (H, W) ndarray
        bool, True where a pixel is to be left out.

    """
    if run.scene.bare:  # it does not explain soft tissue either
        return np.zeros(observation.image.shape, bool)
    level = LevelViews(run, [observation], LEVEL)
    height = level.views[0].target.shape[0]
    pixel_mm = pixel_size_mm(level.views[0].camera, run.scene.anchor_centre)
    factor = observation.image.shape[0] // height
    image, mask = binned(observation.image, observation.mask, factor)
    expected = _expected(run, level)
    measured = in_line_integrals(image, mask, expected.whole)
    if measured is None:
        return np.zeros(observation.image.shape, bool)
    reach, bone_reach, thin = (max(1, round(each / pixel_mm)) for each in (reach_mm, BONE_REACH_MM, THIN_MM))
    excess = np.where(mask, measured - expected.largest(reach, bone_reach), -1.0)
    thin_contrast = np.where(mask, np.asarray(white_tophat(measured, 2 * thin + 1)), 0.0)
    candidates = grown(excess > SURE, excess > POSSIBLE)
    found = _objects(candidates, thin_contrast, _edges(measured, expected.whole, mask, candidates))
    return enlarged(left_out(found, mask, pixel_mm), factor, observation.image.shape)


def without_foreign_objects(
    run: Run, observation: Observation, reach_mm: float = INITIAL_REACH_MM
) -> Observation:
    """The X-ray with foreign objects left out of its mask."""
    return observation.without(foreign_objects(run, observation, reach_mm))


def _expected(run: Run, level: LevelViews) -> _Expected:
    problem, state = level.posed_structures(run.scene.rest_poses)
    whole, parts = problem.render(state, 0)
    bones = np.zeros_like(whole)
    for k in run.scene.moving:
        bones[parts[k].slices] = np.maximum(bones[parts[k].slices], parts[k].image)
    return _Expected(whole, level.views[0].static, bones)


def left_out(found: np.ndarray, mask: np.ndarray, pixel_mm: float) -> np.ndarray:
    """(H, W) bool: objects with their blurred edges inside a mask; nothing where that is too much of it."""
    if not found.any():
        return found
    bordered = binary_dilation(found, iterations=max(1, round(BORDER_MM / pixel_mm))) & mask
    return bordered if bordered.sum() <= LARGEST_SHARE * mask.sum() else np.zeros_like(mask)


def in_line_integrals(image: np.ndarray, mask: np.ndarray, whole: np.ndarray) -> np.ndarray | None:
    """The X-ray in the rendering's unit, by the quartiles of both inside the patient; None without enough of it."""
    inside = mask & (whole > 0.05)
    if inside.sum() < 100:
        return None
    low, middle, high = np.percentile(image[inside], (25, 50, 75))
    expected = np.percentile(whole[inside], (25, 50, 75))
    spread = expected[2] - expected[0]
    if not (high > low and spread > 0):
        return None
    return (image - middle) * spread / (high - low) + expected[1]


def _edges(measured: np.ndarray, whole: np.ndarray, mask: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """(H, W) gradients of the X-ray, in units of the sharpest that anatomy has, which candidates are not."""
    anatomy = mask & ~np.asarray(binary_dilation(candidates, iterations=3), dtype=bool)
    inner = np.asarray(binary_erosion(anatomy, iterations=3), dtype=bool)
    steep = [gaussian_gradient_magnitude(each, 0.7) for each in (measured, whole)]
    limit = max(
        (float(np.percentile(each[inner], EDGE_QUANTILE)) for each in steep if inner.any()), default=1.0
    )
    return np.where(np.asarray(binary_erosion(mask), dtype=bool), steep[0], 0) / max(limit, 1e-6)


def _objects(candidates: np.ndarray, thin_contrast: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(H, W) bool: connected candidates with sharp edges; rods to their ends."""
    found = np.zeros_like(candidates)
    for around, one in sharp_pieces(candidates, edges):
        found[around] |= one
        contrast = float(np.median(thin_contrast[around][one]))
        if contrast > SURE:
            piece = np.zeros_like(candidates)
            piece[around] = one
            whole = grown(piece, thin_contrast > contrast / 2)
            if _is_sharp(whole & ~piece, edges):  # not where it runs into anatomy
                found |= whole
    return found


def sharp_pieces(candidates: np.ndarray, edges: np.ndarray) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
    """Connected candidates (H, W) bool with sharp edges: where each lies, and which pixels there are its own."""
    numbered = np.zeros(candidates.shape, np.int32)
    label(candidates, _NEIGHBOURS, output=numbered)
    for number, box in enumerate(find_objects(numbered), start=1):
        around = grown_box(box, 1, candidates.shape)
        one = numbered[around] == number
        if one.sum() >= LEAST_PIXELS and _is_sharp(one, edges[around]):
            yield around, one


def _is_sharp(region: np.ndarray, edges: np.ndarray) -> bool:
    """Whether the sharpest tenth of a region's border is sharper than anatomy."""
    border = np.asarray(binary_dilation(region), dtype=bool)
    return bool(border.any() and np.percentile(edges[border], 90) >= SHARPER)


def grown(seeds: np.ndarray, possible: np.ndarray) -> np.ndarray:
    """(H, W) bool: what of the possible is connected with the seeds."""
    return np.asarray(binary_propagation(seeds, _NEIGHBOURS, mask=possible))
