"""Sample data: a public pelvis CT with labels, and X-rays of it that the core simulates on arrival."""

from __future__ import annotations

import json
import os
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError

from .process.dependencies import ensure_dependencies
from .process.environment import child_environment, python_executable
from .process.job import Job
from .process.study_run import error_of
from .scene.fitting import show_volume
from .study.reader import open_study

CATEGORY = "PolyPose"
SAMPLE_NAME = "PolyPosePelvis"
LABEL_TABLE = "totalsegmentator_v2"
_RESOURCES = Path(__file__).resolve().parents[1] / "Resources"
_PUBLIC_FILES = (
    "https://raw.githubusercontent.com/wasserth/TotalSegmentator/"
    "0e65a448d557382b1e925276212b3bec7f5aff83/tests/reference_files/"
)
CT = (
    _PUBLIC_FILES + "example_ct.nii.gz",
    "PolyPosePelvis-ct.nii.gz",
    "SHA256:dbd3ae6d614d1d7ef3a46925c30c70038ed52da6b37fdd6afdc7b9b71387e3e1",
)
LABELS = (
    _PUBLIC_FILES + "example_seg_fast_force_split.nii.gz",
    "PolyPosePelvis-labels.nii.gz",
    "SHA256:e8097758e56e73099075b6caaebce23ef11bc6fad66a4ec3753b9406846558c7",
)
CASE_FOLDER = "PolyPosePelvis-case-1"
"""In the cache; its number changes with the simulation."""

_WAIT_SECONDS = 0.03


def register(parameter_node: Callable[[], Any]) -> None:
    """Offer the sample in the module Sample Data; parameter_node: gives the one that is filled in when it is loaded."""
    from SampleData import SampleDataLogic

    SampleDataLogic.registerCustomSampleDataCategory(CATEGORY, title="PolyPose")
    SampleDataLogic.registerCustomSampleDataSource(
        category=CATEGORY,
        sampleName=SAMPLE_NAME,
        uris=[CT[0], LABELS[0]],
        fileNames=[CT[1], LABELS[1]],
        nodeNames=[None, None],
        checksums=[CT[2], LABELS[2]],
        loadFiles=[False, False],
        thumbnailFileName=str(_RESOURCES / "Icons" / "PolyPosePelvis.png"),
        customDownloader=lambda source=None: download_or_say(parameter_node),
    )


def download_or_say(parameter_node: Callable[[], Any]) -> list[slicer.vtkMRMLNode]:
    """As `download`, for Sample Data's button, which hides exceptions: a window shows what went wrong."""
    try:
        return download(parameter_node)
    except Exception as error:  # the network, the disk, a checksum: SampleData raises whatever it meets
        slicer.util.errorDisplay(str(error), detailedText=traceback.format_exc())
        return []


def download(parameter_node: Callable[[], Any]) -> list[slicer.vtkMRMLNode]:
    """Fetch the CT and labels, simulate the X-rays, and set up the module's parameter node with them.

    Raises DependencyError when packages are missing and declined, another PolyPoseError when it fails.
    """
    from SampleData import SampleDataLogic

    logic = SampleDataLogic()
    files = [logic.downloadFileIntoCache(uri, name, checksum) for uri, name, checksum in (CT, LABELS)]
    case = Path(files[0]).parent / CASE_FOLDER
    study = case / "study.json"
    if not study.is_file():
        ensure_dependencies(_RESOURCES / "requirements.txt")
        simulate(files[0], files[1], case)
    parameters = parameter_node()
    nodes = open_study(study, parameters, LABEL_TABLE)
    show_volume(parameters.ct, parameters.segmentation)
    return nodes


def simulate(ct: str, labels: str, case: Path) -> None:
    """Let the core move the femora and take two X-rays, in a child process; takes about half a minute.

    case: the folder for the study; it appears when it is whole. Raises PolyPoseError when it fails.
    """
    from PolyPoseLib.io.samples import suggestion

    structures = case.with_name(case.name + "-structures.json")
    structures.write_text(json.dumps(suggestion("pelvis")), encoding="utf-8")
    arguments = ["simulate", "--ct", ct, "--segmentation", labels, "--structures", str(structures)]
    slicer.util.showStatusMessage(_("PolyPose simulates two X-rays of the sample..."))
    try:
        run_core([*arguments, "--format", "nifti", "--output", str(case)], case.parent)
    finally:
        structures.unlink(missing_ok=True)
        slicer.util.showStatusMessage("")


def run_core(arguments: Sequence[str], folder: Path) -> None:
    """Run a subcommand of PolyPoseLib to its end while the application stays alive; raises PolyPoseError."""
    command = [python_executable(), "-m", "PolyPoseLib", *map(os.fspath, arguments)]
    try:
        job = Job(command, child_environment(), str(folder))
    except OSError as error:
        raise PolyPoseError(
            _("{program} could not be started ({reason}): install Slicer again.").format(
                program=command[0], reason=error.strerror
            )
        ) from error
    try:
        while not job.finished:
            job.poll()
            slicer.app.processEvents()
            time.sleep(_WAIT_SECONDS)
    finally:
        job.close()
    if job.exit_status != 0:
        raise error_of(job.exit_status, job.log)
