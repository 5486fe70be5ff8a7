"""Reads and writes nodes through slicer-core's own logics and storage nodes, as Slicer's IO manager does."""

from __future__ import annotations

import os
from typing import Any

import slicer
import vtk

_TYPES = (
    ("SceneFile", (".mrml", ".mrb")),
    ("SegmentationFile", (".seg.nrrd", ".seg.nhdr")),
    ("TransformFile", (".h5", ".tfm", ".mat")),
    ("ModelFile", (".vtk", ".vtp", ".stl", ".ply", ".obj")),
    ("TableFile", (".csv", ".tsv")),
    ("VolumeFile", ("",)),
)


def _logic(name: str) -> Any:
    return getattr(slicer.modules, name.lower()).logic()


class IOManager:
    """Stands for `slicer.app.coreIOManager()`."""

    def fileType(self, file_name: str) -> str:
        """Which kind of file a name is."""
        name = str(file_name).lower()
        return next(kind for kind, extensions in _TYPES if name.endswith(extensions))

    def loadNodes(
        self,
        kind: str,
        properties: dict,
        loaded: vtk.vtkCollection,
        messages: slicer.vtkMRMLMessageCollection,
    ) -> bool:
        """Load a file; the nodes are added to `loaded`."""
        path = str(properties["fileName"])
        if not os.path.exists(path):
            return False
        if kind == "SceneFile":
            return self._load_scene(path, bool(properties.get("clear")), messages)
        name = properties.get("name") or os.path.basename(path).split(".")[0]
        node = self._load_node(kind, path, name, properties, messages)
        if node is None:
            return False
        loaded.AddItem(node)
        return True

    @staticmethod
    def _load_scene(path: str, clear: bool, messages: slicer.vtkMRMLMessageCollection) -> bool:
        slicer.mrmlScene.SetURL(path)
        if path.endswith(".mrb"):
            return bool(slicer.mrmlScene.ReadFromMRB(path, clear, messages))
        return bool(slicer.mrmlScene.Connect(messages) if clear else slicer.mrmlScene.Import(messages))

    @staticmethod
    def _load_node(
        kind: str, path: str, name: str, properties: dict, messages: slicer.vtkMRMLMessageCollection
    ) -> Any:
        if kind == "VolumeFile":
            options = (1 if properties.get("labelmap") else 0) | (4 if properties.get("singleFile") else 0)
            return _logic("Volumes").AddArchetypeVolume(path, name, options)
        if kind == "SegmentationFile":
            return _logic("Segmentations").LoadSegmentationFromFile(path, True, name)
        if kind == "TransformFile":
            return _logic("Transforms").AddTransform(path, slicer.mrmlScene, messages)
        if kind == "ModelFile":
            lps = slicer.vtkMRMLStorageNode.CoordinateSystemLPS
            return _logic("Models").AddModel(path, lps, messages)
        if kind == "TableFile":
            return _logic("Tables").AddTable(path, name)
        raise ValueError(f"The harness does not read files of type '{kind}'")

    def saveNodes(self, kind: str, properties: dict, messages: slicer.vtkMRMLMessageCollection) -> bool:
        """Save the scene, or the node that `nodeID` names."""
        path, scene = str(properties["fileName"]), slicer.mrmlScene
        if kind == "SceneFile":
            scene.SetURL(path)
            scene.SetRootDirectory(os.path.dirname(path))
            if path.endswith(".mrb"):
                return bool(scene.WriteToMRB(path, None, messages))
            return bool(scene.Commit(path, messages))
        node = scene.GetNodeByID(properties["nodeID"])
        if node.GetStorageNode() is None:
            node.AddDefaultStorageNode(path)
        node.GetStorageNode().SetFileName(path)
        return bool(node.GetStorageNode().WriteData(node))

    def fileWriterFileType(self, node: slicer.vtkMRMLNode) -> str:
        """The file type of a node's writer; only its class is known here."""
        return node.GetClassName()
