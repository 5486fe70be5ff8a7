"""Read one X-ray with its camera, from DICOM or from a plain picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import dicom as xray_dicom
from PolyPoseLib.io.xray import plain as xray_plain
from PolyPoseLib.io.xray import values as xray_values
from PolyPoseLib.io.xray.calibration import Calibrated, undistorted, with_calibration
from PolyPoseLib.io.xray.detector import Detector, detector_of
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.pose import Pose, pose_of, stored_handedness


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

    Args:
        path: the image's file.
        fields: the X-ray's entry in the study file (see XrayFields); what it gives wins over DICOM.
        frame: image of a run or stack, counted from 0; wins over the field "frame".
        isocenter: (3,) LPS mm, the point of the patient that a guess from DICOM puts at the isocentre.
        folder: where a relative "mask" starts and must stay; the study's folder, by default derived from
            the field "image", or else the image's folder.
        entry_name: what sentences call the study file.

    Returns:
        The X-ray as seen from the source: a file that shows the detector's side (as C-arms display) has its
        columns reversed, and `mirrored` says so.

    Raises:
        InputError: one sentence that names the file, what is wrong and the mend.

    """
    path = Path(path)
    notes = Notes(path.name, entry_name)
    given = XrayFields.parse(fields or {}, path.name)
    frame = given.frame if frame is None else frame
    if not path.is_file():
        raise InputError(f"{path} is not a file; give the path of one X-ray image.")
    folder = Path(folder) if folder else xray_values.study_folder(path, fields or {})
    calibrated = with_calibration(given, folder, notes)
    given = calibrated.fields
    tags = None
    if xray_plain.ending_of(path):
        pixels = xray_values.values_of_plain(path, frame, given, notes)
    else:
        tags, pixels = _read_dicom(path, frame, given, notes)
    mask = pixels.mask
    calibrated.require_size(mask.shape, notes)
    if given.mask is not None:
        mask = mask & xray_values.read_mask(given.mask, folder, mask.shape, notes)
        if not mask.any():
            raise InputError(f'{notes.where}: the "mask" and the shutter leave no pixels; correct the mask.')
    detector = detector_of(tags, given, mask.shape, notes)
    image = pixels.line_integrals(mask, notes)
    if calibrated.distortion:
        image, mask = undistorted(image, mask, detector.intrinsics, calibrated.distortion)
    pose, mirrored = _pose(tags, given, detector, isocenter, notes)
    return _assemble(image, mask, detector, calibrated, pose, mirrored, path, notes)


def _read_dicom(
    path: Path, frame: int | None, given: XrayFields, notes: Notes
) -> tuple[xray_dicom.XrayTags, xray_values.PixelValues]:
    """Attributes and pixel values of a DICOM frame; whatever a damaged file breaks becomes one sentence."""
    dataset = xray_dicom.open_dicom(path, notes.where)
    try:
        tags = xray_dicom.XrayTags(dataset, xray_dicom.choose_frame(dataset, frame, notes))
        shape = (dataset.Rows, dataset.Columns)
        xray_values.refuse_small(shape, notes)
        detector_of(tags, given, shape, Notes(notes.where, notes.entry))
        return tags, xray_values.values_of_dicom(tags, given, notes)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"{notes.where} is damaged: its DICOM attributes contradict each other; copy the file again."
        ) from error


def _pose(
    tags, given: XrayFields, detector: Detector, isocenter: Sequence[float] | None, notes: Notes
) -> tuple[Pose | None, bool]:
    """Guess of the camera when none is given, and whether the stored image is a mirror image of the view."""
    if given.extrinsic is None:
        if given.camera == "known":
            notes.warn('"camera" is "known" but there is no extrinsic, so the camera is looked for.')
        point = None if isocenter is None else tuple(float(part) for part in isocenter)
        look = given.camera != "absent"
        pose = pose_of(tags, given, detector.source_to_detector_mm, point, notes) if look else None
        if pose is None:
            notes.say(
                "extrinsic: absent, nothing in the file tells the direction" if look else "extrinsic: absent"
            )
        mirrored = bool(given.mirrored) if pose is None else pose.mirrored
        if mirrored and given.mirrored is None:
            notes.warn(
                "the file shows the patient from the detector's side, so its columns are reversed to the view from "
                'the source; if it does not, add "mirrored": false.'
            )
        return pose, mirrored
    notes.say(f"extrinsic from {notes.entry}")
    if given.mirrored is not None:
        return None, given.mirrored
    mirrored = stored_handedness(tags, given.extrinsic[2, :3]) < 0
    if mirrored:
        notes.warn(
            "Patient Orientation (0020,0020) says that the file is a mirror image of the view from the extrinsic's "
            'source, so its columns are reversed; if it is not, add "mirrored": false.'
        )
    return None, mirrored


def _assemble(
    image,
    mask,
    detector: Detector,
    calibrated: Calibrated,
    pose: Pose | None,
    mirrored: bool,
    path: Path,
    notes: Notes,
) -> Xray:
    """Put the parts together, in the arrangement that the source sees."""
    given = calibrated.fields
    if mirrored and calibrated.rig is not None and given.calibration is not None:
        raise InputError(
            f"{notes.where}: the file shows the detector's side, but a calibrated rig needs the source's: turn "
            'the image round and give "mirrored": false, or remove "rig".'
        )
    intrinsics = detector.intrinsics.copy()
    if mirrored:
        image, mask = image[:, ::-1], mask[:, ::-1]
        intrinsics[0, 2] = image.shape[1] - 1 - intrinsics[0, 2]
        intrinsics[0, 1] *= -1
        notes.say("columns reversed: K, mask and extrinsic belong to the view from the source")
    camera, extrinsic = "absent", None
    if given.extrinsic is not None:
        camera, extrinsic = "known" if given.camera == "known" else "initial", given.extrinsic
    elif pose is not None:
        camera, extrinsic = "initial", pose.extrinsic
    return Xray(
        image=image,
        mask=mask,
        intrinsics=intrinsics,
        extrinsic=extrinsic,
        camera=camera,
        pixel_spacing_mm=detector.pixel_spacing_mm,
        source_to_detector_mm=detector.source_to_detector_mm,
        name=given.name or path.name.split(".")[0],
        provenance=tuple(notes.provenance),
        warnings=tuple(notes.warnings),
        initial_radius=pose.radius if pose else None,
        mirrored=mirrored,
        isocenter=pose.isocenter if pose else None,
        table_mm=pose.table_mm if pose else None,
        standard_view=given.standard_view,
        landmarks=given.landmarks.mirrored(image.shape[1])
        if given.landmarks and mirrored
        else given.landmarks,
        rig=calibrated.rig,
    )
