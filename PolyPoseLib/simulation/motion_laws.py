"""Motions of a joint or a trunk over time: bending, walking, breathing, opening the mouth, or only swaying.

Axes are those of a supine or standing patient in LPS: x to the left, y to the back, z to the head.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.simulation.hinges import hinge_centre
from PolyPoseLib.simulation.limb_motions import articulated
from PolyPoseLib.simulation.motion import bone_kind, draw_motions, rigid_about
from PolyPoseLib.simulation.motions_in_time import (
    Course,
    Joint,
    JointedMotion,
    Motion,
    scaled_posture,
    there_and_back,
)
from PolyPoseLib.simulation.moving_scene import coarser
from PolyPoseLib.simulation.named_motions import Anatomy, Posture, lacking, named_posture
from PolyPoseLib.simulation.simulation_limits import AMPLITUDES, DRAWN, require_motion
from PolyPoseLib.simulation.soft_motion import SoftMotion

MOTIONS = (*AMPLITUDES, DRAWN, "still")
"""Motions over time by name; "drawn" goes to a posture drawn at random and back, "still" does nothing by itself."""

FLEXION_DEG = 60.0
"""Of flexion where no amplitude is given; of other motions the postures' (`AMPLITUDES`)."""

GAIT_PERIOD_S, BREATH_PERIOD_S = 1.1, 4.0
"""Of a cycle where none is given; others take the whole sequence."""

PATELLA_SHARE = 0.65
"""Flexion of the patella against the femur over the knee's: about 40 degrees at 60 (a rounded value)."""

PATELLA_SINKS_MM = 5.0
"""How much nearer the patella comes to the knee's axis meanwhile: condyles are flatter below than in front."""

_KNEE_COURSE = ((0, 5), (15, 18), (40, 5), (60, 35), (73, 60), (87, 25), (100, 5))
_HIP_COURSE = ((0, 30), (25, 12), (50, -10), (65, 0), (85, 33), (100, 30))
"""Flexion in degrees over percent of a stride of normal walking, from heel strike (after J. Perry and J. Burnfield,
"Gait Analysis", 2010, rounded)."""

_HIP_DEG = 30.0
"""Flexion of the hip at heel strike in these courses."""

_LOWER_LEG, _PELVIS, _FOREARM = (
    ("lower_leg", "tibia"),
    ("pelvis", "hip", "sacrum"),
    ("forearm", "radius", "ulna"),
)


@dataclass(frozen=True)
class TimedMotion:
    """A motion with what soft organs do meanwhile.

    Attributes
    ----------
    bones : Motion
        All bones.
    soft : SoftMotion, optional
        Displacements where the course is 1.
    course : Course, optional
        Of the soft organs.

    """

    bones: Motion
    soft: SoftMotion | None = None
    course: Course | None = None

    def on_coarser_voxels(self, ct: Volume, size_mm: float) -> TimedMotion:
        """With lungs on the voxels of `moving_scene.coarser` in place of the CT's."""
        if self.soft is None or self.soft.lungs is None:
            return self
        share = coarser(Volume(self.soft.lungs.astype(np.float32), ct.affine), size_mm).voxels
        return replace(self, soft=replace(self.soft, lungs=share > 0.5))

    def soft_at(self, second: float) -> SoftMotion | None:
        """What soft organs do at one time."""
        if self.soft is None or self.course is None:
            return None
        share = float(self.course(np.array([second]))[0])
        return SoftMotion(self.soft.points, share * self.soft.displacements, self.soft.lungs)


