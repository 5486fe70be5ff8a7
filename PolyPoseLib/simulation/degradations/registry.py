"""All degradations by name, and how a case is degraded by some of them."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.simulation.degradations import (
    bedside,
    collimation,
    distortion,
    fillings,
    given_ct,
    handling,
    implants,
    instruments,
    markers,
    patient,
    processing,
    stated_geometry,
)
from PolyPoseLib.simulation.degradations.degraded_case import DegradedCase, grey_levels, undegraded, with_grey
from PolyPoseLib.simulation.degradations.detector import exposed

if TYPE_CHECKING:
    from PolyPoseLib.simulation.simulate import SimulatedCase

Change = Callable[[DegradedCase, np.random.Generator], DegradedCase]

STAGES = ("patient", "beam", "processing", "handling", "study")
"""In this order things happen, however the names are given: the patient lies down, things come into the beam, the
detector measures, the workstation processes, pictures are handed on, the study is written."""

ACTS_ON = ("image", "camera", "CT", "labels", "study")
"""Pixels; the true camera; the CT's voxels or grid; the labels; what the study says of distances and cameras."""


@dataclass(frozen=True)
class Degradation:
    """One kind of fault.

    Attributes
    ----------
    name, description : str
        The description is one line for people.
    stage : str
        One of STAGES.
    acts_on : tuple of str
        Of ACTS_ON.
    recoverable : bool
        Whether the information needed is still there: then a refusal of bones that are right is a false alarm.
    right_outcome : str
        What the program ought to do.
    change : callable
        From a DegradedCase and a Generator to a DegradedCase.

    """

    name: str
    description: str
    stage: str
    acts_on: tuple[str, ...]
    recoverable: bool
    right_outcome: str
    change: Change


_RIGHT = "bones right within 1.5 times the clean error, no alarm"
_IMPLANT = "the bone with the implant within 2.5 mm, the others as without it"
_REFUSED = "refused or distrusted, or the bones flagged; never a wrong pose in silence"
_RIGHT_OR_FLAGGED = "bones right, or flagged with an interval that holds the truth"


