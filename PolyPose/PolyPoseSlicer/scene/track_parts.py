"""Which nodes belong to a track: its browser refers to all of them, so that a loaded scene knows them again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import slicer

_MADE, _PASSING = "PolyPose.Made", "PolyPose.Passing"


class TrackParts:
    """The nodes of a track, by a role and a number.

    References are kept and mended by the scene, also where two scenes are merged. Marks on the nodes themselves would
    not do: what a browser shows takes over the attributes of each frame.
    """

    def __init__(self, browser: slicer.vtkMRMLSequenceBrowserNode) -> None:
        self._browser = browser

    def made(self, role: str, number: int, node: Any) -> Any:
        """Take note of a node that goes when the track does."""
        self.given(role, number, node)
        self._browser.AddNodeReferenceID(_MADE, node.GetID())
        return node

    def given(self, role: str, number: int, node: slicer.vtkMRMLNode) -> None:
        """Take note of a node that stays when the track goes."""
        self._browser.SetNodeReferenceID(_role(role, number), node.GetID())

    def get(self, role: str, number: int = 0) -> Any:
        """A node, or None where it is not in the scene any more."""
        return self._browser.GetNodeReference(_role(role, number))

    def all_of(self, role: str) -> Iterator[Any]:
        """The nodes of a role, by their number, up to the first that is not there."""
        number = 0
        while (node := self.get(role, number)) is not None:
            yield node
            number += 1

    def forget_unsaved(self) -> None:
        """Let the browser drop sequences that a scene's file did not hold: it does so when any reference goes."""
        self._browser.SetNodeReferenceID(_PASSING, self._browser.GetID())
        self._browser.RemoveNodeReferenceIDs(_PASSING)

    def nodes_made(self) -> list[slicer.vtkMRMLNode]:
        """Those that go when the track does and are still in the scene; the browser is not among them."""
        count = self._browser.GetNumberOfNodeReferences(_MADE)
        nodes = (self._browser.GetNthNodeReference(_MADE, number) for number in range(count))
        return [node for node in nodes if node is not None]

    def remove(self) -> None:
        """Take the browser and everything that was made out of the scene, with how it is displayed and stored."""
        nodes = self.nodes_made()
        for node in (self._browser, *reversed(nodes)):  # without its browser, no sequence makes a proxy again
            _remove(node)


def _role(role: str, number: int) -> str:
    return f"PolyPose.{role}.{number}"


def _remove(node: slicer.vtkMRMLNode | None) -> None:
    if node is None or node.GetScene() is None:
        return
    helpers = []
    if node.IsA("vtkMRMLDisplayableNode"):
        helpers += [node.GetNthDisplayNode(number) for number in range(node.GetNumberOfDisplayNodes())]
    if node.IsA("vtkMRMLStorableNode"):
        helpers += [node.GetNthStorageNode(number) for number in range(node.GetNumberOfStorageNodes())]
    scene = node.GetScene()
    for each in (node, *helpers):
        if each is not None and each.GetScene() is scene:
            scene.RemoveNode(each)
