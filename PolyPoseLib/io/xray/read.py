"""Read one X-ray with its camera, from DICOM or from a plain picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.data.notes import Notes
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.geometry.distortion import undistorted
from PolyPoseLib.io.dicom import open_dicom, quiet_pydicom
from PolyPoseLib.io.xray.calibrated import Calibrated, with_calibration
from PolyPoseLib.io.xray.detector import Detector, detector_of
from PolyPoseLib.io.xray.distorted import maybe_distorted
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.folder import study_folder
from PolyPoseLib.io.xray.given_mask import read_mask
from PolyPoseLib.io.xray.patient_orientation import stored_handedness
from PolyPoseLib.io.xray.plain import ending_of
from PolyPoseLib.io.xray.pose import Pose, pose_of
from PolyPoseLib.io.xray.tags import XrayTags, choose_frame
from PolyPoseLib.io.xray.values import PixelValues, refuse_small, values_of_dicom, values_of_plain


def read_xray(
    path: str | Path,
    *,
    fields: Mapping[str, Any] | None = None,
    frame: int | None = None,
    isocenter: Sequence[float] | None = None,
    folder: str | Path | None = None,
    entry_name: str = "study.json",
) -> Xray:
    """Read one X-ray: DICOM (XA, RF, CR, DX, MG, RT image, Enhanced XA), NIfTI, NRRD, MetaImage, PNG or TIFF.

    Parameters
    ----------
    path
        The image's file.
    fields
        The X-ray's entry in the study file (see `PolyPoseLib.io.xray.fields.XrayFields`); what it gives wins over
        DICOM.
    frame
        Image of a run or stack, counted from 0; wins over the field "frame".
    isocenter
        (3,) LPS mm, the point of the patient that an initial camera from DICOM puts at the isocentre.
    folder
        Where a relative "mask" starts and must stay; the study's folder, by default derived from the field "image",
        or else the image's folder.
    entry_name
        What sentences call the study file.

    Returns
    -------
    Xray
        The X-ray as seen from the source: a file that shows the detector's side (as C-arms display) has its columns
        reversed, and `mirrored` says so.

    Raises
    ------
    InputError
        One sentence that names the file, what is wrong and how to fix it.

    """
    path = Path(path)
    notes = Notes(path.name, entry_name)
    given = XrayFields.parse(fields or {}, path.name)
    if not path.is_file():
        raise InputError(f"{path} is not a file; give the path of one X-ray image.")
    folder = Path(folder) if folder else study_folder(path, fields or {})
    calibrated = with_calibration(given, folder, notes)
    given = calibrated.fields
    tags, pixels = _pixels(path, given.frame if frame is None else frame, given, notes)
    calibrated.require_size(pixels.shape, notes)
    stored, detector = _stored_picture(tags, pixels, calibrated, folder, notes)
    camera = _camera(tags, given, detector, isocenter, notes)
    _refuse_mirrored_rig(camera, calibrated, notes)
    distorted = maybe_distorted(tags, pixels.mask, calibrated, notes)
    picture = stored.reversed(notes) if camera.mirrored else stored
    return Xray(
        image=picture.image,
        mask=picture.mask,
        intrinsics=picture.intrinsics,
        extrinsic=camera.extrinsic,
        camera=camera.state,
        pixel_spacing_mm=detector.pixel_spacing_mm,
        source_to_detector_mm=detector.source_to_detector_mm,
        name=given.name or "",
        provenance=tuple(notes.provenance),
        warnings=tuple(notes.warnings),
        initial_radius=camera.pose.radius if camera.pose else None,
        mirrored=camera.mirrored,
        isocenter=camera.pose.isocenter if camera.pose else None,
        table_mm=camera.pose.table_mm if camera.pose else None,
        standard_view=given.standard_view,
        landmarks=picture.landmarks,
        rig=calibrated.rig,
        maybe_distorted=distorted,
    )


@dataclass(frozen=True, eq=False)
class _Picture:
    """What belongs to the arrangement of the pixels: (H, W) line integrals and mask, K, and picked points."""

    image: np.ndarray
    mask: np.ndarray
    intrinsics: np.ndarray
    landmarks: Landmarks | None

    def reversed(self, notes: Notes) -> _Picture:
        """The same with the columns in reverse order: the view from the source of a file from the detector's side."""
        width = self.image.shape[1]
        intrinsics = self.intrinsics.copy()
        intrinsics[0, 2] = width - 1 - intrinsics[0, 2]
        intrinsics[0, 1] *= -1
        notes.say("columns reversed: K, mask and extrinsic belong to the view from the source")
        landmarks = self.landmarks.mirrored(width) if self.landmarks else None
        return _Picture(self.image[:, ::-1], self.mask[:, ::-1], intrinsics, landmarks)


