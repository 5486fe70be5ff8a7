"""What train does with --system: LiftReg and 2D3D-RegNet of the benchmark, trained on studies of one's own."""

from __future__ import annotations

import argparse
import itertools
import logging
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import merged_options
from PolyPoseLib.cli._console import progress_display
from PolyPoseLib.data.benchmark.job import TRAINED_SYSTEMS
from PolyPoseLib.errors import InputError, UntrustedResultError

if TYPE_CHECKING:
    from PolyPoseLib.baselines.trained.training import TrainedMethod
    from PolyPoseLib.baselines.trained.training_pairs import TrainingPair
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.io.whole_files import FileClaim

_LOG = logging.getLogger(__name__)

CAMERAS = "cameras"

PAIRS, HELD_OUT = 200, 12
"""Default pairs to train on, and to hold out; of pairs of CTs, see pair_split."""

MOST_PAIRS = 10_000
MOST_OTHER_CTS = 100


def add_system_arguments(parser: argparse.ArgumentParser) -> None:
    """What is trained, and on what."""
    parser.add_argument(
        "--system",
        choices=(CAMERAS, *TRAINED_SYSTEMS),
        default=CAMERAS,
        help="what to train: initial cameras, or a system of the benchmark (default: cameras)",
    )
    parser.add_argument(
        "--pairs",
        type=int,
        default=PAIRS,
        metavar="N",
        help=f"of --system: simulated motions to train on (default: {PAIRS})",
    )
    parser.add_argument(
        "--side",
        type=int,
        default=64,
        metavar="N",
        help="of --system: nodes of the network's grid along each axis, a multiple of 16 (default: 64)",
    )
    parser.add_argument(
        "--motion-scale",
        type=float,
        default=1.0,
        metavar="X",
        help="of --system: factor on the simulated motions (default: 1)",
    )
    parser.add_argument(
        "--other-cts",
        metavar="PATTERN",
        help="of --system: files beside each study, such as 'later*.nii.gz', that are other CTs of its patient in the "
        "same world; pairs of CTs are then what it learns from, not simulated motions",
    )


def check_system_arguments(arguments: argparse.Namespace) -> None:
    """Refuse what does not go together, before anything is read; raises InputError."""
    if arguments.system == CAMERAS:
        if len(arguments.study) > 1:
            raise InputError(
                "Cameras are trained for one study: give one, or --system liftreg or 2d3d-regnet."
            )
        if arguments.other_cts is not None:
            raise InputError("--other-cts goes with --system liftreg or 2d3d-regnet alone: leave it out.")
        return
    if not 2 <= arguments.pairs <= MOST_PAIRS:
        raise InputError(f"--pairs is {arguments.pairs}: give a number from 2 to {MOST_PAIRS}.")
    if arguments.side not in range(16, 257, 16):
        raise InputError(f"--side is {arguments.side}: give a multiple of 16 from 16 to 256.")
    if not 0 < arguments.motion_scale <= 10:
        raise InputError(f"--motion-scale is {arguments.motion_scale:g}: give a number above 0, at most 10.")
    pattern = arguments.other_cts
    if pattern is not None and (not pattern or Path(pattern).name != pattern or pattern in (".", "..", "**")):
        raise InputError(f"--other-cts is {pattern!r}: give a pattern of file names, without a folder.")


