"""Opens a study file in the scene: its CT, segments, X-rays and choices, ready to be registered."""

from __future__ import annotations

import colorsys
import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

from ..scene.frames import flip_affine, flip_vectors
from ..scene.landmark_lists import fill, new_list
from ..scene.nodes import Grid, Layer, Voxels, set_layer, set_volume
from ..scene.pixel_frames import new_frame
from .camera_source import CameraSource
from .parameters import Device, PolyPoseParameterNode, Preset, store_xray_sources
from .results import BONE_WINDOW_LEVEL
from .xray_source import XraySource

_GOLDEN_ANGLE = 0.381966
_DICOM_ENDINGS = (".dcm", ".ima", "")


def open_study(
    path: str | Path, parameters: PolyPoseParameterNode, label_table: str | None = None
) -> list[slicer.vtkMRMLNode]:
    """Load what a study file names and set the parameter node by it.

    Parameters
    ----------
    path : path
        The study file.
    parameters : PolyPoseParameterNode
        Its inputs and options are replaced.
    label_table : str, optional
        Whose names the segments of a plain label map get when the study names no table.

    Returns
    -------
    list of vtkMRMLNode
        The new nodes.

    Raises
    ------
    InputError
        The study cannot be read; nothing was added to the scene.

    """
    from PolyPoseLib.data.volume import AIR_HU
    from PolyPoseLib.io import study_schema
    from PolyPoseLib.io.segmentations import read_segmentation
    from PolyPoseLib.io.volumes import read_volume, without_tilt

    path = Path(path)
    fields = study_schema.read(path)
    ct_path = path.parent / fields["ct"]
    ct, warnings = without_tilt(read_volume(ct_path, fields.get("ct_series")), ct_path, AIR_HU)
    for warning in warnings:
        logging.warning(warning)
    segmentation = read_segmentation(path.parent / fields["segmentation"], ct)
    images = [_read_image(path.parent / each["image"], each) for each in fields["xrays"]]
    ct_node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", "CT")
    set_volume(ct_node, ct.voxels, flip_affine(ct.affine), BONE_WINDOW_LEVEL)
    names = _label_names(fields.get("label_table") or label_table)
    bones, chosen = _add_segmentation(segmentation, fields["structures"], names)
    sources = [
        _xray_source(entry, image, path.parent) for entry, image in zip(fields["xrays"], images, strict=True)
    ]
    was = parameters.StartModify()
    parameters.ct, parameters.segmentation = ct_node, bones
    parameters.structures, parameters.anchor = json.dumps(chosen), fields["anchor"]
    store_xray_sources(parameters, sources)
    _set_options(parameters, fields.get("options") or {}, path.parent)
    parameters.EndModify(was)
    return [ct_node, bones, *(each.image for each in sources if each.image is not None)]


def _read_image(path: Path, entry: Mapping[str, Any]) -> np.ndarray | None:
    """The values of an X-ray, (H, W); None for DICOM, which the registration reads itself."""
    if path.suffix.lower() in _DICOM_ENDINGS:
        if not path.is_file():
            raise InputError(_("{path}: there is no such file; correct the study.").format(path=path))
        return None
    from PolyPoseLib.io.xray.plain import read_plain

    return read_plain(path, str(path), entry.get("frame"))[0]


def _xray_source(entry: Mapping[str, Any], image: np.ndarray | None, folder: Path) -> XraySource:
    fields = {key: value for key, value in entry.items() if key not in ("image", "frame")}
    for name in ("mask", "calibration"):
        if fields.get(name):
            fields[name] = str((folder / fields[name]).resolve())
    name = str(entry.get("name") or Path(entry["image"]).name.split(".")[0])
    lists: dict[str, Any] = {}
    if fields.get("landmarks") and fields.get("extrinsic") is None:
        lists = _add_landmarks(fields.pop("landmarks"), name)
    if image is None:
        path = str((folder / entry["image"]).resolve())
        return XraySource(path=path, frame=entry.get("frame"), fields=fields, **lists)
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", f"X-ray {name}")
    # An image of its own has no place in the patient; as in PNG files its rows run downwards.
    down, across = fields.get("pixel_spacing_mm") or (1.0, 1.0)
    set_volume(node, image[None], np.diag([-across, -down, 1.0, 1.0]))
    return XraySource(node, fields=fields, **lists)


