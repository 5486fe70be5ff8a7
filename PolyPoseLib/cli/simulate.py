"""Subcommand simulate: a study with a known truth from any CT with labels."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.cli._arguments import new_parser
from PolyPoseLib.cli._patients import Grouping, moving_apart, phantom_patient, read_patient, read_structures
from PolyPoseLib.cli._sequences import (
    add_sequence_arguments,
    check_sequence,
    is_sequence,
    write_sequence_folder,
)
from PolyPoseLib.data.options import RANGES
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.simulation_limits import AMPLITUDES, DRAWN

if TYPE_CHECKING:
    from PolyPoseLib.simulation.simulate import SimulatedCase

USUAL_VIEW_MM = (1020.0, 780.0)
"""From the source to the detector and to the isocenter where no sample suggests others."""

ARC_DEG = 30.0
"""Spanned by the views of a study where nothing is given."""

LEAST_PIXELS = 64
"""Fewer rows and columns make pixels that are larger than a study may have."""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    from PolyPoseLib.io.samples import SAMPLES

    parser = new_parser(
        subparsers,
        "simulate",
        "move a CT's bones, take X-rays of it, and write the study or the sequence with its truth",
        "--sample pelvis --views 2 --arc 30 --output case",
    )
    parser.add_argument("--output", type=Path, required=True, metavar="DIR", help="new or empty folder")
    parser.add_argument(
        "--sample", choices=tuple(SAMPLES), help="use a public CT instead of the next three arguments"
    )
    parser.add_argument("--ct", type=Path, metavar="FILE", help="CT in Hounsfield units")
    parser.add_argument(
        "--segmentation",
        type=Path,
        metavar="FILE",
        help="label map, folder of masks, or DICOM SEG or RTSTRUCT",
    )
    parser.add_argument(
        "--structures",
        type=Path,
        metavar="JSON",
        help="structures and anchor, as the subcommand structures prints",
    )
    add_simulation(parser)
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="seed of the motion and noise (default: 0)"
    )
    parser.add_argument(
        "--camera",
        choices=("initial", "known", "absent"),
        default="initial",
        help="what the study gives of the cameras (default: initial)",
    )
    parser.add_argument(
        "--format",
        choices=("dicom", "nifti", "tiff"),
        help="file format of the X-rays (default: dicom, as XA); nifti of studies, tiff of sequences alone",
    )
    parser.add_argument(
        "--degrade",
        action="append",
        default=[],
        metavar="NAME",
        help="degrade X-rays or inputs as clinics do; may be given several times",
    )
    parser.add_argument(
        "--list-degradations", action=_ListDegradations, nargs=0, help="list what --degrade knows, and exit"
    )
    add_sequence_arguments(parser)
    parser.set_defaults(run=run)


class _ListDegradations(argparse.Action):
    """Print every degradation with its description, and exit."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from PolyPoseLib.cli._console import table
        from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS
        from PolyPoseLib.simulation.moving_degradations import NAMES

        rows = [
            (kind.name, ", ".join(kind.acts_on), "yes" if kind.recoverable else "no", kind.description)
            for kind in DEGRADATIONS.values()
        ]
        print(table(("name", "acts on", "recoverable", "what it is"), rows))
        print(f"\nof sequences: {', '.join(NAMES)}")
        parser.exit()


