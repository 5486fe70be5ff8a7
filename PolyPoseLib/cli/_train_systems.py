"""What train does with --system: LiftReg and 2D3D-RegNet of the benchmark, trained on studies or on a data set."""

from __future__ import annotations

import argparse
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import merged_options
from PolyPoseLib.cli._console import progress_display
from PolyPoseLib.cli._train_data import pairs_of_data
from PolyPoseLib.cli._train_pairs import pairs_of_studies
from PolyPoseLib.data.benchmark.job import TRAINED_SYSTEMS
from PolyPoseLib.errors import InputError, UntrustedResultError

if TYPE_CHECKING:
    from PolyPoseLib.baselines.trained.training import TrainedMethod
    from PolyPoseLib.cli._train_data import ChosenData
    from PolyPoseLib.io.whole_files import FileClaim

_LOG = logging.getLogger(__name__)

CAMERAS = "cameras"

PAIRS = 200
"""Default pairs to train on, where motions are simulated."""

MOST_PAIRS = 10_000


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


def train_system(
    arguments: argparse.Namespace, data: ChosenData | None, claim: FileClaim, checkpoint: Path
) -> int:
    """Train and write the weights; the checkpoint is removed when they are really better than doing nothing.

    data: what is learned from in place of studies.
    """
    from PolyPoseLib.baselines.trained.training import LEAST_GAIN, Training, TrainingPlan, is_gain
    from PolyPoseLib.baselines.trained.training_set import TrainingSet
    from PolyPoseLib.data.options import Options
    from PolyPoseLib.data.progress import Monitor
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.io.camera_models import read_tensors, write_tensors
    from PolyPoseLib.rendering.select import resolve_device

    paths = arguments.study if data is None else ()
    studies = [Study.load(path, allow_outside=arguments.allow_outside) for path in paths]
    options = Options.from_dict(merged_options(studies[0].options if studies else None, arguments))
    plan = TrainingPlan(
        minutes=arguments.minutes,
        threads=options.threads or os.cpu_count() or 1,
        device=resolve_device(options.device),
        seed=options.seed,
    )
    display = progress_display(arguments.progress)
    try:
        monitor = Monitor(display, None)
        if data is None:
            pairs, counts = pairs_of_studies(arguments, studies, options.seed)
        else:
            pairs, counts = pairs_of_data(data, arguments, options.seed, monitor)
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