def _kinds() -> tuple[Degradation, ...]:
    image, study, ct, labels = ("image",), ("study",), ("CT",), ("labels",)
    grid = ("CT", "labels")
    rows: tuple[tuple[str, Change, str, tuple[str, ...], bool, str, str], ...] = (
        ("eight_bit", processing.eight_bit, "processing", image, True, _RIGHT,
         "a gray picture of 256 levels"),
        ("gamma", processing.gamma, "processing", image, True, _RIGHT,
         "a gamma curve, brighter in one view and darker in the next"),
        ("window_clipped", processing.window_clipped, "processing", image, True, _RIGHT,
         "a narrow window: soft tissue black, dense bone white"),
        ("clahe", processing.clahe, "processing", image, True, _RIGHT,
         "contrast-limited adaptive histogram equalisation"),
        ("unsharp", processing.unsharp, "processing", image, True, _RIGHT,
         "unsharp masking with seams along edges"),
        ("multi_scale", processing.multi_scale, "processing", image, True, _RIGHT,
         "multi-scale contrast amplification, as radiography rooms process"),
        ("inverted", handling.inverted, "handling", image, True,
         "polarity found, bones right, with a warning", "polarity inverted and not declared"),
        ("mirrored", handling.mirrored, "handling", image, False, _REFUSED,
         "pictures mirrored left-right and not declared"),
        ("views_exchanged", handling.views_exchanged, "handling", ("image", "camera"), False, _REFUSED,
         "the X-rays filed under each other's camera"),
        ("view_twice", handling.view_twice, "handling", ("image", "camera", "study"), False, _REFUSED,
         "the first X-ray given again in the last one's place"),
        ("cropped", handling.cropped, "handling", ("image", "camera"), True,
         _RIGHT, "cropped off the middle, principal point not given"),
        ("collimation_square", collimation.collimation_square, "beam", image, True, _RIGHT,
         "collimator leaves along the sides, with scatter and noise behind them, not declared"),
        ("collimation_tilted", collimation.collimation_tilted, "beam", image, True, _RIGHT,
         "tilted collimator leaves, with scatter and noise behind them, not declared"),
        ("collimation_round", collimation.collimation_round, "beam", image, True, _RIGHT,
         "a round iris, painted black outside, not declared"),
        ("collimation_black", collimation.collimation_black, "beam", image, True, _RIGHT,
         "collimator leaves painted black, a seam of scatter left, not declared"),
        ("lead_letters", markers.lead_letters, "beam", image, True, _RIGHT,
         "side letters of lead on the detector"),
        ("burned_text", markers.burned_text, "handling", image, True, _RIGHT,
         "text and a scale burned into an 8-bit picture"),
        ("ecg_leads", bedside.ecg_leads, "beam", image, True, _RIGHT,
         "electrodes and cables on the patient's front"),
        ("table_rails", bedside.table_rails, "beam", image, True, _RIGHT,
         "steel rails of a table behind the patient"),
        ("k_wires", instruments.k_wires, "beam", image, True, _RIGHT,
         "Kirschner wires in two bones"),
        ("retractor", instruments.retractor, "beam", image, True, _RIGHT,
         "two Hohmann retractors at a bone"),
        ("clamp", instruments.clamp, "beam", image, True, _RIGHT,
         "a bone-holding clamp with finger rings"),
        ("prosthesis", implants.prosthesis, "beam", image, False, _IMPLANT,
         "a hip (in a chest: shoulder) prosthesis that the CT does not show"),
        ("pedicle_screws", implants.pedicle_screws, "beam", image, False, _IMPLANT,
         "pedicle screws and rods that the CT does not show"),
        ("contrast", fillings.contrast, "beam", image, True, _RIGHT,
         "contrast medium in the bladder and in the great vessel"),
        ("bowel_gas", fillings.bowel_gas, "beam", image, True, _RIGHT,
         "gas in the bowel where the CT has none"),
        ("intensifier", distortion.intensifier, "beam", image, False, _RIGHT_OR_FLAGGED,
         "an image intensifier's pincushion and S distortion, round field, not calibrated"),
        ("distance_wrong", stated_geometry.distance_wrong, "study", study, False, _RIGHT_OR_FLAGGED,
         "source-to-detector distance stated 12 % too large"),
        ("spacing_at_isocentre", stated_geometry.spacing_at_isocentre, "study", study, False, _RIGHT_OR_FLAGGED,
         "pixel spacing at the patient stated as the detector's"),
        ("patient_moved", patient.patient_moved, "patient", ("image", "camera"), True,
         _RIGHT, "the whole patient moved by 4 degrees and 10 mm between the views"),
        ("patient_moved_known_cameras", patient.patient_moved_known_cameras, "patient",
         ("image", "camera", "study"), False, _REFUSED,
         "the same with cameras that the study calls known"),
        ("limb_moved", patient.limb_moved, "patient", image, False,
         "the limb flagged, the other bones right", "one limb moved by 6 degrees between the views"),
        ("small_bones", patient.small_bones, "patient", ACTS_ON, True,
         "bones right relative to their size", "anatomy of a quarter of the size on a finer detector"),
        ("ct_cut_short", given_ct.ct_cut_short, "study", grid, True, _RIGHT,
         "the CT ends within bones that the X-rays show"),
        ("ct_raw_values", given_ct.ct_raw_values, "study", ct, False, _REFUSED,
         "CT in stored values, 1024 too high"),
        ("ct_raw_padding", given_ct.ct_raw_padding, "study", ct, False, _REFUSED,
         "CT in stored values, with a padding of -2000"),
        ("ct_soft_window", given_ct.ct_soft_window, "study", ct, True,
         "bones right, with a warning", "CT clipped to a soft-tissue window"),
        ("ct_slice_distance", given_ct.ct_slice_distance, "study", grid, False, _REFUSED,
         "slices stated 10 % too far apart"),
        ("ct_bone_only", given_ct.ct_bone_only, "study", ct, True, _RIGHT,
         "everything outside the labelled bones is air"),
        ("labels_mirrored", given_ct.labels_mirrored, "study", labels, False, _REFUSED,
         "labels mirrored left-right"),
        ("labels_shifted", given_ct.labels_shifted, "study", labels, False, _REFUSED,
         "labels 24 mm beside the bones"),
    )  # fmt: skip
    return tuple(
        Degradation(name, description, stage, acts_on, recoverable, outcome, change)
        for name, change, stage, acts_on, recoverable, outcome, description in rows
    )