def add_simulation(parser: argparse.ArgumentParser) -> None:
    """Arguments that the demo has as well."""
    parser.add_argument("--views", type=int, default=2, metavar="N", help="number of X-rays (default: 2)")
    parser.add_argument(
        "--arc", type=float, metavar="DEG", help="angle spanned by the views (default: 30, of a sequence 70)"
    )
    parser.add_argument(
        "--source-to-detector",
        type=float,
        metavar="MM",
        help="distance from the source to the detector (default: the sample's, else 1020)",
    )
    parser.add_argument(
        "--source-to-isocenter",
        type=float,
        metavar="MM",
        help="distance from the source to the isocentre (default: the sample's, else 780)",
    )
    parser.add_argument(
        "--pixels", type=int, default=400, metavar="N", help="rows and columns of an X-ray (default: 400)"
    )
    parser.add_argument(
        "--motion",
        choices=(DRAWN, *AMPLITUDES),
        default=DRAWN,
        help="drawn at random about every joint, or one of these (default: drawn)",
    )
    usual = ", ".join(f"{name} {each.usual:g} {each.unit}" for name, each in AMPLITUDES.items())
    parser.add_argument(
        "--amplitude",
        type=float,
        metavar="X",
        help=f"how far a named motion goes: descent of the diaphragm, or an angle (default: {usual})",
    )
    parser.add_argument(
        "--motion-scale",
        type=float,
        default=1.0,
        metavar="X",
        help="factor on motions that are drawn at random (default: 1)",
    )
    parser.add_argument(
        "--rotation-error",
        type=float,
        default=4.0,
        metavar="DEG",
        help="rotation error of the initial cameras (default: 4)",
    )
    parser.add_argument(
        "--translation-error",
        type=float,
        default=15.0,
        metavar="MM",
        help="translation error of the initial cameras (default: 15)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the case and print the path of its study."""
    from PolyPoseLib.io.samples import fetch_sample

    check_simulation(arguments)
    sequence = is_sequence(arguments)
    if sequence:
        check_sequence(arguments)
    else:
        _check_degradations(arguments)
    inputs = (arguments.ct, arguments.segmentation, arguments.structures)
    if arguments.sample:
        if any(inputs):
            raise InputError("--sample brings its own CT: leave out --ct, --segmentation and --structures.")
        folder = fetch_sample(arguments.sample)
        inputs = folder / "ct.nii.gz", folder / "labels.nii.gz", folder / "structures.json"
    elif not all(inputs) and arguments.phantom is None:
        raise InputError("Give --ct, --segmentation and --structures, or --sample.")
    if sequence:
        from PolyPoseLib.io.tracking.simulated import TRACK_FILE

        _write_sequence(inputs, arguments)
        print(arguments.output / TRACK_FILE)
        return 0
    write_simulation(*inputs, arguments.output, arguments)
    print(arguments.output / "study.json")
    return 0


def _check_degradations(arguments: argparse.Namespace) -> None:
    """Refuse unknown degradations, and formats that these do not have, before any work; raises InputError."""
    if arguments.format == "tiff":
        raise InputError("--format tiff is of sequences: give --frames as well, or leave it out.")
    if not arguments.degrade:
        return
    from PolyPoseLib.simulation.degradations.registry import require_degradations

    require_degradations(arguments.degrade)
    if arguments.format == "nifti":
        raise InputError(
            "--degrade writes X-rays as DICOM, or as PNG where they are pictures: leave out --format."
        )


def write_simulation(
    ct_path: Path, labels_path: Path, structures_path: Path, output: Path, arguments: argparse.Namespace
) -> None:
    """Simulate a case and write it, all of it or nothing; raises InputError for wrong input.

    The arguments have passed check_simulation.
    """
    from PolyPoseLib.data.label_names import label_table
    from PolyPoseLib.io.cases import write_case
    from PolyPoseLib.io.disk_space import require_space
    from PolyPoseLib.io.whole_folders import claimed_folder

    camera, distance = getattr(arguments, "camera", "initial"), view_distances(arguments)[0]
    with claimed_folder(output, overwrite=None) as claim:
        grouping = groups, _, table = moving_apart(read_structures(structures_path), arguments.motion)
        case = simulate(ct_path, labels_path, grouping, arguments)
        organ_names = label_table(table) if table else None
        require_space(output, _bytes_of(case))
        with claim.whole() as temporary:
            if names := getattr(arguments, "degrade", []):
                _write_degraded(case, temporary, groups, organ_names, (names, camera, distance))
                return
            write_case(
                case,
                temporary,
                label_ids=groups,
                organ_names=organ_names,
                image_format=getattr(arguments, "format", None) or "dicom",
                camera=camera,
                source_to_detector_mm=distance,
            )


def _write_sequence(inputs: tuple[Path | None, ...], arguments: argparse.Namespace) -> None:
    """Simulate a sequence and write it, all of it or nothing; inputs: CT, segmentation and structures, or none."""
    from PolyPoseLib.io.whole_folders import claimed_folder

    with claimed_folder(arguments.output, overwrite=None) as claim:
        if arguments.phantom is not None:
            patient = phantom_patient(arguments.phantom, arguments.ct_reach)
        else:
            ct_path, labels_path, structures_path = inputs
            assert ct_path and labels_path and structures_path
            grouping = moving_apart(read_structures(structures_path), arguments.motion)
            patient = read_patient(ct_path, labels_path, grouping)
        with claim.whole() as temporary:
            write_sequence_folder(patient, arguments, view_distances(arguments), temporary)


def _write_degraded(
    case: SimulatedCase,
    folder: Path,
    groups: dict[str, list[int]],
    organ_names: dict[int, str] | None,
    how: tuple[list[str], str, float],
) -> None:
    """Degrade a case and write it; how: names of degradations, the cameras' state, source to detector in mm."""
    from PolyPoseLib.io.degraded_cases import write_degraded_case
    from PolyPoseLib.simulation.degradations.registry import degrade

    names, camera, distance = how
    degraded = degrade(case, names, source_to_detector_mm=distance, camera=camera)
    write_degraded_case(degraded, folder, groups, organ_names)


def _bytes_of(case: SimulatedCase) -> float:
    """About how many bytes a case takes on the disk: two CTs, the field, and two bytes a pixel."""
    pixels = sum(image.size for image in case.images)
    voxels = case.ct.voxels.size + case.fixed_ct.voxels.size
    return 1.25 * voxels + 24 * math.prod(case.field.shape) + 2 * pixels


def check_simulation(arguments: argparse.Namespace) -> None:
    """Check the numbers of a simulation, before any work; raises InputError that names the argument."""
    from PolyPoseLib.simulation import simulation_limits as limits

    limits.require_in_range(arguments.pixels, (LEAST_PIXELS, limits.PIXELS[1]), "--pixels", "whole number")
    limits.require_few_pixels(arguments.views, arguments.pixels, ("--views", "--pixels"))
    limits.require_in_range(arguments.seed or 0, RANGES["seed"], "--seed", "whole number")
    limits.require_in_range(_arc(arguments), limits.ARC_DEG, "--arc")
    for argument, option in (
        ("motion_scale", "motion_scale"),
        ("rotation_error", "rotation_deg"),
        ("translation_error", "translation_mm"),
    ):
        value, name = getattr(arguments, argument), f"--{argument.replace('_', '-')}"
        limits.require_in_range(value, limits.OPTIONS[option], name)
    limits.require_motion(arguments.motion, arguments.amplitude, ("--motion", "--amplitude"))
    if arguments.motion != DRAWN and arguments.motion_scale != 1:
        raise InputError("--motion-scale is of motions drawn at random: give --amplitude with --motion.")
    view_distances(arguments)


def simulate(
    ct_path: Path, labels_path: Path, grouping: Grouping, arguments: argparse.Namespace
) -> SimulatedCase:
    """The case that the arguments ask for."""
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.simulation.simulate import (
        SimulationOptions,
        arc_angles,
        simulate_case,
        structures_centre,
        view_cameras,
    )

    patient = read_patient(ct_path, labels_path, grouping)
    ct, structures = patient.ct, patient.structures
    to_detector, to_isocenter = view_distances(arguments)
    cameras = view_cameras(
        ct,
        arc_angles(arguments.views, _arc(arguments)),
        arguments.pixels,
        source_to_detector_mm=to_detector,
        source_to_isocenter_mm=to_isocenter,
        isocenter=structures_centre(structures, ct.affine),
    )
    options = SimulationOptions(
        motion_scale=arguments.motion_scale,
        motion=arguments.motion,
        amplitude=arguments.amplitude,
        rotation_deg=arguments.rotation_error,
        translation_mm=arguments.translation_error,
    )
    return simulate_case(
        ct,
        structures,
        cameras=cameras,
        seed=arguments.seed or 0,
        options=options,
        anchor=patient.reference,
        source_labels=None if patient.labels is None else Volume(patient.labels, ct.affine),
        organ_names=patient.label_names or None,
    )


def _arc(arguments: argparse.Namespace) -> float:
    """Degrees that the views of a study span."""
    return ARC_DEG if arguments.arc is None else arguments.arc


def view_distances(arguments: argparse.Namespace) -> tuple[float, float]:
    """From the source to the detector and to the isocenter in mm; raises InputError when they do not fit."""
    from PolyPoseLib.io.samples import sample_named
    from PolyPoseLib.simulation.simulation_limits import require_distances

    usual = sample_named(arguments.sample).view_mm if arguments.sample else USUAL_VIEW_MM
    given = (arguments.source_to_detector, arguments.source_to_isocenter)
    to_detector, to_isocenter = (usual[n] if given[n] is None else given[n] for n in range(2))
    require_distances(to_detector, to_isocenter, ("--source-to-detector", "--source-to-isocenter"))
    return to_detector, to_isocenter