@dataclass(frozen=True, eq=False)
class _Camera:
    """The camera of the view from the source, and whether the file shows its mirror image.

    extrinsic: (4, 4) or None; state: "known", "initial" or "absent"; pose: where the extrinsic comes from angles.
    """

    extrinsic: np.ndarray | None
    state: str
    mirrored: bool
    pose: Pose | None = None


def _pixels(
    path: Path, frame: int | None, given: XrayFields, notes: Notes
) -> tuple[XrayTags | None, PixelValues]:
    """Pixel values of a file, with its attributes where it is DICOM."""
    if ending_of(path):
        return None, values_of_plain(path, frame, given, notes)
    return _read_dicom(path, frame, given, notes)


def _read_dicom(
    path: Path, frame: int | None, given: XrayFields, notes: Notes
) -> tuple[XrayTags, PixelValues]:
    """Attributes and pixel values of a DICOM frame; whatever a damaged file breaks becomes one sentence."""
    dataset = open_dicom(path, notes.where)
    try:
        with quiet_pydicom():
            tags = XrayTags(dataset, choose_frame(dataset, frame, notes))
            shape = (dataset.Rows, dataset.Columns)
            refuse_small(shape, notes)
            detector_of(tags, given, shape, Notes(notes.where, notes.entry))
            return tags, values_of_dicom(tags, given, notes)
    except InputError:
        raise
    except MemoryError as error:
        raise memory_ran_out(notes.where) from error
    except Exception as error:
        raise InputError(
            f"{notes.where} is damaged: its DICOM attributes contradict each other; copy the file again."
        ) from error


def _stored_picture(
    tags: XrayTags | None, pixels: PixelValues, calibrated: Calibrated, folder: Path, notes: Notes
) -> tuple[_Picture, Detector]:
    """Line integrals in the file's arrangement, masked and free of distortion, and the detector they lie on."""
    given, mask = calibrated.fields, pixels.mask
    if given.mask is not None:
        mask = mask & read_mask(given.mask, folder, pixels.shape, notes)
        if not mask.any():
            raise InputError(f'{notes.where}: the "mask" and the shutter leave no pixels; correct the mask.')
    detector = detector_of(tags, given, pixels.shape, notes)
    image = pixels.line_integrals(mask, notes)
    if calibrated.distortion:
        image, mask = undistorted(image, mask, detector.intrinsics, calibrated.distortion)
    return _Picture(image, mask, detector.intrinsics, given.landmarks), detector


def _camera(
    tags: XrayTags | None,
    given: XrayFields,
    detector: Detector,
    isocenter: Sequence[float] | None,
    notes: Notes,
) -> _Camera:
    """The camera that the study file gives, or else one from DICOM."""
    if given.extrinsic is None:
        return _found_camera(tags, given, detector, isocenter, notes)
    notes.say(f"extrinsic from {notes.entry}")
    state = "known" if given.camera == "known" else "initial"
    mirrored = given.mirrored
    if mirrored is None:
        mirrored = stored_handedness(tags, given.extrinsic[2, :3]) < 0
        if mirrored:
            notes.warn(
                "Patient Orientation (0020,0020) says that the file is a mirror image of the view from the "
                'extrinsic\'s source, so its columns are reversed; if it is not, add "mirrored": false.'
            )
    return _Camera(given.extrinsic, state, mirrored)


def _found_camera(
    tags: XrayTags | None,
    given: XrayFields,
    detector: Detector,
    isocenter: Sequence[float] | None,
    notes: Notes,
) -> _Camera:
    """An initial camera from angles, or none."""
    if given.camera == "known":
        notes.warn('"camera" is "known" but there is no extrinsic, so the camera is searched for.')
    pose = None
    if given.camera == "absent":
        notes.say("extrinsic: absent")
    else:
        pose = pose_of(tags, given, detector.source_to_detector_mm, isocenter, notes)
        if pose is None:
            notes.say("extrinsic: absent, nothing in the file gives the direction")
    if pose is None:
        return _Camera(None, "absent", bool(given.mirrored))
    if pose.mirrored and given.mirrored is None:
        notes.warn(
            "the file shows the patient from the detector's side, so its columns are reversed to the view from "
            'the source; if it does not, add "mirrored": false.'
        )
    return _Camera(pose.extrinsic, "initial", pose.mirrored, pose)


def _refuse_mirrored_rig(camera: _Camera, calibrated: Calibrated, notes: Notes) -> None:
    """Refuse a calibrated rig whose file shows the detector's side; raises InputError."""
    rigged = calibrated.rig is not None and calibrated.fields.calibration is not None
    if camera.mirrored and rigged and not calibrated.source_side:
        raise InputError(
            f"{notes.where}: the file shows the detector's side, but a calibrated rig needs the source's: turn "
            'the image round and give "mirrored": false, or remove "rig".'
        )
