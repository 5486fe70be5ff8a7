"""Subcommand train: a regressor of initial cameras for one CT, or a trained system of the benchmark."""

from __future__ import annotations

import argparse
import logging
import math
import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import add_options, add_progress, merged_options, new_parser
from PolyPoseLib.cli._console import progress_display
from PolyPoseLib.cli._train_data import add_data_arguments, chosen_data
from PolyPoseLib.cli._train_systems import (
    CAMERAS,
    add_system_arguments,
    check_system_arguments,
    train_system,
)
from PolyPoseLib.errors import InputError, UntrustedResultError

if TYPE_CHECKING:
    from PolyPoseLib.io.whole_files import FileClaim

_LOG = logging.getLogger(__name__)


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "train",
        "train a model that predicts initial cameras of X-rays of this CT, from renderings of it alone; or a system "
        "that the benchmark compares",
        "case/study.json --output case/model.pt --minutes 30",
    )
    parser.add_argument(
        "study",
        type=Path,
        nargs="+",
        help="the study's JSON file: its CT and anchor, and the geometry and standard views of its X-rays; for a "
        "benchmark's system also several studies, or a data set as benchmark has it: its name and its place, as in "
        "headneck data/headneck",
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="FILE", help="the model, such as model.pt"
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="longest time of training (default: 30)")
    parser.add_argument(
        "--resume", action="store_true", help="continue from FILE.checkpoint, which an earlier training left"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an earlier model in FILE")
    parser.add_argument(
        "--allow-outside", action="store_true", help="read files outside the study's folder if it names them"
    )
    add_system_arguments(parser)
    add_data_arguments(parser)
    add_options(parser)
    add_progress(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Train and write the model; its checkpoint is removed when the model is written and usable."""
    from PolyPoseLib.io.whole_files import claimed_file

    checkpoint = arguments.output.with_name(arguments.output.name + ".checkpoint")
    _check(arguments, checkpoint)
    check_system_arguments(arguments)
    data = chosen_data(arguments)
    with claimed_file(arguments.output, overwrite=arguments.overwrite or arguments.resume) as claim:
        if arguments.system != CAMERAS:
            return train_system(arguments, data, claim, checkpoint)
        return _train(arguments, claim, checkpoint)


def _train(arguments: argparse.Namespace, claim: FileClaim, checkpoint: Path) -> int:
    """Train and write the model to the claimed file."""
    from PolyPoseLib.data.study import Study

    study = Study.load(arguments.study[0], allow_outside=arguments.allow_outside)
    from PolyPoseLib.data.options import Options
    from PolyPoseLib.data.progress import Monitor
    from PolyPoseLib.io.camera_models import read_tensors, save_model, write_tensors
    from PolyPoseLib.learned.camera_model import ct_fingerprint
    from PolyPoseLib.learned.detector import VirtualDetector
    from PolyPoseLib.learned.training import TrainingPlan, train
    from PolyPoseLib.learned.view_range import ViewRange
    from PolyPoseLib.registration.scene import Scene
    from PolyPoseLib.rendering.select import resolve_device

    options = Options.from_dict(merged_options(study.options, arguments))
    threads = options.threads or os.cpu_count() or 1
    workers = min(threads // 2, 8)
    plan = TrainingPlan(
        minutes=arguments.minutes,
        workers=workers,
        threads=threads - workers,
        device=resolve_device(options.device),
        seed=options.seed,
    )
    views = ViewRange.of_xrays(study.xrays)
    detector = VirtualDetector.around(study.xrays, plan.side)
    fingerprint = ct_fingerprint(study.ct, study.structures, study.anchor)
    _LOG.info("Training around %s, for at most %g minutes.", ", ".join(views.views), arguments.minutes)
    display = progress_display(arguments.progress)
    began = time.perf_counter()
    try:
        scene = Scene(study.ct, study.structures, study.anchor)
        monitor = Monitor(display, None)
        earlier = read_tensors(checkpoint, "checkpoint") if arguments.resume else None

        def keep(fields: dict[str, Any]) -> None:
            write_tensors(fields, checkpoint)

        model = train(scene, fingerprint, views, detector, plan, monitor, keep, earlier)
    except KeyboardInterrupt:
        if checkpoint.is_file():
            _LOG.warning("Interrupted; the same command with --resume continues from %s.", checkpoint)
        raise
    finally:
        display.close()
    save_model(model, claim)
    weakness = model.weakness
    if weakness is None:
        checkpoint.unlink(missing_ok=True)
    if arguments.progress != "json":
        print(
            f"{arguments.output}: median error {model.validation_mm:.1f} mm on renderings that it was not trained on, "
            f"after {(time.perf_counter() - began) / 60:.1f} minutes."
        )
    if weakness is not None:
        raise UntrustedResultError(
            f"{arguments.output}: the model was written, but its cameras must not be trusted: {weakness}. Train "
            f"longer: the same command with --resume and more than --minutes {arguments.minutes:g} continues from the "
            'checkpoint beside it; or give every X-ray its "standard_view", so that the model has less to learn.'
        )
    return 0


def _check(arguments: argparse.Namespace, checkpoint: Path) -> None:
    """Refuse before hours are spent what could not be written afterwards; raises InputError."""
    output = arguments.output
    if not (math.isfinite(arguments.minutes) and arguments.minutes > 0):
        raise InputError(f"--minutes is {arguments.minutes:g}: give a number above 0.")
    if output.is_dir():
        raise InputError(f"{output} is a folder: give the name of a file, such as model.pt, in it.")
    if not output.absolute().parent.is_dir():
        raise InputError(
            f"{output.absolute().parent}: there is no such folder; make it or choose another --output."
        )
    if output.exists() and not (arguments.overwrite or arguments.resume):
        raise InputError(f"{output} exists: add --overwrite to replace it, or choose another --output.")
    if arguments.resume and not checkpoint.is_file():
        raise InputError(f"{checkpoint}: there is no checkpoint to continue from; leave out --resume.")
