"""X-rays from what was dropped: items of the subject hierarchy, and files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import slicer
import vtk

from .xray_source import XraySource

ENDINGS = (
    ".dcm", ".ima", ".dicom", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd",
    ".png", ".jpg", ".jpeg", ".tif", ".tiff",
)  # fmt: skip
"""Of files that are taken without a look into them; any other file must be DICOM."""

_PREAMBLE, _MAGIC = 128, b"DICM"


def xrays_of_items(items: Iterable[int]) -> tuple[list[XraySource], list[str]]:
    """X-rays of items of the subject hierarchy, and the names of the items that hold none.

    An image gives itself, a folder, a study or a patient all X-rays below it: there, volumes of several slices are CTs
    and the like. What a sequence browser shows gives its sequence, at the image that is shown now.
    """
    hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(slicer.mrmlScene)
    sources: list[XraySource] = []
    refused: list[str] = []
    for item in items:
        node = hierarchy.GetItemDataNode(item)
        if node is not None and _is_image(node):
            found = [_source_of(node)]
        elif node is not None and not node.IsA("vtkMRMLFolderDisplayNode"):
            found = []
        else:
            below = vtk.vtkIdList()
            hierarchy.GetItemChildren(item, below, True)
            nodes = [hierarchy.GetItemDataNode(below.GetId(n)) for n in range(below.GetNumberOfIds())]
            images = [_source_of(each) for each in nodes if each is not None and _is_image(each)]
            found = [source for source in images if not _is_stack(source.image)]
        if not found:
            refused.append(hierarchy.GetItemName(item))
        sources += found
    return _each_once(sources), refused


def xrays_of_files(paths: Iterable[str]) -> tuple[list[XraySource], list[str]]:
    """X-rays of image files, and the names of the files that are none."""
    sources, refused = [], []
    for path in (Path(each) for each in paths):
        if _is_image_file(path):
            sources.append(XraySource(path=str(path)))
        else:
            refused.append(path.name)
    return _each_once(sources), refused


def without_known(sources: Sequence[XraySource], known: Sequence[XraySource]) -> list[XraySource]:
    """The X-rays whose image, frame and file are not among the known ones."""
    keys = {_key(each) for each in known}
    return [each for each in sources if _key(each) not in keys]


def _source_of(node: Any) -> XraySource:
    if node.IsA("vtkMRMLSequenceNode"):
        return XraySource(node, frame=0)
    browser = slicer.modules.sequences.logic().GetFirstBrowserNodeForProxyNode(node)
    if browser is None:
        return XraySource(node)
    return XraySource(browser.GetSequenceNode(node), frame=max(browser.GetSelectedItemNumber(), 0))


def _is_image(node: Any) -> bool:
    if node.IsA("vtkMRMLSequenceNode"):
        first = node.GetNthDataNode(0) if node.GetNumberOfDataNodes() else None
        return first is not None and _is_image(first)
    return node.IsA("vtkMRMLScalarVolumeNode") and not node.IsA("vtkMRMLLabelMapVolumeNode")


def _is_stack(node: Any) -> bool:
    """Whether an image, or the first of a sequence, has several slices."""
    if node.IsA("vtkMRMLSequenceNode"):
        return _is_stack(node.GetNthDataNode(0))
    return node.GetImageData() is not None and node.GetImageData().GetDimensions()[2] > 1


def _is_image_file(path: Path) -> bool:
    try:
        if not path.is_file():
            return False
        if path.name.lower().endswith(ENDINGS):
            return True
        with path.open("rb") as file:
            return file.read(_PREAMBLE + len(_MAGIC))[_PREAMBLE:] == _MAGIC
    except OSError:
        return False


def _key(source: XraySource) -> tuple[str, str, int | None]:
    return (source.image.GetID() if source.image is not None else "", source.path, source.frame)


def _each_once(sources: Sequence[XraySource]) -> list[XraySource]:
    return list({_key(each): each for each in sources}.values())