def _add_landmarks(landmarks: list[Mapping[str, Any]], name: str) -> dict[str, Any]:
    """The lists of points of an X-ray, as arguments of XraySource."""
    names = [str(each.get("name") or number) for number, each in enumerate(landmarks, start=1)]
    points = flip_vectors(np.array([each["point"] for each in landmarks], dtype=np.float64))
    pixels = np.array([each["pixel"] for each in landmarks], dtype=np.float64)
    in_ct = new_list(f"{name}: landmarks in the CT", in_xray=False)
    in_xray = new_list(f"{name}: landmarks in the X-ray", in_xray=True)
    in_xray.SetAndObserveTransformNodeID(new_frame(f"{name}: pixels").GetID())
    fill(in_ct, points, names)
    fill(in_xray, np.column_stack([pixels, np.zeros(len(pixels))]), names)
    return {"camera_source": CameraSource.LANDMARKS, "ct_landmarks": in_ct, "xray_landmarks": in_xray}


def _label_names(table: str | None) -> dict[int, str]:
    if table is None:
        return {}
    from PolyPoseLib.data.label_names import label_table

    return label_table(table)


def _add_segmentation(
    segmentation: Any, structures: Mapping[str, list], names: Mapping[int, str]
) -> tuple[slicer.vtkMRMLSegmentationNode, dict[str, str]]:
    """The segmentation's node, and {segment ID: structure}."""
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", "Bones")
    node.GetSegmentation().SetSourceRepresentationName(
        slicer.vtkSegmentationConverter.GetSegmentationBinaryLabelmapRepresentationName()
    )
    owner = {label: structure for structure, labels in structures.items() for label in labels}
    chosen: dict[str, str] = {}
    for number, volume in enumerate(segmentation.layers):
        given = {each.label: each.name for each in segmentation.segments if each.layer == number}
        layer = Layer(Voxels(volume.voxels, Grid(volume.affine, volume.shape)), {})
        image = slicer.vtkOrientedImageData()
        set_layer(image, layer.voxels)
        for label in map(int, segmentation.labels_present(number)):
            name = given.get(label) or names.get(label) or f"Label {label}"
            identifier = _add_segment(node.GetSegmentation(), name, image, label)
            structure = owner.get(name, owner.get(label))
            if structure is not None:
                chosen[identifier] = structure
    node.CreateDefaultDisplayNodes()
    return node, chosen


def _add_segment(
    content: slicer.vtkSegmentation, name: str, image: slicer.vtkOrientedImageData, label: int
) -> str:
    """Add one segment of a shared label map, in a colour unlike its neighbours'; returns its ID."""
    segment = slicer.vtkSegment()
    segment.SetName(name)
    segment.SetColor(*colorsys.hsv_to_rgb((content.GetNumberOfSegments() * _GOLDEN_ANGLE) % 1, 0.5, 0.95))
    segment.SetLabelValue(label)
    segment.AddRepresentation(content.GetSourceRepresentationName(), image)
    identifier = content.GenerateUniqueSegmentID(name)
    content.AddSegment(segment, identifier)
    return identifier


def _set_options(parameters: PolyPoseParameterNode, options: Mapping[str, Any], folder: Path) -> None:
    rest = dict(options)
    if rest.get("camera_model"):
        rest["camera_model"] = str((folder / rest["camera_model"]).resolve())
    parameters.preset = Preset(rest.pop("preset", Preset.DEFAULT.value))
    parameters.device = Device(rest.pop("device", Device.AUTO.value))
    parameters.options = json.dumps(rest)
