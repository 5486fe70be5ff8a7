"""The logic's calls: nodes in, a running registration or nodes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from PolyPoseLib.errors import InputError

from . import environment
from .loading import load_folder
from .parameters import (
    PolyPoseParameterNode,
    missing_input,
    options_of,
    outputs_of,
    structures_of,
    xray_sources,
)
from .registration import Registration
from .results import InputStyle, OutputNodes, fill_nodes
from .study_writer import read_study

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