DEGRADATIONS: dict[str, Degradation] = {kind.name: kind for kind in _kinds()}


OF_TWO_VIEWS = (
    "views_exchanged",
    "view_twice",
    "patient_moved",
    "patient_moved_known_cameras",
    "limb_moved",
)
"""Degradations that are faults between views."""


def degrade(
    case: SimulatedCase,
    names: Sequence[str],
    seed: int | None = None,
    source_to_detector_mm: float = 1020.0,
    camera: str = "initial",
) -> DegradedCase:
    """Degrade a case by some kinds together.

    Parameters
    ----------
    case : SimulatedCase
        It is left as it is.
    names : sequence of str
        Of DEGRADATIONS. Their order does not matter, except within one stage.
    seed : int or None
        Of every random choice; None takes the case's. A kind draws the same numbers whatever others there are.
    source_to_detector_mm : float
        Splits focal lengths into distance and pixel pitch.
    camera : str
        What the study says of the cameras: "initial", "known" (then true ones) or "absent".

    Returns
    -------
    DegradedCase
        The same arguments give the same case, bit for bit.

    Raises
    ------
    InputError
        A name that is none, or one that is given twice, or one of OF_TWO_VIEWS where the case has one view.

    """
    require_degradations(names)
    between = [name for name in names if name in OF_TWO_VIEWS]
    if between and len(case.images) < 2:
        raise InputError(f'The degradation "{between[0]}" needs two views: the case has one.')
    degraded = replace(undegraded(case, source_to_detector_mm), camera_state=camera)
    if camera == "known":
        degraded = _with_true_cameras(degraded)
    chosen = sorted((DEGRADATIONS[name] for name in names), key=lambda kind: STAGES.index(kind.stage))
    stages = [kind.stage for kind in chosen]
    for number, kind in enumerate(chosen):
        if number == sum(stage in ("patient", "beam") for stage in stages):
            degraded = _pictures(degraded, exposure=number > 0)
        stream = [case.seed if seed is None else seed, zlib.crc32(kind.name.encode())]
        degraded = kind.change(degraded, np.random.default_rng(stream))
    if stages and all(stage in ("patient", "beam") for stage in stages):
        degraded = _pictures(degraded, exposure=True)
    return replace(degraded, names=tuple(kind.name for kind in chosen))


def require_degradations(names: Sequence[str]) -> None:
    """Raise InputError for a name that is no degradation's, or is given twice."""
    for number, name in enumerate(names):
        if name not in DEGRADATIONS:
            raise InputError(unknown_name("degradation", name, tuple(DEGRADATIONS)))
        if name in names[:number]:
            raise InputError(f'The degradation "{name}" is given twice: give it once.')


def _pictures(degraded: DegradedCase, exposure: bool) -> DegradedCase:
    """What the detector measures of all that lies in the beam, with what the workstation paints over."""
    if not exposure:
        return degraded

    def paint(view, _):
        if view.blanked is None:
            return view
        return with_grey(view, np.where(view.blanked, 0, grey_levels(view)))

    return exposed(degraded).with_views(paint)


def _with_true_cameras(degraded: DegradedCase) -> DegradedCase:
    """The case whose study states the true poses of the cameras."""
    return degraded.with_views(
        lambda view, _: replace(view, stated=replace(view.stated, extrinsic=view.camera.extrinsic))
    )
