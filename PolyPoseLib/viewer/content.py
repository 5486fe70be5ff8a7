"""Everything that the page shows of one result, as values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.carrying.surfaces import Surface
from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.data.options import Weighting
from PolyPoseLib.data.result import CameraResult, Result
from PolyPoseLib.data.volume import Volume

COLOURS = (
    "#e6c84f", "#5fb3e8", "#e8795f", "#7fce7a", "#c68be0", "#f0a04b", "#66d0c0", "#e58bb3", "#a3b8f0", "#c2cf5a",
    "#d9a58c", "#8fd6f2",
)  # fmt: skip
"""Of structures, in turn; light enough for the dark page and told apart by names as well."""


@dataclass(frozen=True)
class Bone:
    """One structure.

    Attributes
    ----------
    name, colour
        As shown; the colour is "#rrggbb".
    surface
        Where `motion` starts from, LPS mm: the CT's frame, or that of the X-rays where the CT's labels are not known.
    motion
        (4, 4) rigid, from `surface` to the patient as X-rayed.

    """

    name: str
    colour: str
    surface: Surface
    motion: np.ndarray


@dataclass(frozen=True)
class View:
    """One X-ray.

    Attributes
    ----------
    camera
        As found.
    rendering
        (H, W) the CT rendered with the poses found.
    xray
        (H, W) the X-ray, bone bright; None where neither the result nor a study has it.
    mask
        (H, W) where the X-ray was compared; None where no study was given.
    detector_mm
        Distance of the detector from the source; None where it is not known.
    outlines
        Of every bone, as X-rayed, closed polygons (N, 2) in pixels (column, row).
    outlines_before
        The same with bones where the CT has them; empty where the CT's labels are not known.

    """

    camera: CameraResult
    rendering: np.ndarray
    xray: np.ndarray | None
    mask: np.ndarray | None
    detector_mm: float | None
    outlines: tuple[list[np.ndarray], ...]
    outlines_before: tuple[list[np.ndarray], ...]


@dataclass(frozen=True)
class NamedPoints:
    """Points of the CT and where they are in the patient as X-rayed.

    Attributes
    ----------
    names
        N labels.
    in_ct
        (N, 3) LPS mm.
    carried
        The same points as X-rayed, with their covariances.

    """

    names: tuple[str, ...]
    in_ct: np.ndarray
    carried: CarriedPoints


@dataclass(frozen=True)
class Content:
    """What the page shows.

    Attributes
    ----------
    result
        As read.
    before
        The CT at rest.
    before_text
        What `before` is, in words.
    bones, views
        Structures and X-rays.
    at_rest_known
        Whether surfaces of bones are in the CT's frame.
    labels
        Structures on the CT's grid, 1 for the first bone; None where they are not known.
    weighting
        Of the structures' motions in the warp.
    points
        Carried points, or None.
    notes
        What is missing of the page and how to get it.

    """

    result: Result
    before: Volume
    before_text: str
    bones: tuple[Bone, ...]
    views: tuple[View, ...]
    at_rest_known: bool
    labels: Volume | None
    weighting: Weighting
    points: NamedPoints | None
    notes: tuple[str, ...]
