"""The logic's calls: nodes in, a running registration or nodes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.errors import InputError

from .process import environment
from .process.camera_run import CameraRun
from .process.registration import Registration
from .scene.motions import motions_of
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
from .study.refinement import adjusted_poses, with_found_cameras
from .study.results import InputStyle, OutputNodes, fill_nodes
from .study.writer import read_study
from .study.xray_source import XraySource

NAME = "PolyPose"
"""Begins the names of new nodes."""


@dataclass(frozen=True)
class Request:
    """What to register, and where its result goes; the fields are described at PolyPoseLogic.register.

    nodes: the output nodes; those that are None are made. preview: whether nodes.transform is refreshed meanwhile.
    initial_poses: where bones are started, (4, 4) from the X-rays' posture to the CT, LPS mm.
    """

    ct: Any
    segmentation: Any
    structures: Mapping[str, Sequence[str]] | Sequence[str]
    xrays: Sequence[Any]
    anchor: str
    nodes: OutputNodes
    options: Mapping[str, Any] | None = None
    output_folder: str | Path | None = None
    preview: bool = False
    initial_poses: Mapping[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        parameters: PolyPoseParameterNode,
        preview: bool | None = None,
        output_folder: str | Path | None = None,
    ) -> Request:
        """What a parameter node asks for; preview None leaves that to it."""
        return cls(
            parameters.ct,
            parameters.segmentation,
            structures_of(parameters),
            xray_sources(parameters),
            parameters.anchor,
            outputs_of(parameters),
            options_of(parameters),
            output_folder,
            parameters.livePreview if preview is None else preview,
        )

    def by_structure(self) -> Mapping[str, Sequence[str]]:
        """{structure: names or IDs of its segments}."""
        if isinstance(self.structures, Mapping):
            return self.structures
        return {name: [name] for name in self.structures}


def start(request: Request, command: list[str] | None = None) -> Registration:
    """Start a registration of nodes; raises InputError at once for wrong inputs.

    command: another program than PolyPoseLib, for tests.
    """
    problem = environment.version_problem()
    if problem:
        raise InputError(problem)
    nodes = request.nodes
    for given, output in ((request.ct, nodes.volume), (request.segmentation, nodes.segmentation)):
        if output is not None and output is given:
            raise InputError(
                _("'{name}' is both an input and an output: choose another node for the output.").format(
                    name=output.GetName()
                )
            )
    style = InputStyle.of(request.ct, request.segmentation)
    study = read_study(
        request.ct,
        request.segmentation,
        request.by_structure(),
        request.xrays,
        request.anchor,
        request.options,
    )
    study.initial_poses = dict(request.initial_poses)
    nodes.sources = tuple(XraySource.of(each).identity for each in request.xrays)
    return Registration(study, nodes, style, NAME, request.output_folder, request.preview, command)


def start_parameters(
    parameters: PolyPoseParameterNode, preview: bool | None = None, output_folder: str | Path | None = None
) -> Registration:
    """Start what a parameter node asks for; preview None leaves that to it. Raises InputError at once."""
    missing = missing_input(parameters)
    if missing:
        raise InputError(missing)
    return start(Request.of(parameters, preview, output_folder))


def start_refinement(
    parameters: PolyPoseParameterNode,
    adjustments: Mapping[str, np.ndarray],
    output_folder: str | Path | None = None,
    command: list[str] | None = None,
) -> Registration:
    """Start from a parameter node's result, its bones moved by hand, and fit them from there.

    adjustments: how bones were moved in the X-rays' posture, (4, 4) LPS mm; the others start where the result has them.
    Raises InputError at once.
    """
    missing = missing_input(parameters)
    if missing:
        raise InputError(missing)
    request = Request.of(parameters, output_folder=output_folder)
    known = request.by_structure()
    poses = adjusted_poses(motions_of(parameters.outputMotions), adjustments, parameters.anchor)
    poses = {name: pose for name, pose in poses.items() if name in known}
    if not poses:
        raise InputError(_("There is no result whose bones could be refined: register first."))
    xrays = with_found_cameras(request.xrays, request.nodes)
    return start(replace(request, xrays=xrays, initial_poses=poses), command)


def start_cameras(
    parameters: PolyPoseParameterNode, numbers: Sequence[int], command: list[str] | None = None
) -> CameraRun:
    """Start looking for the cameras of some X-rays of a parameter node; what is found is not stored.

    numbers: of xray_sources(parameters); number n of them is number n of what the run finds. Raises InputError at once
    for wrong inputs.
    """
    problem = environment.version_problem() or missing_input(parameters)
    if problem:
        raise InputError(problem)
    sources = xray_sources(parameters)
    wanted = [_called(without_camera(sources[number]), number) for number in numbers]
    study = read_study(
        parameters.ct,
        parameters.segmentation,
        structures_of(parameters),
        wanted,
        parameters.anchor,
        options_of(parameters),
    )
    camera_sources = {source.camera_source for source in wanted}
    chosen = camera_sources.pop() if len(camera_sources) == 1 else CameraSource.AUTO
    method = (
        chosen.value
        if chosen in (CameraSource.DICOM, CameraSource.LANDMARKS, CameraSource.SEARCH, CameraSource.LEARNED)
        else "auto"
    )
    return CameraRun(study, method, command)


def _called(source: XraySource, number: int) -> XraySource:
    """An X-ray with the name that results and messages give it: by its number among all, where the user gave none."""
    return replace(source, fields={**source.fields, "name": source.fields.get("name") or view_name(number)})


def without_camera(source: XraySource) -> XraySource:
    """An X-ray as if it had no camera yet, so that its source is asked for one."""
    fields = {key: value for key, value in source.fields.items() if key != "extrinsic"}
    if fields.get("camera") == "known":
        fields.pop("camera")
    by_hand = source.camera_source is CameraSource.CARM
    camera_source = CameraSource.AUTO if by_hand else source.camera_source
    return replace(source, fields=fields, camera_source=camera_source, camera_transform=None, found=None)


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