def motion_over_time(
    motion: str,
    amplitude: float | None,
    anatomy: Anatomy,
    times: tuple[float | None, float],
    rng: np.random.Generator,
    whole: Joint | None = None,
) -> TimedMotion:
    """A named motion over time.

    Parameters
    ----------
    motion : str
        One of MOTIONS.
    amplitude : float, optional
        Degrees, or mm of breathing.
    anatomy : Anatomy
        What moves; its anchor is the bone that the others move against.
    times : (float or None, float)
        Seconds of a cycle, and of the whole sequence, which is a cycle's where none is given and the motion has none of
        its own.
    rng : np.random.Generator
        Draws what differs from person to person.
    whole : Joint, optional
        What the whole patient does besides.

    Raises
    ------
    InputError
        No such motion, an amplitude beyond its limits, or an anatomy that lacks what it needs.

    """
    if motion not in MOTIONS:
        raise InputError(unknown_name("motion", motion, MOTIONS))
    names = anatomy.structures.names
    if motion == "still":
        return TimedMotion(JointedMotion(names, {}, whole))
    if motion == DRAWN:
        require_motion(motion, amplitude)
        drawn = Posture(draw_motions(anatomy.structures, anatomy.affine, anatomy.anchor, rng))
        return TimedMotion(scaled_posture(names, drawn, there_and_back(times[0] or times[1]), whole))
    usual = FLEXION_DEG if motion == "flexion" else AMPLITUDES[motion].usual
    size = usual if amplitude is None else amplitude
    require_motion(motion, size)
    cycle, duration = times
    period = cycle or {"gait": GAIT_PERIOD_S, "breathing": BREATH_PERIOD_S}.get(motion, duration)
    if motion in ("flexion", "gait"):
        law: Callable[..., dict[str, Joint]] = flexion if motion == "flexion" else gait
        return TimedMotion(JointedMotion(names, law(anatomy, size, period, rng), whole))
    posture = named_posture(motion, size, anatomy, rng)
    course = there_and_back(period)
    return TimedMotion(scaled_posture(names, posture, course, whole), posture.soft, course)


def flexion(
    anatomy: Anatomy, amplitude: float, period_s: float, rng: np.random.Generator
) -> dict[str, Joint]:
    """Bend the hips, else the knees, else the elbows, else the spine, else the first joint, and stretch them again.

    The bone turns about its own axis and sideways meanwhile, and its surface rolls and slides, all of them other
    functions of the flexion; a patella follows the femur's groove.
    """
    bent = _bent(anatomy)
    course = there_and_back(period_s)
    joints = _tree(anatomy)
    for name in bent:
        sign = 1.0 if name in anatomy.find(_LOWER_LEG) else -1.0
        size = amplitude / len(bent) if bone_kind(name) == "spine" else amplitude
        joints[name] = _hinge(anatomy, name, joints[name], (sign * size, course), rng)
        if sign > 0:
            joints |= _patellae(anatomy, joints, joints[name], (size, course))
    return joints


def gait(anatomy: Anatomy, amplitude: float, period_s: float, rng: np.random.Generator) -> dict[str, Joint]:
    """Walk: hips and knees bend as in a stride whose hip flexes by amplitude (degrees) at heel strike.

    Of a single knee the knee bends alone. Raises InputError unless there are both femora and the pelvis as the anchor,
    or a lower leg with a femur.
    """
    joints = _tree(anatomy)
    size = amplitude / _HIP_DEG
    hips = [name for name in anatomy.find(("femur",)) if name != anatomy.anchor]
    if not anatomy.find(_PELVIS):
        hips = []
    knees = [name for name in anatomy.find(_LOWER_LEG) if name != anatomy.anchor and anatomy.find(("femur",))]
    if not knees and not hips:
        raise lacking("gait", "a femur and the pelvis, or a lower leg and a femur", anatomy)
    leading = ("left", "right")[rng.integers(2)]
    for name in [*hips, *knees]:
        late = 0.5 if len(hips) > 1 and leading not in name.lower() else 0.0
        stride = _KNEE_COURSE if name in knees else _HIP_COURSE
        course = _periodic(stride, period_s, late)
        sign = 1.0 if name in knees else -1.0
        joints[name] = _hinge(anatomy, name, joints[name], (sign * size * 60.0, course), rng)
        if name in knees:
            joints |= _patellae(anatomy, joints, joints[name], (size * 60.0, course))
    spine = [name for name in anatomy.structures.names if bone_kind(name) == "spine" and name in joints]
    for name in spine:
        turn = np.radians([0.0, 0.0, amplitude / 6 / len(spine)])
        swing = _swing(period_s)
        joints[name] = Joint(joints[name].parent, joints[name].centre, [(turn, swing)])
    return joints


