"""A simulated case on its way to a study: what lies in the beam, what the detector stores, and what the study says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.simulation.xray_physics import XrayPhysics

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.simulation.simulate import SimulatedCase

DISPLAY_BITS = 12
"""Depth of grey levels as a workstation exports them, unless a degradation says less."""


@dataclass(frozen=True)
class Stated:
    """What the study says of one X-ray's geometry.

    Attributes
    ----------
    extrinsic : ndarray (4, 4)
        World LPS mm to camera.
    source_to_detector_mm : float
    pixel_spacing_mm : (float, float)
        Between rows and between columns, at the detector if the study is right.
    principal_point_px : (float, float) or None
        (column, row); None says nothing, which means the image's centre.

    """

    extrinsic: np.ndarray
    source_to_detector_mm: float
    pixel_spacing_mm: tuple[float, float]
    principal_point_px: tuple[float, float] | None = None


@dataclass(frozen=True)
class View:
    """One X-ray from the tube to the study.

    Attributes
    ----------
    camera : Camera
        The one that took it; the truth.
    body, line : ndarray (H, W)
        Noise-free line integrals of the patient alone, and of all that lies in the beam.
    leaves : ndarray (H, W) or None
        Share (0 to 1) of the beam that the collimator lets through; None: all of it.
    image : ndarray (H, W) float32
        What is stored: line integrals as measured or, with grey_bits, grey levels from 0 to 1.
    grey_bits : int
        0 for line integrals; otherwise the depth in which grey levels (bone bright) are stored.
    blanked : ndarray (H, W) bool or None
        Pixels that the workstation paints over.
    stated : Stated
        What the study says.

    """

    camera: Camera
    body: np.ndarray
    line: np.ndarray
    image: np.ndarray
    stated: Stated
    leaves: np.ndarray | None = None
    blanked: np.ndarray | None = None
    grey_bits: int = 0


@dataclass(frozen=True)
class DegradedCase:
    """A case whose X-rays or inputs have faults; the truth stays that of `case`.

    Attributes
    ----------
    case : SimulatedCase
        The truth. Its own images and initial cameras are those without faults.
    views : tuple of View
    ct, structures, source_labels
        As the study gives them, right or wrong.
    camera_state : str
        "initial", "known" or "absent", as the study says of all cameras.
    physics : XrayPhysics
        Of the detector.
    given_to_true : ndarray (4, 4)
        From the world of the given CT to that of the true one: where a voxel lies and where it should.
    size_factor : float
        Size of the anatomy relative to the original one; tolerances in mm scale with it.
    names : tuple of str
        The degradations, in the order in which they were made.

    """

    case: SimulatedCase
    views: tuple[View, ...]
    ct: Volume
    structures: Structures
    source_labels: Volume | None
    camera_state: str
    physics: XrayPhysics
    given_to_true: np.ndarray = field(default_factory=lambda: np.eye(4))
    size_factor: float = 1.0
    names: tuple[str, ...] = ()

    def with_views(self, change: Callable[[View, int], View]) -> DegradedCase:
        """The case with each view changed by a function of the view and its number."""
        return replace(self, views=tuple(change(view, number) for number, view in enumerate(self.views)))


def undegraded(case: SimulatedCase, source_to_detector_mm: float = 1020.0) -> DegradedCase:
    """The case as it is, without any fault.

    Parameters
    ----------
    case : SimulatedCase
        Whose images are those of the views.
    source_to_detector_mm : float
        Splits focal lengths into distance and pixel pitch.

    """
    views = []
    for number, camera in enumerate(case.cameras):
        image = case.images[number]
        stated = stated_of(case.initial_cameras[number], source_to_detector_mm)
        views.append(View(camera, case.clean_images[number], case.clean_images[number], image, stated))
    return DegradedCase(
        case, tuple(views), case.ct, case.structures, case.source_labels, "initial", case.options.physics
    )


def stated_of(camera: Camera, source_to_detector_mm: float) -> Stated:
    """What a study says of a camera whose distance to the detector is given."""
    rows, columns = (float(source_to_detector_mm / camera.intrinsics[axis, axis]) for axis in (1, 0))
    centre = [(camera.width - 1) / 2, (camera.height - 1) / 2]
    point = camera.intrinsics[:2, 2]
    told = None if np.allclose(point, centre, atol=1e-6) else (float(point[0]), float(point[1]))
    return Stated(camera.extrinsic, source_to_detector_mm, (rows, columns), told)


def grey_levels(view: View) -> np.ndarray:
    """The view's image as grey levels (H, W) from 0 to 1, bone bright, as a workstation first shows it."""
    if view.grey_bits:
        return view.image
    exposed = slice(None) if view.leaves is None else view.leaves > 0.5
    low, high = np.percentile(view.image[exposed], (0.1, 99.9))
    return np.clip((view.image - low) / max(high - low, 1e-6), 0, 1).astype(np.float32)


def with_grey(view: View, grey: np.ndarray, bits: int | None = None) -> View:
    """The view with an image of grey levels (H, W), clipped to 0 to 1; bits: None keeps the depth."""
    depth = bits or view.grey_bits or DISPLAY_BITS
    return replace(view, image=np.clip(grey, 0, 1).astype(np.float32), grey_bits=depth)
