"""The conventions by which joints are described: sequences of rotations, names and signs.

All of them look at bones through axes of which x points to the front, y to the head and z to the side, away from the
midline. Rotations follow each other about axes that move along: z, x', y'' is the joint coordinate system of Grood and
Suntay, whose first axis is fixed to the proximal bone, the third one to the distal bone, and the second one floats
perpendicular to both; y, x', y'' is what the ISB recommends for the shoulder.

References
----------
E. Grood and W. Suntay, "A joint coordinate system for the clinical description of three-dimensional motions:
application to the knee", J. Biomech. Eng. 105 (1983) 136-144.
G. Wu et al., "ISB recommendation on definitions of joint coordinate system of various joints for the reporting of human
joint motion", part I: ankle, hip, and spine, J. Biomech. 35 (2002) 543-548; part II: shoulder, elbow, wrist and hand,
J. Biomech. 38 (2005) 981-992.

"""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.data.tracking.joint_motion import Quantity


@dataclass(frozen=True)
class Convention:
    """How the motion of a joint is described.

    Parameters
    ----------
    sequence : {"zxy", "yxy"}
        Axes of the three rotations, in the order of the angles.
    angles : tuple of Quantity
        Names of the three angles.
    angle_signs : tuple of float
        By which the rotations are multiplied to become the angles.
    translations : tuple of Quantity
        Names of the three translations.
    translation_signs : tuple of float
        The same for translations.
    along_joint : bool
        Whether translations are measured along the axes of rotation, or along x, y and z of the proximal bone.

    """

    sequence: str
    angles: tuple[Quantity, Quantity, Quantity]
    angle_signs: tuple[float, float, float]
    translations: tuple[Quantity, Quantity, Quantity]
    translation_signs: tuple[float, float, float] = (1.0, 1.0, 1.0)
    along_joint: bool = True


_LATERAL = Quantity("lateral", "to the side, away from the midline")
_ANTERIOR = Quantity("anterior", "to the front")
_SUPERIOR = Quantity("superior", "to the head")
_PROXIMAL = Quantity("proximal", "toward the proximal bone")
_INTERNAL = Quantity("internal_rotation", "front toward the midline")

CONVENTION_TABLE: dict[str, Convention] = {
    "grood_suntay": Convention(
        "zxy",
        (
            Quantity("flexion", "the distal end moves back"),
            Quantity("adduction", "the distal end moves toward the midline (varus)"),
            Quantity("external_rotation", "front away from the midline"),
        ),
        (-1.0, 1.0, -1.0),
        (_LATERAL, _ANTERIOR, Quantity("distraction", "away from the proximal bone")),
        (1.0, 1.0, -1.0),
    ),
    "isb_hip": Convention(
        "zxy",
        (
            Quantity("flexion", "the distal end moves to the front"),
            Quantity("adduction", "the distal end moves toward the midline"),
            _INTERNAL,
        ),
        (1.0, 1.0, 1.0),
        (_LATERAL, _ANTERIOR, _PROXIMAL),
    ),
    "isb_ankle": Convention(
        "zxy",
        (
            Quantity("dorsiflexion", "toes up"),
            Quantity("inversion", "the sole turns toward the midline"),
            _INTERNAL,
        ),
        (1.0, 1.0, 1.0),
        (_LATERAL, _ANTERIOR, Quantity("compression", "toward the proximal bone")),
    ),
    "isb_spine": Convention(
        "zxy",
        (
            Quantity("extension", "the upper bone tilts back"),
            Quantity("lateral_bending", "the upper bone tilts to the right (to the joint's side, if it has one)"),
            Quantity("axial_rotation", "front to the left (toward the midline, if the joint has a side)"),
        ),
        (1.0, 1.0, 1.0),
        (Quantity("lateral", "to the right (to the joint's side, if it has one)"), _ANTERIOR, _SUPERIOR),
    ),
    "isb_shoulder": Convention(
        "yxy",
        (
            Quantity("plane_of_elevation", "0 is abduction, 90 flexion to the front"),
            Quantity("elevation", "lowering: elevation is negative, as the ISB has it"),
            _INTERNAL,
        ),
        (1.0, 1.0, 1.0),
        (_ANTERIOR, _SUPERIOR, _LATERAL),
        along_joint=False,
    ),
    "isb_elbow": Convention(
        "zxy",
        (
            Quantity("flexion", "the distal end moves to the front"),
            Quantity("carrying_angle", "the distal end moves toward the midline"),
            Quantity("pronation", "the thumb toward the midline"),
        ),
        (1.0, 1.0, 1.0),
        (_LATERAL, _ANTERIOR, _PROXIMAL),
    ),
    "isb_wrist": Convention(
        "zxy",
        (
            Quantity("flexion", "the hand toward the palm"),
            Quantity("ulnar_deviation", "the hand toward the little finger"),
            Quantity("pronation", "the thumb toward the palm"),
        ),
        (1.0, 1.0, 1.0),
        (Quantity("radial", "toward the thumb"), Quantity("volar", "toward the palm"), _PROXIMAL),
    ),
    "generic": Convention(
        "zxy",
        (
            Quantity("about_z", "x toward y; about the proximal bone's z"),
            Quantity("about_x", "y toward z; about the floating axis"),
            Quantity("about_y", "z toward x; about the distal bone's y"),
        ),
        (1.0, 1.0, 1.0),
        (
            Quantity("x", "along the proximal bone's x"),
            Quantity("y", "along the proximal bone's y"),
            Quantity("z", "along the proximal bone's z"),
        ),
        along_joint=False,
    ),
}  # fmt: skip
"""By name, in the order of :data:`PolyPoseLib.data.tracking.joints.CONVENTIONS`."""
