"""Turns a request into the folder of a TRACK.json: first all is taken from the scene, then it is written without it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.data.progress import CancelQuery
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry.camera import Camera

from .ct_files import gather
from .track_plan import PlannedCamera, TrackPlan
from .track_request import Start, TrackRequest
from .writer import StudyData, numbers_left, read_bones, with_spacing, write_bones, write_pixels
from .xray_series import XraySeries, series_of

TRACK_FILE = "TRACK.json"
_CAMERAS = "cameras.json"


@dataclass
class CameraData:
    """One camera outside of the scene: the fields of its entry without its images, its images, and its found camera."""

    entry: dict[str, Any]
    series: XraySeries
    found: Camera | None


@dataclass
class TrackData:
    """What is tracked, outside of the scene; nothing in it refers to a node.

    study: CT and bones. cameras: in the order of the rows. fields: of TRACK.json beside CT, bones and cameras.
    """

    study: StudyData
    cameras: list[CameraData]
    fields: dict[str, Any]


def read_track(request: TrackRequest, plan: TrackPlan) -> TrackData:
    """Take all that tracking needs from the scene; the pixels of X-rays are referred to, not copied.

    Raises InputError, as one sentence, when something is missing or wrong.
    """
    if plan.missing is not None:
        raise InputError(plan.missing.sentence)
    study = read_bones(request.ct, request.segmentation, request.by_structure(), request.reference)
    kept = all(each.found is not None for each in plan.cameras)
    cameras = [
        CameraData(_entry(each, kept), series_of(each.source), each.found if kept else None)
        for each in plan.cameras
    ]
    return TrackData(study, cameras, _fields(request, plan))


def _fields(request: TrackRequest, plan: TrackPlan) -> dict[str, Any]:
    settings = request.settings
    options: dict[str, Any] = {
        "first": plan.frames.start,
        "last": plan.frames.stop - 1,
        "start": Start.REST.value if settings.start is Start.RESULT else settings.start.value,
        "backward": settings.backward,
        "smooth": settings.smooth,
    }
    if request.threads:
        options["threads"] = request.threads
    fields: dict[str, Any] = {
        "version": 1,
        "reference": request.reference,
        "frames_per_second": plan.rate,
        "still": [name for name in settings.still if name in request.by_structure()],
        "options": options,
    }
    if settings.start is Start.RESULT:
        fields["initial_poses"] = {name: np.asarray(pose).tolist() for name, pose in request.poses.items()}
    return fields


def _entry(camera: PlannedCamera, kept: bool) -> dict[str, Any]:
    """The fields of one camera; kept: its place comes from a registration."""
    from PolyPoseLib.io.tracking.schema import CAMERA_FIELDS

    given = camera.source.entry("", None)
    fields = {name: value for name, value in given.items() if name in CAMERA_FIELDS}
    for name in ("extrinsic", "camera"):
        fields.pop(name, None)
    if not kept and camera.known is not None:
        fields["extrinsic"] = camera.known.tolist()
        if camera.mirrored:
            fields["mirrored"] = True
    return {**fields, "name": camera.name, "first": camera.first}


def inputs_digest(request: TrackRequest, plan: TrackPlan) -> str:
    """Changes whenever the same call would track something else: an interrupted run is gone on with only while not."""
    parts: list[Any] = [
        _fields(request, plan),
        [_changed_at(request.ct), _changed_at(request.segmentation)],
        {name: list(ids) for name, ids in request.by_structure().items()},
    ]
    for each in plan.cameras:
        found = (
            None if each.found is None else [each.found.intrinsics.tolist(), each.found.extrinsic.tolist()]
        )
        known = None if each.known is None else each.known.tolist()
        parts.append([each.name, each.first, each.count, each.source.series, found, known, each.mirrored])
        parts.append([each.source.entry("", None), _changed_at(each.source.image), _age(each.source.path)])
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def _changed_at(node: Any) -> list[Any]:
    """Changes with a node's content and with its place in the scene."""
    if node is None:
        return []
    found: list[Any] = [node.GetID()]
    if node.IsA("vtkMRMLSegmentationNode"):
        content = node.GetSegmentation()
        found.append([content.GetSegment(each).GetMTime() for each in content.GetSegmentIDs()])
    elif node.IsA("vtkMRMLVolumeNode"):
        found.append(_image_changed_at(node))
    elif node.IsA("vtkMRMLSequenceNode"):
        images = (node.GetNthDataNode(number) for number in range(node.GetNumberOfDataNodes()))
        found.append([_image_changed_at(each) for each in images])
    parent = node.GetParentTransformNode() if node.IsA("vtkMRMLTransformableNode") else None
    return [*found, [] if parent is None else [parent.GetID(), parent.GetTransformToWorldMTime()]]


