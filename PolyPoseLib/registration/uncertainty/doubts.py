"""Why a pose is doubtful, in the words of the person who looks at the X-rays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.errors import listed
from PolyPoseLib.registration.bones.agreement import Agreement
from PolyPoseLib.registration.bones.rows import Break
from PolyPoseLib.registration.bones.visibility import Visibility
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.registration.uncertainty.covariance import NORMAL_95, PoseUncertainty
from PolyPoseLib.registration.uncertainty.intervals import HIDDEN_SHARE, UNCONFIRMED_MM
from PolyPoseLib.registration.uncertainty.united import UnitedBones, in_mm
from PolyPoseLib.registration.uncertainty.widths import Widths

WIDE_MM = 5.0
"""Half width of a 95 % interval beyond which a pose is doubtful."""

WIDE_POINTS_MM = 6.0
"""The same of its points, turns included. A right clavicle or rib, which may turn about itself, comes up to that."""

VAGUE_MM = float(np.hypot(NORMAL_95 * UNCONFIRMED_MM, WIDE_MM))
"""Half width of a 95 % interval across the beam, by the images alone, beyond which a pose is hardly more than a guess:
of a bone that no X-ray shows clearly, and whose residual alone leaves a wide interval. Either alone is no sign of a
wrong pose: a CT clipped to soft tissue leaves most right bones of a chest unclear, by 3 to 5 mm besides."""

OUTSIDE, HIDDEN, CLIPPED = 0.25, 0.1, 0.25
"""Shares of a structure beside the picture, behind metal, or clipped by a window that are worth a word."""

FAINT = 0.03
"""Contrast of a structure, in variances of the X-ray's local contrast, below which it stands out little."""

FAINT_LABEL = "it hardly stands out in the X-rays, as marrow without its cortex"

LEAST_RIVAL_MM = 2.0
"""Other places nearer than that are the same one."""


@dataclass(frozen=True)
class Evidence:
    """What is known of the structures' poses.

    Attributes
    ----------
    names : sequence of str
        Of the N X-rays.
    agreement : Agreement
        Of K structures with them.
    visibility : Visibility
        Of the same.
    uncertainties : mapping of int to PoseUncertainty
        By structure; those of inconsistent ones do not matter, and it may be empty.
    widths : mapping of int to Widths
        Of the same structures.
    distorted : sequence of bool
        Which X-rays may be.
    magnification : float
        How many times the scene is larger than the patient.
    breaks : sequence of Break
        Of rows of companions, the widest first.
    label_names : mapping of int to str
        Of the segmentation's labels, as far as they are known.

    """

    names: Sequence[str]
    agreement: Agreement
    visibility: Visibility
    uncertainties: Mapping[int, PoseUncertainty]
    widths: Mapping[int, Widths]
    distorted: Sequence[bool]
    magnification: float = 1.0
    breaks: Sequence[Break] = ()
    label_names: Mapping[int, str] = field(default_factory=dict)


def doubts_about(scene: Scene, evidence: Evidence) -> dict[int, tuple[str, ...]]:
    """Reasons to doubt poses.

    Parameters
    ----------
    scene : Scene
        The structures.
    evidence : Evidence
        What is known of their poses.

    Returns
    -------
    dict of int to tuple of str
        Clauses, the gravest first, by the index of every structure that is inconsistent, that no X-ray shows, whose
        interval is wide, or that unites bones which moved against each other; only for the last is the anchor doubted.

    """
    agreement = evidence.agreement
    inconsistent = agreement.inconsistent(scene.anchor)
    contradicted = agreement.contradicted
    doubts: dict[int, tuple[str, ...]] = {}
    if agreement.parts_off(scene.anchor):
        doubts[scene.anchor] = (_united(scene, evidence).clause(scene.anchor),)
    for k in scene.moving:
        if agreement.is_unseen[k]:
            doubts[k] = (FAINT_LABEL if agreement.is_faint[k] else "it shows in no X-ray",)
        elif k in inconsistent:
            against = _those(evidence.names, contradicted[k])
            doubts[k] = (f"its rendering does not match {against}", *_causes(scene, evidence, k))
        elif _is_wide(evidence, k):
            doubts[k] = tuple(_causes(scene, evidence, k)) or ("the X-rays determine its pose weakly",)
        elif agreement.is_faint[k]:
            doubts[k] = (FAINT_LABEL,)
        elif agreement.parts_off(k):
            doubts[k] = (_united(scene, evidence).clause(k),)
    return doubts


def _is_wide(evidence: Evidence, k: int) -> bool:
    """Whether a structure's interval is wide or, where none was asked for, would be for what is known without it."""
    if k in evidence.uncertainties:
        centroid_mm, points_mm = evidence.uncertainties[k].widest_mm, evidence.widths[k].points_mm
        return centroid_mm > WIDE_MM or points_mm > WIDE_POINTS_MM
    slipped = any(k in each.slipped and each.apart_mm > WIDE_MM for each in evidence.breaks)
    hidden = evidence.visibility.hidden_share[k] >= HIDDEN_SHARE
    return bool(slipped or hidden or not evidence.agreement.is_clear[k])


def united_warnings(scene: Scene, evidence: Evidence) -> list[str]:
    """Warnings about structures that unite bones which moved against each other."""
    united = _united(scene, evidence)
    return [united.warning(k) for k in range(len(scene.names)) if evidence.agreement.parts_off(k)]