def train_system(arguments: argparse.Namespace, claim: FileClaim, checkpoint: Path) -> int:
    """Train and write the weights; the checkpoint is removed when they are really better than doing nothing."""
    from PolyPoseLib.baselines.trained.training import LEAST_GAIN, Training, TrainingPlan, is_gain
    from PolyPoseLib.baselines.trained.training_set import TrainingSet
    from PolyPoseLib.data.options import Options
    from PolyPoseLib.data.progress import Monitor
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.io.camera_models import read_tensors, write_tensors
    from PolyPoseLib.rendering.select import resolve_device

    studies = [Study.load(path, allow_outside=arguments.allow_outside) for path in arguments.study]
    options = Options.from_dict(merged_options(studies[0].options, arguments))
    plan = TrainingPlan(
        minutes=arguments.minutes,
        threads=options.threads or os.cpu_count() or 1,
        device=resolve_device(options.device),
        seed=options.seed,
    )
    display = progress_display(arguments.progress)
    try:
        monitor = Monitor(display, None)
        pairs, counts = _pairs(arguments, studies, options.seed)
        prepared = TrainingSet.collected(
            pairs, counts, arguments.side, lambda done, of: monitor.step("training pairs", done, of, None)
        )
        earlier = read_tensors(checkpoint, "checkpoint") if arguments.resume else None

        def keep(fields: dict[str, Any]) -> None:
            write_tensors(fields, checkpoint)

        weights = Training(_method(arguments.system), prepared, plan, keep).run(monitor, earlier)
    except KeyboardInterrupt:
        if checkpoint.is_file():
            _LOG.warning("Interrupted; the same command with --resume continues from %s.", checkpoint)
        raise
    finally:
        display.close()
    write_tensors(weights.to_fields(), claim)
    report = weights.report
    if arguments.progress != "json":
        print(
            f"{arguments.output}: mean error {report['held_out_mm']:.1f} mm on held-out pairs, "
            f"{report['rest_mm']:.1f} mm before registration, after {report['steps']} steps."
        )
    if not is_gain(report):
        raise UntrustedResultError(
            f"{arguments.output}: the weights were written, but on held-out pairs they are not better by "
            f"{100 * LEAST_GAIN:g} % than doing nothing and than the untrained network ({report['held_out_mm']:.2f} mm "
            f"against {report['rest_mm']:.2f} and {report['curve'][0]['held_out_mm']:.2f} mm): train longer with "
            f"--resume and more than --minutes {arguments.minutes:g}, or on more --pairs."
        )
    checkpoint.unlink(missing_ok=True)
    return 0


def _method(system: str) -> TrainedMethod:
    """The network and the loss of a name."""
    if system == "liftreg":
        from PolyPoseLib.baselines.liftreg import LiftReg

        return LiftReg()
    from PolyPoseLib.baselines.regnet import RegNet

    return RegNet()


def _pairs(
    arguments: argparse.Namespace, studies: list[Study], seed: int
) -> tuple[Iterator[TrainingPair], tuple[int, int]]:
    """What is learned from, the held-out pairs first, and how many pairs to train on and to hold out."""
    from PolyPoseLib.baselines.trained.network_inputs import camera_of
    from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient, simulated_pairs
    from PolyPoseLib.simulation.simulate import SimulationOptions

    cameras = [[camera_of(xray) for xray in study.xrays] for study in studies]
    if arguments.other_cts is not None:
        return _pairs_of_cts(arguments, studies, cameras, seed)
    patients = [
        SimulatedPatient.of(study.ct, study.structures, study.anchor, views, arguments.side)
        for study, views in zip(studies, cameras, strict=True)
    ]
    options = SimulationOptions(motion_scale=arguments.motion_scale)
    return simulated_pairs(patients, seed, options), (arguments.pairs, HELD_OUT)


def _pairs_of_cts(
    arguments: argparse.Namespace, studies: list[Study], cameras: list[list[Camera]], seed: int
) -> tuple[Iterator[TrainingPair], tuple[int, int]]:
    """The same of --other-cts; raises InputError when there are too few."""
    from PolyPoseLib.baselines.trained.ct_digests import ct_digest
    from PolyPoseLib.baselines.trained.ct_pairs import ct_pairs
    from PolyPoseLib.baselines.trained.pair_split import split_pairs

    cts = [
        [study.ct, *_other_cts(path, arguments.other_cts)]
        for path, study in zip(arguments.study, studies, strict=True)
    ]
    split = split_pairs([[ct_digest(ct) for ct in each] for each in cts])
    if not split.is_enough:
        total = len(split.training) + len(split.held_out)
        raise InputError(
            f"There are {total} pairs of CTs, each with each of a patient: give more CTs, more studies, or leave out "
            "--other-cts to train on simulated motions."
        )
    if split.shares_cts:
        _LOG.warning(
            "The held-out pairs share their CTs with training pairs, so that the error on them says little of other "
            "CTs: give a second patient, or four CTs or more."
        )
    pairs = itertools.chain.from_iterable(
        ct_pairs(cts[n], cameras[n], arguments.side, seed + n, wanted=[(moving, fixed)])
        for n, moving, fixed in (*split.held_out, *split.training)
    )
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
