"""The logic's calls: nodes in, a running registration or nodes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError

from .process import environment
from .process.camera_run import CameraRun
from .process.registration import Registration
from .study.camera_source import CameraSource
from .study.loading import load_folder
from .study.parameters import (
    PolyPoseParameterNode,
    missing_input,
    options_of,
    outputs_of,
    structures_of,
    xray_sources,
)
from .study.results import InputStyle, OutputNodes, fill_nodes
from .study.writer import read_study
from .study.xray_source import XraySource

NAME = "PolyPose"
"""Begins the names of new nodes."""


def start(
    ct: Any,
    segmentation: Any,
    structures: Mapping[str, Sequence[str]] | Sequence[str],
    xrays: Sequence[Any],
    anchor: str,
    nodes: OutputNodes,
    options: Mapping[str, Any] | None = None,
    output_folder: str | Path | None = None,
    preview: bool = False,
    command: list[str] | None = None,
) -> Registration:
    """Start a registration of nodes; see PolyPoseLogic.register. Raises InputError at once for wrong inputs."""
    problem = environment.version_problem()
    if problem:
        raise InputError(problem)
    if not isinstance(structures, Mapping):
        structures = {name: [name] for name in structures}
    for given, output in ((ct, nodes.volume), (segmentation, nodes.segmentation)):
        if output is not None and output is given:
            raise InputError(
                f"'{output.GetName()}' is input and output at once: choose another node for the output."
            )
    style = InputStyle.of(ct, segmentation)
    study = read_study(ct, segmentation, structures, xrays, anchor, options)
    return Registration(study, nodes, style, NAME, output_folder, preview, command)


def start_parameters(
    parameters: PolyPoseParameterNode, preview: bool | None = None, output_folder: str | Path | None = None
) -> Registration:
    """Start what a parameter node says; preview None leaves that to it. Raises InputError at once."""
    missing = missing_input(parameters)
    if missing:
        raise InputError(missing)
    return start(
        parameters.ct,
        parameters.segmentation,
        structures_of(parameters),
        xray_sources(parameters),
        parameters.anchor,
        outputs_of(parameters),
        options_of(parameters),
        output_folder,
        preview=parameters.livePreview if preview is None else preview,
    )


def start_cameras(
    parameters: PolyPoseParameterNode, numbers: Sequence[int], command: list[str] | None = None
) -> CameraRun:
    """Start looking for the cameras of some X-rays of a parameter node; what is found is not stored.

    numbers: of xray_sources(parameters); number n of them is number n of the run's findings. Raises InputError at once
    for wrong inputs.
    """
    problem = environment.version_problem() or missing_input(parameters)
    if problem:
        raise InputError(problem)
    sources = xray_sources(parameters)
    wanted = [without_camera(sources[number]) for number in numbers]
    study = read_study(
        parameters.ct,
        parameters.segmentation,
        structures_of(parameters),
        wanted,
        parameters.anchor,
        options_of(parameters),
    )
    ways = {source.way for source in wanted}
    chosen = ways.pop() if len(ways) == 1 else CameraSource.AUTO
    method = (
        chosen.value
        if chosen in (CameraSource.DICOM, CameraSource.LANDMARKS, CameraSource.SEARCH, CameraSource.LEARNED)
        else "auto"
    )
    return CameraRun(study, method, command)


def without_camera(source: XraySource) -> XraySource:
    """An X-ray as if it had no camera yet, so that one is looked for in its way."""
    fields = {key: value for key, value in source.fields.items() if key != "extrinsic"}
    if fields.get("camera") == "known":
        fields.pop("camera")
    way = CameraSource.AUTO if source.way is CameraSource.CARM else source.way
    return replace(source, fields=fields, way=way, camera_transform=None, found=None)


def load(
    folder: str | Path, ct: Any = None, segmentation: Any = None, nodes: OutputNodes | None = None
) -> OutputNodes:
    """Put the result folder of an earlier registration into the scene, all of it or nothing.

    ct, segmentation: the inputs that it was made from, for names, colours and the display; may be None.
    Raises InputError when the folder holds no whole result.
    """
    loaded = load_folder(folder)
    nodes = nodes or OutputNodes()
    try:
        for _step in fill_nodes(loaded, nodes, InputStyle.of(ct, segmentation), NAME):
            pass
    except BaseException:
        nodes.remove_made()
        raise
    return nodes