def _united(scene: Scene, evidence: Evidence) -> UnitedBones:
    return UnitedBones(
        scene.names, evidence.agreement, scene.anchor, evidence.magnification, evidence.label_names
    )


def reasons_against_most(scene: Scene, evidence: Evidence) -> list[str]:
    """A reason for distrust where X-rays contradict, hardly show or hardly place more than half of what may move.

    Structures that lie in no X-ray do not count.
    """
    agreement, inconsistent = evidence.agreement, evidence.agreement.inconsistent(scene.anchor)
    moving = [k for k in scene.moving if agreement.in_picture[k] or k in inconsistent]
    faint = [k for k in moving if agreement.is_faint[k]]
    against = [k for k in inconsistent if k not in faint]
    vague = [
        k
        for k in moving
        if k in evidence.widths
        and evidence.widths[k].across_mm > VAGUE_MM
        and k not in faint
        and k not in against
    ]
    if 2 * len(faint + against + vague) <= len(moving):
        return []
    said, checks = [], []
    if against:
        poses = (
            "pose of the only structure that may move and that they show"
            if len(moving) == 1
            else f"poses of {len(against)} of {len(moving)} structures"
        )
        said.append(f"contradict the {poses}")
        checks.append("the cameras")
    if faint:
        said.append(f"hardly show {len(faint)} of {len(moving)} structures that lie in them")
    if vague:
        within = in_mm(VAGUE_MM / evidence.magnification)
        said.append(
            f"leave {len(vague)} of {len(moving)} structures uncertain by more than {within} across the beam"
        )
        checks.append("that the X-rays are sharp, well exposed and free of distortion")
    if faint or vague:
        checks.append("that each label covers a whole bone, with its cortex")
    checks.append("whether CT, labels and X-rays belong together")
    return [f"The X-rays {listed(said)}: check {listed(checks)}."]


def unseen_warnings(scene: Scene, evidence: Evidence) -> list[str]:
    """Warnings about structures that show in no X-ray, or do not stand out as bones do."""
    agreement = evidence.agreement
    return [
        f'The structure "{name}" hardly stands out in the X-rays in which it lies: its pose is an estimate with a wide '
        "uncertainty. Check that its label covers the whole bone, with its cortex."
        if agreement.is_faint[k]
        else f'The structure "{name}" shows in no X-ray: its pose is an estimate with a wide uncertainty.'
        for k, name in enumerate(scene.names)
        if agreement.is_unseen[k] or agreement.is_faint[k]
    ]


def disputed_warnings(scene: Scene, evidence: Evidence) -> list[str]:
    """Warnings about structures that some X-rays contradict while others show them where they are."""
    agreement = evidence.agreement
    against, support = agreement.contradicted, agreement.supported
    warnings = []
    for k in scene.moving:
        if agreement.disputed[k]:
            warnings.append(
                f'Something covers or changes "{scene.names[k]}" in {_those(evidence.names, against[k])}, where its '
                f"rendering does not match: its pose rests mostly on {_those(evidence.names, support[k])}; check it "
                "in the overlay."
            )
    return warnings


def _causes(scene: Scene, evidence: Evidence, k: int) -> Iterator[str]:
    """What makes a pose doubtful, as far as the X-rays tell."""
    agreement, visibility = evidence.agreement, evidence.visibility
    for n, name in enumerate(evidence.names):
        if visibility.hidden[k, n] >= HIDDEN:
            yield f"metal or an instrument hides {visibility.hidden[k, n]:.0%} of it in {label_of(name)}"
    for n, name in enumerate(evidence.names):
        if visibility.clipped[k, n] >= CLIPPED:
            yield f"{visibility.clipped[k, n]:.0%} of it is all black or all white in {label_of(name)}"
    for n, name in enumerate(evidence.names):
        if visibility.outside[k, n] >= OUTSIDE:
            yield f"{visibility.outside[k, n]:.0%} of it lies beside the picture of {label_of(name)}"
    if any(evidence.distorted):
        yield f"distortion may be left in {_those(evidence.names, np.array(evidence.distorted))}"
    apart = next((each for each in evidence.breaks if k in each.slipped), None)
    if apart is not None:
        moved, across = apart.apart_mm / evidence.magnification, scene.names[apart.across]
        bones = "it has" if len(apart.slipped) == 1 else f"it and {_others(scene, apart, k)} have"
        yield f'{bones} moved {in_mm(moved)} against "{across}" beside it'
    rival = evidence.uncertainties[k].rival_mm if k in evidence.uncertainties else 0.0
    if rival >= LEAST_RIVAL_MM:
        yield f"another place, {in_mm(rival / evidence.magnification)} away, fits the X-rays as well"
    if not agreement.is_clear[k]:
        yield "no X-ray shows it clearly"
    if agreement.parts_off(k):
        yield _united(scene, evidence).clause(k)
    shows = ~np.isnan(agreement.contrast[k])
    if shows.sum() == 1:
        yield f"only {_those(evidence.names, shows)} shows it"
    if shows.any() and np.nanmax(agreement.contrast[k]) < FAINT:
        yield "it stands out little from the soft tissue"


def _others(scene: Scene, apart: Break, k: int) -> str:
    """The bones that slipped with another."""
    return listed([f'"{scene.names[other]}"' for other in apart.slipped if other != k])


def _those(names: Sequence[str], which: np.ndarray) -> str:
    """The X-rays whose flag in ``which`` (N,) is set."""
    return listed([label_of(name) for name, each in zip(names, which, strict=True) if each])