def _image_changed_at(node: Any) -> int:
    return 0 if node.GetImageData() is None else node.GetImageData().GetMTime()


def _age(path: str) -> int:
    try:
        return os.stat(path).st_mtime_ns if path else 0
    except OSError:
        return 0


def write_track(data: TrackData, folder: Path, cancel: CancelQuery | None = None) -> Path:
    """Write a request's files into a folder and return the path of TRACK.json; touches no node.

    One image at a time is written, as it is stored. Raises OSError when the disk is full or the folder cannot be
    written, and CancelledError once `cancel` returns True.
    """
    study = data.study
    needed = 2 * study.ct.values.nbytes + sum(each.series.bytes for each in data.cameras)
    labels = write_bones(study, folder, needed)
    entries = []
    for number, camera in enumerate(data.cameras):
        images = _write_series(camera.series, folder / f"camera_{number}", cancel or _never)
        entries.append(with_spacing({**camera.entry, "images": images}, camera.series.spacing))
    fields = {
        **data.fields,
        "ct": "ct.nrrd",
        "segmentation": "labels.nrrd",
        "structures": numbers_left(study, labels),
        "cameras": entries,
    }
    found = {each.entry["name"]: each.found for each in data.cameras if each.found is not None}
    if found:
        _write_cameras(found, folder / _CAMERAS)
        fields["cameras_from"] = _CAMERAS
    path = folder / TRACK_FILE
    path.write_text(json.dumps(fields, indent=1), encoding="utf-8")
    return path


def _write_series(series: XraySeries, folder: Path, cancel: CancelQuery) -> str:
    """Put a camera's images where the child reads them, and say where: a file as it is, or a folder of them."""
    if series.file:
        return series.file
    if series.files:
        _numbered(gather(series.files, folder))
        return folder.name
    folder.mkdir()
    for number, image in enumerate(series.images):
        if cancel():
            raise CancelledError(_("The tracking was cancelled."))
        write_pixels(np.ascontiguousarray(image), series.spacing, folder / f"{number:06d}.nrrd")
    return folder.name


def _numbered(folder: Path) -> None:
    """Give DICOM files that their own numbers would put into another order than their names new numbers."""
    import pydicom

    paths = sorted(folder.iterdir())
    numbers = [_instance_number(path) for path in paths]
    if (
        None in numbers
        or len(set(numbers)) < len(numbers)
        or numbers == sorted(numbers, key=lambda n: n or 0)
    ):
        return
    for number, path in enumerate(paths, start=1):
        dataset = pydicom.dcmread(path)
        dataset.InstanceNumber = number
        path.unlink()  # perhaps a link to the file in the database
        dataset.save_as(path)


def _instance_number(path: Path) -> int | None:
    import pydicom

    try:
        return int(pydicom.dcmread(path, specific_tags=["InstanceNumber"]).InstanceNumber)
    except Exception:  # the child says what is wrong with it
        return None


def _write_cameras(found: Mapping[str, Camera], path: Path) -> None:
    """Write cameras of a registration as its result.json has them."""
    from PolyPoseLib.data.result import CameraResult
    from PolyPoseLib.io.json_records import json_text
    from PolyPoseLib.io.result_records import camera_fields
    from PolyPoseLib.io.results import VERSION

    cameras = [camera_fields(CameraResult(camera, float("nan"), name)) for name, camera in found.items()]
    path.write_text(json_text({"version": VERSION, "cameras": cameras}), encoding="utf-8")


def _never() -> bool:
    return False
