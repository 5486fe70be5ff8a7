"""Subcommand cameras: find an initial camera for every X-ray of a study and write it into the study."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.cli._arguments import add_options, add_progress, merged_options, new_parser
from PolyPoseLib.cli._console import progress_display, table
from PolyPoseLib.cli._destinations import check_json_destinations
from PolyPoseLib.data.found_camera import camera_report
from PolyPoseLib.errors import InputError, UntrustedResultError
from PolyPoseLib.io.json_records import json_text
from PolyPoseLib.io.whole_files import replaced_whole

if TYPE_CHECKING:
    from PolyPoseLib.data.found_camera import FoundCamera
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.data.xray import Xray

_LOG = logging.getLogger(__name__)


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = new_parser(
        subparsers,
        "cameras",
        "find the camera of every X-ray that has none and write it into the study",
        "case/study.json --method search",
    )
    parser.add_argument("study", type=Path, help="the study's JSON file")
    parser.add_argument(
        "--method",
        choices=("auto", "dicom", "landmarks", "search", "learned"),
        default="auto",
        help="auto: landmarks, else DICOM, else learned where a model is given, else search (default: auto)",
    )
    parser.add_argument(
        "--output", type=Path, metavar="FILE", help="write here, in the study's folder, instead of into STUDY"
    )
    parser.add_argument(
        "--again", action="store_true", help="also where the study gives an initial camera already"
    )
    parser.add_argument(
        "--keep-uncertain",
        action="store_true",
        help="also write cameras that are uncertain; the exit status stays 3",
    )
    parser.add_argument(  # the option's name in earlier versions
        "--keep-doubtful", dest="keep_uncertain", action="store_true", help=argparse.SUPPRESS
    )
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FILE",
        help='camera model that "train" wrote for this CT; wins over the study\'s option "camera_model"',
    )
    parser.add_argument(
        "--report",
        type=Path,
        metavar="FILE",
        help="also write what was found, uncertain or not, as JSON for other programs",
    )
    parser.add_argument(
        "--allow-outside", action="store_true", help="read files outside the study's folder if it names them"
    )
    add_options(parser)
    add_progress(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Find and write; raises UntrustedResultError after writing when a camera is uncertain."""
    from PolyPoseLib.io import study_schema
    from PolyPoseLib.io.studies import load_study

    output = arguments.output or arguments.study
    if output.resolve().parent != arguments.study.resolve().parent:
        raise InputError(f"{output}: the study's paths start from its folder: choose a file in that folder.")
    fields = study_schema.read(arguments.study)
    check_json_destinations(arguments.study, fields, output, arguments.report)
    study = load_study(arguments.study, allow_outside=arguments.allow_outside)
    wanted = [
        n
        for n, (entry, xray) in enumerate(zip(fields["xrays"], study.xrays, strict=True))
        if xray.camera != "known" and (arguments.again or entry.get("extrinsic") is None)
    ]
    if not wanted:
        _LOG.info("Every X-ray has a camera already; add --again to find them anew.")
        return 0
    names = [xray.name for xray in study.xrays]
    found = _find(study, wanted, arguments)
    for number, camera in found.items():
        if camera.sure or arguments.keep_uncertain:
            _enter(fields["xrays"][number], camera)
    if arguments.report is not None:  # first: what fails here leaves the study as it was
        report = camera_report(names, found)
        write_json(report, arguments.report, "--report")
    write_json(fields, output, "--output")
    if arguments.progress != "json":
        print(camera_table(names, found))
    uncertain = [names[n] for n, camera in found.items() if not camera.sure]
    if uncertain:
        kept = "written all the same" if arguments.keep_uncertain else "not written"
        raise UntrustedResultError(
            f'The camera of {", ".join(uncertain)} is uncertain and was {kept}: give "landmarks" or "standard_view", '
            "or check it by eye."
        )
    return 0


def camera_table(names: Sequence[str], found: Mapping[int, FoundCamera]) -> str:
    """What was found, for people."""
    rows = [
        (
            names[n],
            "yes" if camera.sure else "no",
            f"{camera.within[0]:.0f} deg, {camera.within[1]:.0f} mm",
            camera.how,
        )
        for n, camera in found.items()
    ]
    return table(("X-ray", "sure", "within", "how"), rows)


def write_json(fields: dict[str, Any], path: Path, option: str) -> None:
    """Write a file whole or not at all; raises InputError, naming the option, when the system refuses."""
    try:
        with replaced_whole(path) as temporary:
            temporary.write_text(json_text(fields), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}): choose another {option}.") from error


def _find(study: Study, wanted: list[int], arguments: argparse.Namespace) -> dict[int, FoundCamera]:
    """Cameras of the X-rays ``wanted``, by number."""
    from PolyPoseLib.data.options import Options
    from PolyPoseLib.data.progress import Monitor
    from PolyPoseLib.data.xray import place_isocenter
    from PolyPoseLib.io.machine_memory import require_memory
    from PolyPoseLib.pipeline import camera_regressor
    from PolyPoseLib.registration.cameras.rig_initial import initial_rig_cameras
    from PolyPoseLib.registration.cameras.study import grouped_by_rig
    from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
    from PolyPoseLib.registration.memory import needed_memory
    from PolyPoseLib.registration.run import Run
    from PolyPoseLib.registration.scene import Scene
    from PolyPoseLib.rendering.select import must_compile, select_backend, torch_device_of

    options = Options.from_dict(merged_options(study.options, arguments))
    backend = select_backend(options.kernel, options.device, options.threads)
    need = needed_memory(study, options, warps=False, compiles=must_compile(backend))
    require_memory(need, "The search of cameras")
    display = progress_display(arguments.progress)
    cameras: dict[int, FoundCamera] = {}
    try:
        model = camera_regressor(study, arguments.model or options.camera_model)
        scene = Scene(study.ct, study.structures, study.anchor)
        soft_tissue = SoftTissue(scene, device=torch_device_of(backend))
        run = Run(soft_tissue, backend, Monitor(display, None))
        xrays = place_isocenter(study.xrays, run.scene.anchor_centre)
        for numbers in grouped_by_rig(xrays):
            if not set(numbers) & set(wanted):
                continue
            group = [xrays[n] for n in numbers]
            stage = f"camera {group[0].name or numbers[0] + 1}"
            method = _method(group[0], arguments, model is not None)
            found = initial_rig_cameras(run.named(stage), group, method, model)
            run.named(stage).step(1, 1, found[0].similarity)
            for n, camera in zip(numbers, found, strict=True):
                if n in wanted:
                    cameras[n] = replace(camera, mirrored=xrays[n].mirrored)
            for warning in dict.fromkeys(line for camera in found for line in camera.warnings):
                _LOG.warning(warning)
    finally:
        display.close()
    return cameras


def _method(xray: Xray, arguments: argparse.Namespace, has_model: bool) -> str:
    """The method asked for; "auto" with --again ignores the initial camera that the study gives."""
    if arguments.method != "auto" or not arguments.again or xray.initial_radius is not None:
        return arguments.method
    return "landmarks" if xray.landmarks is not None else "learned" if has_model else "search"


def _enter(entry: dict[str, Any], found: FoundCamera) -> None:
    """Put a camera into an X-ray's entry; the extrinsic belongs to the view from the source."""
    entry["extrinsic"] = found.extrinsic.tolist()
    entry["camera"] = "initial"
    entry["mirrored"] = found.mirrored
