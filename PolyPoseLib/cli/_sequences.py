"""Simulated sequences on the command line: their arguments, checks, and the folder that is written."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.simulation_limits import DRAWN, require_in_range

if TYPE_CHECKING:
    from PolyPoseLib.cli._patients import Patient
    from PolyPoseLib.simulation.sequence_options import SequenceOptions

VIEW_ANGLES = 20.0, 70.0
"""Angle of the first view and arc of the views of a sequence, where none are given; one view looks from the side."""

DETECTOR_MM = 300.0


def add_sequence_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of sequences."""
    group = parser.add_argument_group("sequences of frames")
    group.add_argument(
        "--frames", type=int, metavar="N", help="make a sequence of N frames instead of a study"
    )
    group.add_argument(
        "--frames-per-second", type=float, default=30.0, metavar="X", help="of all cameras (default: 30)"
    )
    group.add_argument(
        "--poses", type=Path, metavar="CSV", help="move as this table says, such as the poses.csv of a track"
    )
    group.add_argument(
        "--phantom",
        type=int,
        metavar="SEED",
        help="a drawn knee of this seed in place of a CT; sequences only",
    )
    group.add_argument(
        "--period",
        type=float,
        metavar="S",
        help="of a cycle (default: gait 1.1, breathing 4, else the sequence)",
    )
    group.add_argument(
        "--sway",
        type=float,
        nargs=2,
        default=[2.0, 1.0],
        metavar=("MM", "DEG"),
        help="slow motion of the whole patient; 0 0 keeps the anchor still (default: 2 1)",
    )
    group.add_argument(
        "--first-angle",
        type=float,
        metavar="DEG",
        help="of the first view; 90 is from the left (default: 20)",
    )
    group.add_argument(
        "--detector",
        type=float,
        default=DETECTOR_MM,
        metavar="MM",
        help="side of the detector (default: 300)",
    )
    group.add_argument(
        "--own-world",
        action="store_true",
        help="a world of the rig that is any rigid transform away from the CT's",
    )
    group.add_argument(
        "--initial-error",
        type=float,
        nargs=2,
        default=[1.0, 1.0],
        metavar=("DEG", "MM"),
        help="of the initial poses (default: 1 1)",
    )
    group.add_argument(
        "--ct-reach",
        type=float,
        metavar="MM",
        help="give the CT only so far from the middle of its bones; they go on beyond it in the X-rays",
    )
    group.add_argument(
        "--shutter",
        type=float,
        default=0.0,
        metavar="X",
        help="share of a frame's time that blurs it (default: 0)",
    )
    group.add_argument(
        "--lead-in",
        type=int,
        nargs="+",
        default=[],
        metavar="N",
        help="images that each camera took before frame 0",
    )
    group.add_argument(
        "--blank",
        type=int,
        default=0,
        metavar="N",
        help="images of every camera without exposure (default: 0)",
    )
    group.add_argument(
        "--repeated",
        type=int,
        default=0,
        metavar="N",
        help="images of every camera stored twice (default: 0)",
    )


def is_sequence(arguments: argparse.Namespace) -> bool:
    """Whether the arguments ask for a sequence; raises InputError for arguments of one without it."""
    if arguments.frames is not None or arguments.poses is not None:
        return True
    for name, usual in _usual_values().items():
        if getattr(arguments, name) != usual:
            raise InputError(
                f"--{name.replace('_', '-')} is of sequences: give --frames as well, or leave it out."
            )
    return False


def _usual_values() -> dict[str, object]:
    """{argument of sequences: its default}."""
    parser = argparse.ArgumentParser(add_help=False)
    add_sequence_arguments(parser)
    return vars(parser.parse_args([]))


def check_sequence(arguments: argparse.Namespace) -> None:
    """Check the numbers of a sequence, before any work; raises InputError that names the argument."""
    from PolyPoseLib.simulation.moving_degradations import require_moving_degradations
    from PolyPoseLib.simulation.sequence_options import LIMITS

    for argument, option in (
        ("frames", "frames"),
        ("frames_per_second", "frames_per_second"),
        ("shutter", "shutter"),
    ):
        value = getattr(arguments, argument)
        if value is not None:
            kind = "whole number" if isinstance(value, int) else "number"
            require_in_range(value, LIMITS[option], f"--{argument.replace('_', '-')}", kind)
    for value, option in zip(arguments.sway, ("sway_mm", "sway_deg"), strict=True):
        require_in_range(value, LIMITS[option], "--sway")
    for value, limits in zip(arguments.initial_error, ((0.0, 180.0), (0.0, 1000.0)), strict=True):
        require_in_range(value, limits, "--initial-error")
    require_in_range(arguments.detector, (1.0, 10_000.0), "--detector")
    if arguments.ct_reach is not None:
        require_in_range(arguments.ct_reach, (1.0, 10_000.0), "--ct-reach")
    if arguments.period is not None:
        require_in_range(arguments.period, (0.01, 1e6), "--period")
    if arguments.first_angle is not None:
        require_in_range(arguments.first_angle, (-360.0, 360.0), "--first-angle")
    for name in ("blank", "repeated"):
        require_in_range(getattr(arguments, name), (0, 1_000_000), f"--{name}", "whole number")
    for count in arguments.lead_in:
        require_in_range(count, (0, 1_000_000), "--lead-in", "whole number")
    if len(arguments.lead_in) > arguments.views:
        raise InputError(
            f"--lead-in has {len(arguments.lead_in)} numbers for {arguments.views} cameras: give one each."
        )
    if arguments.motion_scale != 1:
        raise InputError("--motion-scale is of studies: a sequence takes --amplitude.")
    if arguments.poses is not None and arguments.motion != DRAWN:
        raise InputError("--poses says what moves: leave out --motion.")
    if arguments.camera == "absent":
        raise InputError("The cameras of a sequence are known: leave out --camera.")
    if arguments.format == "nifti":
        raise InputError(
            'A sequence is written as "dicom" or "tiff": leave out --format, or give one of these.'
        )
    if arguments.phantom is not None:
        require_in_range(arguments.phantom, (0, 2**31 - 1), "--phantom", "whole number")
        if arguments.sample or arguments.ct or arguments.segmentation or arguments.structures:
            raise InputError(
                "--phantom takes the place of a CT: leave out --sample, --ct and what belongs to them."
            )
    require_moving_degradations(arguments.degrade)


