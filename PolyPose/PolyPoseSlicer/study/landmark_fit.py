"""The camera that picked landmarks give, how well it fits each of them, and what makes it uncertain."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

from ..scene.landmark_lists import Pairs
from ..scene.pixel_frames import file_to_source

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray
    from PolyPoseLib.geometry.pnp import PnpSolution


@dataclass(frozen=True)
class LandmarkFit:
    """solution: None when no camera follows; problem: then the sentence that says why.

    warnings: clauses that say why the camera is uncertain. projected: (N, 2) pixels of the file.
    """

    pairs: Pairs
    solution: PnpSolution | None = None
    problem: str = ""
    warnings: tuple[str, ...] = ()
    projected: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def sure(self) -> bool:
        """Whether the camera may be used without being reviewed."""
        return self.solution is not None and not self.warnings


def fit_landmarks(pairs: Pairs, xray: Xray) -> LandmarkFit:
    """Solve for the camera of an X-ray (intrinsics and size as seen from the source); never raises for the pairs."""
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.geometry.pnp import FEWEST, camera_from_landmarks
    from PolyPoseLib.registration.cameras.initial import landmark_problems

    count = len(pairs.names)
    if count < FEWEST:
        missing = FEWEST - count
        return LandmarkFit(
            pairs,
            problem=_("{count} of at least {fewest} pairs: pick {missing} more, on the anchor.").format(
                count=count, fewest=FEWEST, missing=missing
            ),
        )
    turned = file_to_source(xray.image.shape[1], xray.mirrored)[:2, [0, 1, 3]]
    pixels = np.column_stack([pairs.pixels, np.ones(count)]) @ turned.T
    detector = Camera(xray.intrinsics, np.eye(4), *xray.image.shape)
    try:
        found = camera_from_landmarks(pairs.points, pixels, detector, _("The landmarks"))
    except InputError as error:
        return LandmarkFit(pairs, problem=str(error))
    projected = np.column_stack([found.camera.project(pairs.points), np.ones(count)]) @ turned.T
    return LandmarkFit(pairs, found, "", tuple(landmark_problems(found)), projected)


def fit_sentence(fit: LandmarkFit) -> str:
    """A fit in a few lines for people."""
    lines = []
    if fit.solution is None:
        lines.append(fit.problem)
    else:
        degrees, millimetres = fit.solution.radius
        lines.append(
            _(
                "{used} of {count} landmarks used, RMS error {rms:.1f} mm; expected accuracy of the camera: "
                "{degrees:.1f} deg and {mm:.0f} mm."
            ).format(
                used=int(fit.solution.inliers.sum()),
                count=len(fit.pairs.names),
                rms=fit.solution.rms_mm,
                degrees=degrees,
                mm=millimetres,
            )
        )
    if fit.warnings:
        lines.append(_("Uncertain: {why}.").format(why="; ".join(fit.warnings)))
    for names, text in (
        (fit.pairs.ct_alone, _("Only in the CT: {names}.")),
        (fit.pairs.xray_alone, _("Only in the X-ray: {names}.")),
        (fit.pairs.off_image, _("Not on the X-ray: {names}; pick them in the X-ray's own view.")),
    ):
        if names:
            lines.append(text.format(names=", ".join(names)))
    return "\n".join(lines)
