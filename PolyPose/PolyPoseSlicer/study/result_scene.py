"""A result as a scene of its own: one file that opens in any Slicer."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError

from .parameters import PolyPoseParameterNode, outputs_of


def save_result_scene(parameters: PolyPoseParameterNode, path: str | Path) -> None:
    """Write the CT, its segmentation and the result, and nothing else of the scene, into an .mrb file.

    Raises PolyPoseError, as one sentence, when it cannot be written.
    """
    path = Path(path)
    outputs = outputs_of(parameters)
    wanted = [
        parameters.ct,
        parameters.segmentation,
        outputs.transform,
        outputs.volume,
        outputs.segmentation,
        outputs.motions,
        *outputs.cameras,
        *outputs.renderings,
        *outputs.xrays,
    ]
    with _saved_alone([node for node in wanted if node is not None]):
        written = slicer.mrmlScene.WriteToMRB(str(path))
    if not written or not path.is_file():
        raise PolyPoseError(_("{path} cannot be written: choose another folder.").format(path=path))


@contextlib.contextmanager
def _saved_alone(wanted: list[slicer.vtkMRMLNode]) -> Iterator[None]:
    """Leave all other data out of what is saved."""
    kept = {node.GetID() for node in wanted}
    others = [
        node
        for node in slicer.util.getNodesByClass("vtkMRMLStorableNode")
        if node.GetID() not in kept and node.GetSaveWithScene()
    ]
    for node in others:
        node.SetSaveWithScene(False)
    try:
        yield
    finally:
        for node in others:
            node.SetSaveWithScene(True)
