"""A process that runs one system on one case and writes its row: ``python -m PolyPoseLib.benchmark.run_system JOB``."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from PolyPoseLib.benchmark.case_reading import read_known
from PolyPoseLib.benchmark.child_start import begin
from PolyPoseLib.benchmark.digests import digest_of
from PolyPoseLib.benchmark.earlier_files import forget
from PolyPoseLib.benchmark.measures import Measures, measured
from PolyPoseLib.benchmark.motion_checks import require_motion
from PolyPoseLib.benchmark.rows import field_path, new_row_path, pictures_path, publishable, row_of
from PolyPoseLib.benchmark.systems import SYSTEMS, load_system, require_packages
from PolyPoseLib.benchmark.training_overlap import trained_on
from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.job import DONE, FAILED, NOT_SEEN, SKIPPED, RunJob
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.errors import InputError, NotFiniteError, PolyPoseError, cut, is_out_of_memory, one_line
from PolyPoseLib.evaluation.benchmark.scores import score_case
from PolyPoseLib.io.benchmark.jobs import parse_job_text
from PolyPoseLib.io.benchmark.row_files import write_row
from PolyPoseLib.io.transforms import write_transform
from PolyPoseLib.io.whole_files import replaced_whole
from PolyPoseLib.io.whole_folders import claimed_folder


@dataclass
class _Attempt:
    """How far a run came. step: what it does now, for a sentence about its failure."""

    step: str = "The case could not be read"
    measures: Measures = field(default_factory=Measures)
    scores: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    trained_on: str = NOT_SEEN


class _CannotRun(Exception):
    """The system cannot run here, or not on this case; the cause says why."""


def main(argv: Sequence[str]) -> int:
    """Run the job and write its row, whatever comes of it; 130, without a row, when it is interrupted."""
    begin()
    job = parse_job_text(argv[0])
    attempt = _Attempt()
    status, reason = DONE, ""
    try:
        _run(job, attempt)
    except KeyboardInterrupt:
        return 130
    except _CannotRun as error:
        status, reason = SKIPPED, str(error.__cause__)
    except BaseException as error:  # a system may raise anything, and end by sys.exit
        if not isinstance(error, PolyPoseError):
            traceback.print_exc()
        status, reason = FAILED, f"{attempt.step}: {_sentence(error)}"
    row = row_of(job, status, reason, attempt.measures)
    if status != DONE:
        print(f"polypose: {row['reason']}", file=sys.stderr, flush=True)
    found = {
        "notes": [publishable(each, job) for each in attempt.notes],
        "scores": attempt.scores,
        "trained_on": attempt.trained_on,
    }
    write_row(new_row_path(job), {**row, **found})
    return 0


def _run(job: RunJob, attempt: _Attempt) -> None:
    case = read_known(job.case)
    attempt.step = "The system could not be loaded"
    system = _unless_it_cannot(lambda: load_system(job.path))
    if job.path not in SYSTEMS.values():  # those of the table say themselves how to get what they need
        _unless_it_cannot(lambda: require_packages(system))
    weights = {system.name: Path(job.weights)} if job.weights else {}
    settings = job.settings
    setting = SystemSetting(
        settings.threads, settings.device, settings.seed, weights, _print_step, case=case.name
    )
    attempt.step = "The system failed"
    given = digest_of(case.study)
    with measured() as attempt.measures:
        motion = _unless_it_cannot(lambda: system.fit(case.study, setting))
    attempt.step = "Its answer cannot be scored"
    if digest_of(case.study) != given:
        raise InputError("it changed the study that it was given, with which it would be scored.")
    require_motion(motion, case.study)
    attempt.notes = tuple(cut(one_line(str(each)), 500) for each in motion.notes)
    attempt.scores = score_case(case, motion)
    if job.weights:
        attempt.trained_on = trained_on(system.name, Path(job.weights), case)
    forget(job)  # a field or pictures of another run would lie beside this one's row
    for wanted, work in ((job.keep_field, _write_field), (job.draw, _draw)):
        if wanted:
            try:
                work(job, case, motion)
            except (InputError, OSError) as error:  # no reason to lose the scores
                attempt.notes += (f"{work.__doc__} failed: {_sentence(error)}",)


def _write_field(job: RunJob, case: BenchmarkCase, motion: Motion) -> None:
    """Writing the field"""
    field_path(job).parent.mkdir(exist_ok=True)
    with replaced_whole(field_path(job)) as path:
        write_transform(motion.field, path)


def _draw(job: RunJob, case: BenchmarkCase, motion: Motion) -> None:
    """Drawing the case"""
    from PolyPoseLib.io.benchmark.figures import draw_case

    place = pictures_path(job)
    place.parent.mkdir(exist_ok=True)
    with claimed_folder(place, overwrite=True, stranger_in=lambda _: None) as claim, claim.whole() as folder:
        draw_case(case, motion, folder, job.system)


def _unless_it_cannot(work: Callable[[], Any]) -> Any:
    """What the work gives; raises _CannotRun where it says by InputError, or a missing package, that it cannot run.

    Numbers that are not finite and a lack of memory are no such thing, but how the system fails here.
    """
    try:
        return work()
    except (InputError, ModuleNotFoundError) as error:
        lacked_memory = error.__cause__ is not None and is_out_of_memory(error.__cause__)
        if isinstance(error, NotFiniteError) or lacked_memory:
            raise
        raise _CannotRun from error


def _print_step(iteration: int, of: int, similarity: float | None) -> None:
    """For the log, so that a run that was ended shows how far it came."""
    if iteration == of or iteration % 50 == 0:
        print(f"{iteration}/{of} {'' if similarity is None else f'{similarity:.4f}'}".rstrip(), flush=True)


def _sentence(error: BaseException) -> str:
    if isinstance(error, PolyPoseError):
        return str(error)
    if is_out_of_memory(error):
        return "memory ran out."
    return f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