def write_sequence_folder(
    patient: Patient, arguments: argparse.Namespace, distances: tuple[float, float], folder: Path
) -> None:
    """Simulate a sequence and write it into an empty folder; raises InputError for wrong input.

    distances: from the source to the detector and to the isocentre, mm.
    """
    from PolyPoseLib.cli._console import ProgressBar
    from PolyPoseLib.io.disk_space import require_space
    from PolyPoseLib.io.tracking.given_poses import read_poses
    from PolyPoseLib.io.tracking.simulated import bytes_of, require_writable, write_sequence
    from PolyPoseLib.simulation.sequences import rig_cameras, simulate_sequence

    ct, structures = patient.ct, patient.structures
    poses = None
    if arguments.poses is not None:
        poses = read_poses(arguments.poses, structures.names, structures.centroids(ct.affine))[
            : arguments.frames
        ]
        if arguments.frames is not None and len(poses) < arguments.frames:
            raise InputError(f"{arguments.poses}: the table has {len(poses)} frames, fewer than --frames.")
    cameras = rig_cameras(
        ct,
        structures,
        view_angles(arguments),
        arguments.pixels,
        arguments.detector,
        distances[0],
        distances[1],
    )
    sequence = simulate_sequence(
        ct,
        structures,
        cameras,
        poses,
        arguments.seed,
        sequence_options(arguments, poses, structures.index(patient.reference)),
        patient.reference,
        (patient.labels, patient.label_names),
        tuple(arguments.initial_error),
    )
    if arguments.ct_reach is not None:
        sequence = sequence.cut(arguments.ct_reach)
    image_format = "dicom" if arguments.format is None else arguments.format
    require_writable(sequence, image_format)
    require_space(arguments.output, bytes_of(sequence))
    bar = ProgressBar()
    try:
        write_sequence(sequence, folder, image_format, distances[0], patient.landmarks, bar, patient.joints)
    finally:
        bar.close()


def view_angles(arguments: argparse.Namespace) -> list[float]:
    """Angles of the views in degrees."""
    from PolyPoseLib.simulation.simulate import arc_angles

    arc = VIEW_ANGLES[1] if arguments.arc is None else arguments.arc
    first = arguments.first_angle
    if first is None:
        first = VIEW_ANGLES[0] if arguments.views > 1 else VIEW_ANGLES[0] + VIEW_ANGLES[1]
    return [first + angle for angle in arc_angles(arguments.views, arc)]


def sequence_options(
    arguments: argparse.Namespace, poses: np.ndarray | None, reference: int
) -> SequenceOptions:
    """How the sequence is made; poses (F, K, 4, 4) of a table, the rig to the CT, have a world of their own."""
    from PolyPoseLib.simulation.sequence_options import SequenceOptions

    frames = arguments.frames if poses is None else len(poses)
    rng = np.random.default_rng([arguments.seed, 0x77])
    world = _drawn_world(rng) if arguments.own_world else np.eye(4)
    lead = tuple(arguments.lead_in)
    starts = [lead[n] if n < len(lead) else 0 for n in range(arguments.views)]
    return SequenceOptions(
        frames=frames,
        frames_per_second=arguments.frames_per_second,
        motion=arguments.motion,
        amplitude=arguments.amplitude,
        period_s=arguments.period,
        sway_mm=arguments.sway[0],
        sway_deg=arguments.sway[1],
        # The cameras stand around the bone that others move against, wherever the table's world has it.
        world=world if poses is None else poses[0, reference],
        shutter=arguments.shutter,
        first=lead,
        degradations=tuple(arguments.degrade),
        blank={n: _drawn_images(start, frames, arguments.blank, rng) for n, start in enumerate(starts)},
        repeated={n: _drawn_images(start, frames, arguments.repeated, rng) for n, start in enumerate(starts)},
    )


def _drawn_world(rng: np.random.Generator) -> np.ndarray:
    """Any rotation, and a shift of up to half a metre along every axis, (4, 4)."""
    from scipy.spatial.transform import Rotation

    world = np.eye(4)
    world[:3, :3] = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    world[:3, 3] = rng.uniform(-500, 500, 3)
    return world


def _drawn_images(start: int, frames: int, wanted: int, rng: np.random.Generator) -> tuple[int, ...]:
    """Numbers of images of any frames but the first one, on which a tracking starts; start: the first frame's image."""
    most = min(wanted, frames - 1)
    if most <= 0:
        return ()
    return tuple(sorted((start + 1 + rng.choice(frames - 1, most, replace=False)).tolist()))
