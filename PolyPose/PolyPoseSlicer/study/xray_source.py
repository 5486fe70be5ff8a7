"""Where an X-ray comes from: a node of the scene, one frame of a sequence, or a file; and what was entered about it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.errors import InputError

from ..scene.cameras import extrinsic_of
from ..scene.landmark_lists import CAMERA_REFERENCE, pairs_of
from .camera_source import CameraSource, entry_of_source


@dataclass(frozen=True)
class XraySource:
    """One X-ray as the user gives it.

    Parameters
    ----------
    image : vtkMRMLScalarVolumeNode or vtkMRMLSequenceNode, optional
        None for a file.
    path : str
        The file; with an image node only when its DICOM file is to be replaced by another.
    frame : int, optional
        Which image of a sequence or of a file with several, from 0; None: the only one.
    fields : dict
        What a study file gives for an X-ray (source_to_detector_mm, pixel_spacing_mm, camera, ...), see
        docs/study-format.md; it wins over what the image's file gives. "extrinsic" maps the world (LPS mm) to the
        camera.
    camera_transform : vtkMRMLTransformNode, optional
        From the camera's axes (x along columns, y down rows, z to the detector) to the world; takes the place of
        "extrinsic".
    camera_source : CameraSource
        Where the initial camera comes from.
    ct_landmarks, xray_landmarks : vtkMRMLMarkupsFiducialNode, optional
        Points for the camera source LANDMARKS.
    found : FoundCamera, optional
        What a search for the camera found last.

    Raises
    ------
    InputError
        There is neither an image nor a file, or the node is not an image.

    """

    image: slicer.vtkMRMLNode | None = None
    path: str = ""
    frame: int | None = None
    fields: Mapping[str, Any] = field(default_factory=dict)
    camera_transform: slicer.vtkMRMLTransformNode | None = None
    camera_source: CameraSource = CameraSource.AUTO
    ct_landmarks: slicer.vtkMRMLMarkupsFiducialNode | None = None
    xray_landmarks: slicer.vtkMRMLMarkupsFiducialNode | None = None
    found: FoundCamera | None = None

    def __post_init__(self) -> None:
        """Raise InputError, as one sentence, when there is no X-ray."""
        if self.image is None and not self.path:
            raise InputError(_("An X-ray needs an image of the scene or a file: choose one."))
        if self.image is not None and not (
            self.image.IsA("vtkMRMLScalarVolumeNode") or self.image.IsA("vtkMRMLSequenceNode")
        ):
            raise InputError(
                _("'{name}' is not an image: choose a volume or a sequence of volumes.").format(
                    name=self.image.GetName()
                )
            )

    @classmethod
    def of(cls, given: Any) -> XraySource:
        """An X-ray from itself, a node, or a path."""
        if isinstance(given, cls):
            return given
        if isinstance(given, (str, Path)):
            return cls(path=str(given))
        return cls(image=given)

    @property
    def name(self) -> str:
        """Its name for people."""
        given = self.fields.get("name")
        if given:
            return str(given)
        name = self.image.GetName() if self.image is not None else Path(self.path).name
        return name if self.frame is None else f"{name} [{self.frame}]"

    @property
    def identity(self) -> str:
        """Tells whether it is the same image as another: its node's ID, its file and its frame."""
        node = "" if self.image is None else self.image.GetID() or ""
        return f"{node}|{self.path}|{'' if self.frame is None else self.frame}"

    @property
    def series(self) -> str:
        """The same whichever of its images is chosen: its node's ID and its file."""
        return self.identity.rpartition("|")[0]

    def file(self) -> tuple[str, int | None]:
        """The file that holds the X-ray as it was acquired, and the frame in it; ("", None) when there is none.

        Slicer turns XA and RF images round and drops their geometry, so their DICOM file is preferred.
        """
        if self.path:
            return self.path, self.frame
        node = self._image_node()
        alone = False
        if node.IsA("vtkMRMLSequenceNode") and not node.GetAttribute("DICOM.instanceUIDs"):
            sequence, node = node, _frame_node(node, self.frame)
            alone = _has_file_of_its_own(sequence, node)
        uids = (node.GetAttribute("DICOM.instanceUIDs") or "").split()
        database = getattr(slicer, "dicomDatabase", None)
        if not uids or database is None or not database.isOpen:
            return "", None
        if len(uids) == 1:
            path, frame = database.fileForInstance(uids[0]), None if alone else self.frame
        else:
            # One file per image: the sequence's frame is the file's place in the list.
            path, frame = database.fileForInstance(uids[min(self.frame or 0, len(uids) - 1)]), None
        return (path, frame) if path and Path(path).is_file() else ("", None)

    def at(self, frame: int) -> XraySource:
        """Another image of the same row."""
        return replace(self, frame=frame)

    def pixels(self) -> tuple[np.ndarray, tuple[float, float]]:
        """Copy of the image node's values (H, W), row by row as stored, and its spacing (row, column) in mm.

        Raises InputError, as one sentence, when the node is no single image.
        """
        values, spacing = self.pixels_view()
        return np.array(values), spacing

    def pixels_view(self) -> tuple[np.ndarray, tuple[float, float]]:
        """The same without a copy: the node's own values."""
        given = node = self._image_node()
        if given.IsA("vtkMRMLSequenceNode"):
            node = _frame_node(given, self.frame)
        if node.GetImageData() is None:
            raise InputError(_("The X-ray '{name}' has no pixels: load it again.").format(name=self.name))
        values = slicer.util.arrayFromVolume(node)
        across, down, _through = node.GetSpacing()
        frame = self.frame if not given.IsA("vtkMRMLSequenceNode") else None
        if values.shape[0] > 1 and frame is None:
            raise InputError(
                _(
                    "The X-ray '{name}' is a volume of {count} images: choose one of them as its frame."
                ).format(name=self.name, count=values.shape[0])
            )
        if not 0 <= (frame or 0) < values.shape[0]:
            raise InputError(
                _("The X-ray '{name}' has {count} images: choose one of them as its frame.").format(
                    name=self.name, count=values.shape[0]
                )
            )
        return values[frame or 0], (down, across)

    def _image_node(self) -> slicer.vtkMRMLNode:
        if self.image is None:
            raise InputError(
                _("The X-ray '{name}' is a file and not an image of the scene: load it.").format(
                    name=self.name
                )
            )
        return self.image

    @property
    def starts_from_transform(self) -> bool:
        """Whether the registration starts from the camera's transform node."""
        taken = self.found is not None and self.found.taken
        return self.camera_transform is not None and (self.camera_source.by_transform or taken)

    @property
    def landmark_camera(self) -> slicer.vtkMRMLLinearTransformNode | None:
        """The camera's transform that the landmarks gave, when the camera comes from them."""
        if self.camera_source is not CameraSource.LANDMARKS or self.xray_landmarks is None:
            return None
        return self.xray_landmarks.GetNodeReference(CAMERA_REFERENCE)

    def entry(self, image: str, frame: int | None) -> dict[str, Any]:
        """The X-ray's object in a study file, for the registration."""
        extrinsic = extrinsic_of(self.camera_transform).tolist() if self.starts_from_transform else None
        landmarks = pairs_of(self.ct_landmarks, self.xray_landmarks).entries()
        return self._with_image(
            entry_of_source(self.camera_source, self._given(), extrinsic, landmarks), image, frame
        )

    def shown_entry(self, image: str, frame: int | None) -> dict[str, Any]:
        """The same for the panel, which shows the camera that landmarks gave instead of reading them again."""
        node = self.camera_transform if self.starts_from_transform else self.landmark_camera
        extrinsic = None if node is None else extrinsic_of(node).tolist()
        entry = self._with_image(
            entry_of_source(self.camera_source, self._given(), extrinsic, []), image, frame
        )
        for key in ("mask", "calibration"):
            if entry.get(key):
                entry[key] = Path(entry[key])  # the user has chosen it, wherever it lies
        return {**entry, "name": self.name}

    def _given(self) -> dict[str, Any]:
        return {key: value for key, value in self.fields.items() if value is not None and key != "frame"}

    def _with_image(self, entry: dict[str, Any], image: str, frame: int | None) -> dict[str, Any]:
        entry["image"] = (
            image  # no name of a node, which may be the patient's: the user's alone reaches files
        )
        return entry if frame is None else {**entry, "frame": int(frame)}


