"""What train learns from a data set of the benchmark: its cases, as the benchmark reads them."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.cli._data_sets import chosen_subjects, chosen_views
from PolyPoseLib.cli._train_pairs import pairs_of_cts, pairs_of_motions
from PolyPoseLib.data.benchmark.job import DATASETS
from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from PolyPoseLib.cli._train_pairs import Pairs
    from PolyPoseLib.data.benchmark.case import BenchmarkCase
    from PolyPoseLib.data.progress import Monitor
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.io.benchmark.readers import Reader

_LOG = logging.getLogger(__name__)

REAL, SIMULATED = MOTIONS = ("real", "simulated")
"""Between two scans of a subject; or of its first CT's bones, drawn at random."""

_OF_DATA = ("subjects", "views", "motions")
_OF_STUDIES = ("other_cts", "allow_outside")


@dataclass(frozen=True)
class ChosenData:
    """The part of a data set that is learned from.

    Attributes
    ----------
    reader : Reader
        Of the data set.
    root : Path
        Where it lies.
    subjects : tuple of str
        As the reader lists them.
    views : str
        One set, as the reader spells it.
    motions : str
        One of ``MOTIONS``.

    """

    reader: Reader
    root: Path
    subjects: tuple[str, ...]
    views: str
    motions: str


def add_data_arguments(parser: argparse.ArgumentParser) -> None:
    """What of a data set is learned from."""
    group = parser.add_argument_group("of a data set, in place of studies")
    group.add_argument(
        "--subjects",
        nargs="+",
        metavar="NAME",
        help="only these patients or cases, as of the benchmark (default: all, of which none is left to be tested)",
    )
    group.add_argument(
        "--views",
        nargs="+",
        metavar="VIEWS",
        help="one set of X-rays, the one that the benchmark will use, such as 2x180 (default: paper of deepfluoro, own "
        "of simulated)",
    )
    group.add_argument(
        "--motions",
        choices=MOTIONS,
        help="real: between the two scans of each case; simulated: of the first CT's bones, at random (default: real "
        "of headneck and thoraxcbct, simulated of the others)",
    )


def chosen_data(arguments: argparse.Namespace) -> ChosenData | None:
    """What of a data set is learned from; None where studies are given. Reads no image.

    Raises
    ------
    InputError
        An argument does not go with the others; the data are no whole copy; there is no such subject or set of views.

    """
    first = arguments.study[0]
    if str(first) not in DATASETS or first.is_file():
        for flag in _OF_DATA:
            if getattr(arguments, flag) is not None:
                raise InputError(
                    f"--{flag} goes with a data set, as in headneck DATA, not with studies: leave it out."
                )
        return None
    for flag in _OF_STUDIES:
        if getattr(arguments, flag):
            raise InputError(
                f"--{flag.replace('_', '-')} goes with studies, not with a data set: leave it out."
            )
    if len(arguments.study) != 2:
        raise InputError(
            f"{first}: give one place of the data after the name of the data set, as in {first} DATA."
        )
    from PolyPoseLib.io.benchmark.readers import READERS

    reader, root = READERS[str(first)], arguments.study[1]
    views, *others = chosen_views(reader, arguments.views)
    if others:
        raise InputError(
            f"--views: a network is of one set of views: give the one that the benchmark will use, such as {views}."
        )
    motions = arguments.motions or (REAL if reader.two_scans else SIMULATED)
    if motions == REAL and not reader.two_scans:
        raise InputError(
            f"--motions real: no subject of {first} has a second scan: give --motions simulated, or leave it out."
        )
    subjects = chosen_subjects(reader, root, arguments.subjects)
    if arguments.output.absolute().resolve().is_relative_to(root.resolve()):
        raise InputError(
            f"{arguments.output}: it lies in the data, which are never written to: choose another --output."
        )
    return ChosenData(reader, root, subjects, views, motions)


def pairs_of_data(chosen: ChosenData, arguments: argparse.Namespace, seed: int, monitor: Monitor) -> Pairs:
    """Read all cases, and pair their CTs or simulate motions of them.

    Parameters
    ----------
    chosen : ChosenData
        What is learned from.
    arguments : argparse.Namespace
        Of the subcommand.
    seed : int
        Of everything random.
    monitor : Monitor
        Told of each case.

    Raises
    ------
    InputError
        Damaged data, missing labels, X-rays of other directions than the first case's, or too few pairs.

    """
    from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient

    cts: list[tuple[Volume, Volume]] = []
    cameras: list[tuple[Camera, ...]] = []
    patients: list[SimulatedPatient] = []
    for number, subject in enumerate(chosen.subjects):
        monitor.step("reading subjects", number, len(chosen.subjects), None)
        (case,) = chosen.reader.cases(chosen.root, subject, [chosen.views])
        for line in case.study.warnings:
            _LOG.info("%s: %s", subject, line)
        cameras.append(_in_one_order(case, chosen.subjects[: number + 1], cameras))
        if chosen.motions == REAL:
            assert case.truth.ct is not None  # of readers with two scans
            cts.append((case.study.ct, case.truth.ct))  # and nothing else, which would fill the memory
            continue
        study = case.study
        try:
            patients.append(
                SimulatedPatient.of(study.ct, study.structures, study.anchor, cameras[-1], arguments.side)
            )
        except InputError as error:
            raise InputError(f"{subject}: {error}") from error
    monitor.step("reading subjects", len(chosen.subjects), len(chosen.subjects), None)
    if chosen.motions == SIMULATED:
        return pairs_of_motions(arguments, patients, seed)
    remedy = "give two --subjects or more of different patients, or --motions simulated"
    return pairs_of_cts(cts, cameras, arguments.side, seed, remedy, chosen.subjects)


def _in_one_order(
    case: BenchmarkCase, names: Sequence[str], earlier: Sequence[Sequence[Camera]]
) -> tuple[Camera, ...]:
    """The true cameras of a case in the order of the first case's directions; raises InputError for other directions.

    names: of the subjects up to this one; earlier: the cameras of those before it.
    """
    from PolyPoseLib.baselines.trained.view_directions import directions_of, matched_views

    cameras = case.truth.cameras
    if not earlier:
        return cameras
    try:
        return tuple(cameras[number] for number in matched_views(directions_of(earlier[0]), cameras))
    except InputError as error:
        raise InputError(
            f"{names[-1]}: its X-rays do not come from where those of {names[0]} do, for which one network could be "
            f"trained ({error}): leave it out of --subjects, or train it by itself."
        ) from error
