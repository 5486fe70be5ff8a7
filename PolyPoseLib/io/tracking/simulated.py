"""A simulated sequence as a folder: TRACK.json with the files it names, and the truth beside them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.progress import Progress, ProgressCallback
from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.data.tracking.sequence import TrackView
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.json_records import json_text
from PolyPoseLib.io.tracking.track_truths import TRUTH_FILE, save_track_truth
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom
from PolyPoseLib.simulation.case_study import pixel_spacing
from PolyPoseLib.simulation.sequence_truth import truth_of_sequence
from PolyPoseLib.simulation.sequences import SimulatedSequence
from PolyPoseLib.simulation.simulation_limits import MOST_PIXELS

TRACK_FILE = "TRACK.json"

FORMATS = ("dicom", "tiff")
"""One multi-frame XA file for every camera, or a folder of pictures of line integrals."""

STORED_BITS = 16
"""Of DICOM's pixels: all frames share one scale, so that it must be finer than the detector's."""


def write_sequence(
    sequence: SimulatedSequence,
    folder: str | Path,
    image_format: str = "dicom",
    source_to_detector_mm: float = 1020.0,
    landmarks: Mapping[str, np.ndarray] | None = None,
    progress: ProgressCallback | None = None,
    joints: Sequence[Joint] = (),
) -> Path:
    """Write a sequence that can be tracked, and its truth.

    Parameters
    ----------
    sequence : SimulatedSequence
        What to write; its images are made one by one.
    folder : path
        Exists, and is empty.
    image_format : {"dicom", "tiff"}
        Of the images.
    source_to_detector_mm : float
        Splits focal lengths into distance and pixel pitch.
    landmarks : mapping of str to (3,) array, optional
        Points of the CT that name the axes of joints.
    progress : callable, optional
        Called after every image.
    joints : sequence of Joint
        Whose motion a tracking reports.

    Returns
    -------
    Path
        Of TRACK.json; truth.json lies beside it.

    Raises
    ------
    InputError
        Another format, or more images than one DICOM file is made of here.

    """
    if image_format not in FORMATS:
        raise InputError(unknown_name("format", image_format, FORMATS))
    folder = Path(folder)
    require_writable(sequence, image_format)
    write_volume(sequence.ct.with_voxels(np.rint(sequence.ct.voxels).astype(np.int16)), folder / "ct.nii.gz")
    write_volume(Volume(sequence.structures.labels, sequence.ct.affine), folder / "labels.nii.gz")
    steps = _Steps(sum(view.images.count for view in sequence.views), progress)
    cameras = [
        _write_view(sequence, view, f"view_{number}", folder, (image_format, source_to_detector_mm, steps))
        for number, view in enumerate(sequence.views, start=1)
    ]
    fields: dict[str, Any] = {
        "version": 1,
        "comment": "Simulated, not a patient's.",
        "ct": "ct.nii.gz",
        "segmentation": "labels.nii.gz",
        "structures": {name: [n] for n, name in enumerate(sequence.structures.names, start=1)},
        "reference": sequence.reference,
        "frames_per_second": sequence.frames_per_second,
        "cameras": cameras,
        "initial_poses": sequence.initial_poses,
    }
    if landmarks:
        fields["landmarks"] = landmarks
    if joints:
        fields["joints"] = [asdict(joint) for joint in joints]
    path = folder / TRACK_FILE
    path.write_text(json_text(fields), encoding="utf-8")
    save_track_truth(truth_of_sequence(sequence), folder / TRUTH_FILE)
    return path


def require_writable(sequence: SimulatedSequence, image_format: str) -> None:
    """Raise InputError where the images of a camera are too many for one DICOM file."""
    for view in sequence.views:
        pixels = view.images.count * view.camera.height * view.camera.width
        if image_format == "dicom" and pixels > MOST_PIXELS:
            raise InputError(
                f"{view.name} has {view.images.count} images, more than {MOST_PIXELS // 10**6} million pixels, too "
                'many for one DICOM file: give fewer frames, smaller images, or the format "tiff".'
            )


def bytes_of(sequence: SimulatedSequence) -> float:
    """About how many bytes a sequence takes on the disk."""
    pixels = sum(view.images.count * view.camera.height * view.camera.width for view in sequence.views)
    return 1.25 * sequence.ct.voxels.size + 4 * pixels


class _Steps:
    """Counts images that are written."""

    def __init__(self, total: int, progress: ProgressCallback | None) -> None:
        self._total, self._progress = total, progress
        self._start, self._done = time.perf_counter(), 0

    def step(self) -> None:
        """One more."""
        self._done += 1
        if self._progress is not None:
            elapsed = time.perf_counter() - self._start
            self._progress(Progress("simulating", self._done, self._total, None, elapsed))


def _write_view(
    sequence: SimulatedSequence, view: TrackView, stem: str, folder: Path, how: tuple[str, float, _Steps]
) -> dict[str, Any]:
    """Write the images of one camera and return its entry."""
    image_format, distance, steps = how
    camera = view.camera
    spacing = pixel_spacing(camera, distance)
    entry: dict[str, Any] = {
        "name": view.name,
        "images": f"{stem}.dcm" if image_format == "dicom" else stem,
        "first": view.first,
        "extrinsic": camera.extrinsic,
        "source_to_detector_mm": distance,
        "pixel_spacing_mm": spacing,
    }
    if not np.allclose(
        camera.intrinsics[:2, 2], [(camera.width - 1) / 2, (camera.height - 1) / 2], atol=1e-6
    ):
        entry["principal_point_px"] = camera.intrinsics[:2, 2]
    if image_format == "dicom":
        _write_run(sequence, view, folder / f"{stem}.dcm", (distance, spacing), steps)
        return entry
    (folder / stem).mkdir()
    for index in range(view.images.count):
        _write_picture(view.images.read(index)[0], folder / stem / f"frame_{index:06d}.tif")
        steps.step()
    return entry | {"intensity": "line_integral"}


def _write_run(
    sequence: SimulatedSequence,
    view: TrackView,
    path: Path,
    geometry: tuple[float, tuple[float, float]],
    steps: _Steps,
) -> None:
    """Write all images of a camera as one XA file."""
    lines = np.empty((view.images.count, view.camera.height, view.camera.width), np.float32)
    for index in range(len(lines)):
        lines[index] = view.images.read(index)[0]
        steps.step()
    write_xray_dicom(
        path,
        lines,
        Stand(source_to_detector_mm=geometry[0], pixel_spacing_mm=geometry[1]),
        Storage(bits=STORED_BITS, encoding="log", saturation=sequence.options.physics.saturation),
        description=view.name,
        study=f"simulated sequence {sequence.seed}",
        frame_ms=1000 / sequence.frames_per_second,
    )


def _write_picture(image: np.ndarray, path: Path) -> None:
    """Write line integrals (H, W) as a picture of real numbers."""
    import SimpleITK as sitk

    from PolyPoseLib.io.images import write_image

    write_image(sitk.GetImageFromArray(np.asarray(image, dtype=np.float32)), path)