def _frame_node(sequence: slicer.vtkMRMLSequenceNode, frame: int | None) -> slicer.vtkMRMLScalarVolumeNode:
    count = sequence.GetNumberOfDataNodes()
    if not 0 <= (frame or 0) < count:
        raise InputError(
            _("The sequence '{name}' has {count} images: choose one of them as the frame.").format(
                name=sequence.GetName(), count=count
            )
        )
    node = sequence.GetNthDataNode(frame or 0)
    if not node.IsA("vtkMRMLScalarVolumeNode"):
        raise InputError(
            _("The sequence '{name}' does not hold images: choose another.").format(name=sequence.GetName())
        )
    return node


def _has_file_of_its_own(sequence: slicer.vtkMRMLSequenceNode, node: slicer.vtkMRMLNode) -> bool:
    """Whether an image of a sequence comes from another DICOM file than the others: not from one of several frames."""
    ends = (sequence.GetNthDataNode(0), sequence.GetNthDataNode(sequence.GetNumberOfDataNodes() - 1))
    uids = node.GetAttribute("DICOM.instanceUIDs")
    return any(each.GetAttribute("DICOM.instanceUIDs") != uids for each in ends)


def fields_from_text(text: str) -> dict[str, Any]:
    """Entered fields from their text in the parameter node; raises InputError when it is damaged."""
    fields = json.loads(text or "{}")
    if not isinstance(fields, dict):
        raise InputError(_("The stored fields of an X-ray are damaged: remove the X-ray and add it again."))
    return fields
