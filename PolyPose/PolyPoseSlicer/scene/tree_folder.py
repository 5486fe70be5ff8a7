"""A folder in the tree of Slicer's Data module."""

from __future__ import annotations

from collections.abc import Iterable

import slicer
import vtk

NONE = 0
"""The number of no item."""


def new_folder(name: str, nodes: Iterable[slicer.vtkMRMLNode]) -> int:
    """Make a folder of nodes; returns the number of its item."""
    tree = _tree()
    folder = tree.CreateFolderItem(tree.GetSceneItemID(), tree.GenerateUniqueItemName(name))
    for node in nodes:
        item = tree.GetItemByDataNode(node)
        if item == NONE:
            tree.CreateItem(folder, node)
        else:
            tree.SetItemParent(item, folder)
    return folder


def folder_of(node: slicer.vtkMRMLNode) -> int:
    """The folder that holds a node, or NONE."""
    tree = _tree()
    item = tree.GetItemByDataNode(node)
    parent = tree.GetItemParent(item) if item != NONE else NONE
    return NONE if parent in (NONE, tree.GetSceneItemID()) else parent


def remove_items(nodes: Iterable[slicer.vtkMRMLNode], folder: int) -> None:
    """Take nodes out of the tree, and their folder unless it holds other things; the nodes stay in the scene."""
    tree = _tree()
    for node in nodes:
        item = tree.GetItemByDataNode(node)
        if item != NONE:
            tree.RemoveItem(item, False, False)
    if folder == NONE:
        return
    children = vtk.vtkIdList()
    tree.GetItemChildren(folder, children)
    if children.GetNumberOfIds() == 0:
        tree.RemoveItem(folder, False, False)


def _tree() -> slicer.vtkMRMLSubjectHierarchyNode:
    return slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(slicer.mrmlScene)