def _bent(anatomy: Anatomy) -> list[str]:
    """Bones that a flexion turns."""
    hips, knees, elbows = (
        [name for name in anatomy.find(words) if name != anatomy.anchor] if anatomy.find(parents) else []
        for words, parents in ((("femur",), _PELVIS), (_LOWER_LEG, ("femur",)), (_FOREARM, ("humerus",)))
    )
    others = [name for name in anatomy.structures.names if name != anatomy.anchor]
    spine = [name for name in others if bone_kind(name) == "spine"]
    if not others:
        raise lacking("flexion", "two bones", anatomy)
    return hips or knees or elbows or spine or others[:1]


def _tree(anatomy: Anatomy) -> dict[str, Joint]:
    """All joints, at rest; parents before children."""
    return {name: Joint(each.parent, each.joint) for name, each in articulated(anatomy, {}).items()}


def _hinge(
    anatomy: Anatomy, name: str, joint: Joint, bend: tuple[float, Course], rng: np.random.Generator
) -> Joint:
    """A joint that bends about the x axis by degrees over a course, with what goes with it."""
    degrees, course = bend
    bone, parent = anatomy.points[name], anatomy.points[joint.parent]
    centre = joint.centre if "femur" in name.lower() else hinge_centre(bone, parent, joint.centre)
    share = abs(degrees) / 60.0
    axis = np.array([1.0, *rng.normal(0, 0.04, 2)])
    turn = np.radians(degrees) * axis / np.linalg.norm(axis)
    twist = np.radians(rng.uniform(4.0, 9.0) * share * rng.choice([-1.0, 1.0]))
    sideways = np.radians(rng.uniform(1.0, 3.0) * share * rng.choice([-1.0, 1.0]))
    slides = (
        share * np.array([0.0, -rng.uniform(1.5, 3.5), 0.0]),
        share * np.array([rng.uniform(-1, 1), 0, -1.0]),
    )
    early = lambda seconds: 2 * course(seconds) - course(seconds) ** 2  # noqa: E731
    late = lambda seconds: course(seconds) ** 2  # noqa: E731
    return Joint(
        joint.parent,
        centre,
        [(turn, course), (np.array([0, 0, twist]), early), (np.array([0, sideways, 0]), late)],
        [(slides[0], late), (slides[1], early)],
    )


def _patellae(
    anatomy: Anatomy, joints: dict[str, Joint], knee: Joint, bend: tuple[float, Course]
) -> dict[str, Joint]:
    """Patellae of the same femur, which turn about the knee's centre and come nearer to it."""
    degrees, course = bend
    moved = {}
    for name in anatomy.find(("patella",)):
        if name == anatomy.anchor or joints[name].parent != knee.parent:
            continue
        turn = PATELLA_SHARE * knee.turns[0][0]
        away = anatomy.points[name].mean(0) - knee.centre
        there = rigid_about(np.zeros(3), turn, np.zeros(3))[:3, :3] @ away
        inwards = -there / np.linalg.norm(there) * PATELLA_SINKS_MM * degrees / 60.0
        tilt = np.radians([0.0, 0.0, 4.0 * degrees / 60.0])
        late = lambda seconds: course(seconds) ** 2  # noqa: E731
        moved[name] = Joint(knee.parent, knee.centre, [(turn, course), (tilt, late)], [(inwards, course)])
    return moved


def _periodic(knots: tuple[tuple[int, int], ...], period_s: float, late: float) -> Course:
    """A course through degrees over percent of a period, as shares of 60 degrees, which is smooth where it repeats.

    late: share of the period by which it lags.
    """
    percent, degrees = np.array(knots, dtype=np.float64).T
    spline = CubicSpline(percent / 100, degrees / 60, bc_type="periodic")
    return lambda seconds: spline((np.asarray(seconds) / period_s - late) % 1.0)


def _swing(period_s: float) -> Course:
    """To and fro once in a period."""
    return lambda seconds: np.sin(2 * np.pi * np.asarray(seconds) / period_s)
