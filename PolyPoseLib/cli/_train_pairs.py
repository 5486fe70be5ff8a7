"""The pairs that a system of the benchmark is trained on: of studies, of several CTs, or of simulated motions."""

from __future__ import annotations

import argparse
import itertools
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient
    from PolyPoseLib.baselines.trained.training_pairs import TrainingPair
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera

    Pairs = tuple[Iterator[TrainingPair], tuple[int, int]]
    """What is learned from, the held-out pairs first; and how many pairs to train on and to hold out."""

_LOG = logging.getLogger(__name__)

HELD_OUT = 12
"""Simulated motions to hold out; of pairs of CTs, see pair_split."""

MOST_OTHER_CTS = 100


def pairs_of_studies(arguments: argparse.Namespace, studies: Sequence[Study], seed: int) -> Pairs:
    """Of the studies that the command names, and with --other-cts of the CTs beside them; raises InputError."""
    from PolyPoseLib.baselines.trained.network_inputs import camera_of
    from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient

    cameras = [[camera_of(xray) for xray in study.xrays] for study in studies]
    if arguments.other_cts is None:
        patients = [
            SimulatedPatient.of(study.ct, study.structures, study.anchor, views, arguments.side)
            for study, views in zip(studies, cameras, strict=True)
        ]
        return pairs_of_motions(arguments, patients, seed)
    cts = [
        [study.ct, *_other_cts(path, arguments.other_cts)]
        for path, study in zip(arguments.study, studies, strict=True)
    ]
    remedy = "give more CTs, more studies, or leave out --other-cts to train on simulated motions"
    return pairs_of_cts(cts, cameras, arguments.side, seed, remedy)


def pairs_of_motions(arguments: argparse.Namespace, patients: Sequence[SimulatedPatient], seed: int) -> Pairs:
    """Simulated motions of patients in turn, as many as --pairs, and HELD_OUT others of the same."""
    from PolyPoseLib.baselines.trained.simulated_pairs import simulated_pairs
    from PolyPoseLib.simulation.simulate import SimulationOptions

    options = SimulationOptions(motion_scale=arguments.motion_scale)
    return simulated_pairs(patients, seed, options), (arguments.pairs, HELD_OUT)


def pairs_of_cts(
    cts: Sequence[Sequence[Volume]],
    cameras: Sequence[Sequence[Camera]],
    side: int,
    seed: int,
    remedy: str,
    names: Sequence[str] = (),
) -> Pairs:
    """Every CT of a patient with every other, in both directions.

    Parameters
    ----------
    cts : sequence of sequence of Volume
        HU, of each patient, in one world.
    cameras : sequence of sequence of Camera
        Of each patient's X-rays, in one order of directions.
    side : int
        Nodes of the network's grid along every axis.
    seed : int
        Of the X-rays' noise.
    remedy : str
        What to do where there are too few, the end of a sentence.
    names : sequence of str
        Of the patients, for sentences; none by default.

    Raises
    ------
    InputError
        There are too few pairs; when a pair is taken, that its CTs cannot be one.

    """
    from PolyPoseLib.baselines.trained.ct_digests import ct_digest
    from PolyPoseLib.baselines.trained.pair_split import CtPair, split_pairs

    split = split_pairs([[ct_digest(ct) for ct in each] for each in cts])
    if not split.is_enough:
        total = len(split.training) + len(split.held_out)
        raise InputError(f"There are {total} pairs of CTs, each with each of a patient: {remedy}.")
    if split.shares_cts:
        _LOG.warning(
            "The held-out pairs share their CTs with training pairs, so that the error on them says little of other "
            "CTs: give a second patient, or four CTs or more."
        )

    def made(pair: CtPair) -> Iterator[TrainingPair]:
        from PolyPoseLib.baselines.trained.ct_pairs import ct_pairs

        patient, *numbers = pair
        wanted = [(numbers[0], numbers[1])]
        try:
            yield from ct_pairs(cts[patient], cameras[patient], side, seed + patient, wanted=wanted)
        except InputError as error:
            raise InputError(f"{names[patient]}: {error}" if names else str(error)) from error

    pairs = itertools.chain.from_iterable(map(made, (*split.held_out, *split.training)))
    return pairs, (len(split.training), len(split.held_out))


def _other_cts(study: Path, pattern: str) -> list[Volume]:
    """CTs beside a study's file; raises InputError when there is none."""
    from PolyPoseLib.io.volumes import read_ct

    folder = study.absolute().parent
    found = sorted(path for path in folder.glob(pattern) if path.is_file() and not path.is_symlink())
    if not found or len(found) > MOST_OTHER_CTS:
        raise InputError(
            f"{folder}: {len(found)} files are called {pattern}: give a pattern of 1 to {MOST_OTHER_CTS} CTs for "
            "--other-cts, and leave out the study's own."
        )
    return [read_ct(path) for path in found]
