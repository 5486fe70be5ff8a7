"""Nodes that the module makes for its own views, and takes out of the scene itself."""

from __future__ import annotations

from typing import Any

import slicer

from .names import free_name


def unsaved_node(kind: str, name: str) -> Any:
    """A node that is drawn from others, so that scenes do not keep it; not in the scene yet."""
    node = slicer.mrmlScene.CreateNodeByClass(kind)
    node.UnRegister(None)
    node.SetName(free_name(name))
    node.SetSaveWithScene(False)
    return node


def remove_with_display(node: slicer.vtkMRMLNode) -> None:
    """Take a node and its display nodes, where it has any, out of the scene."""
    displays = []
    if node.IsA("vtkMRMLDisplayableNode"):
        displays = [node.GetNthDisplayNode(number) for number in range(node.GetNumberOfDisplayNodes())]
    for each in (node, *displays):
        if each is not None and each.GetScene() is not None:
            each.GetScene().RemoveNode(each)
