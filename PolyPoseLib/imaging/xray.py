"""One X-ray read from a file: line integrals, a mask, K, an initial camera, and where every number came
from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import require_intrinsics, require_rigid
from PolyPoseLib.geometry.carm import with_isocenter
from PolyPoseLib.imaging import xray_dicom, xray_plain, xray_values
from PolyPoseLib.imaging.calibration import undistorted
from PolyPoseLib.imaging.landmarks import Landmarks
from PolyPoseLib.imaging.xray_calibration import Calibrated, RigPose, with_calibration
from PolyPoseLib.imaging.xray_fields import CAMERA_STATES, FIELDS, XrayFields
from PolyPoseLib.imaging.xray_geometry import Detector, detector_of
from PolyPoseLib.imaging.xray_notes import Notes
from PolyPoseLib.imaging.xray_pose import Pose, pose_of, stored_handedness

__all__ = ["FIELDS", "Xray", "place_isocenter", "read_xray"]


@dataclass(frozen=True, eq=False)
class Xray:
    """One X-ray; an Xray that exists is valid.

    Attributes:
        image: (H, W) float32 line integrals, unitless: larger behind bone. As seen from the source.
        mask: (H, W) bool, True where the image may be used.
        intrinsics: K (3, 3) in pixels of `image`, centres at whole numbers.
        extrinsic: (4, 4) world LPS mm to camera, None when absent.
        camera: "known", "initial" (a guess to refine) or "absent".
        pixel_spacing_mm: at the detector, (between rows, between columns).
        source_to_detector_mm: distance from the source to the detector.
        name: shown to people.
        provenance: where every number came from, one line each.
        warnings: what looks doubtful, one line each.
        initial_radius: (degrees, mm) within which the truth is expected around a guess, None when unknown.
        mirrored: whether `image` is the file's image with its columns in reverse order.
        isocenter: (3,) LPS mm, the point that a guess from DICOM puts at the isocentre; None for other
            extrinsics.
        table_mm: (3,) LPS mm, how far the table had carried the patient, from the file's own zero; or None.
        standard_view: one of geometry.standard_views.STANDARD_VIEWS, or None.
        landmarks: points with pixels of `image`, or None.
        rig: the camera's place in a rig whose cameras keep their relative pose, or None.

    Raises:
        InputError: from the constructor, when a shape or a rule is broken.

    """

    image: np.ndarray
    mask: np.ndarray
    intrinsics: np.ndarray
    extrinsic: np.ndarray | None
    camera: str
    pixel_spacing_mm: tuple[float, float]
    source_to_detector_mm: float
    name: str = ""
    provenance: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    initial_radius: tuple[float, float] | None = None
    mirrored: bool = False
    isocenter: tuple[float, float, float] | None = None
    table_mm: tuple[float, float, float] | None = None
    standard_view: str | None = None
    landmarks: Landmarks | None = None
    rig: RigPose | None = None

    def __post_init__(self) -> None:
        """Validate, and fix the types."""
        label = f'The X-ray "{self.name}"'
        image = np.ascontiguousarray(self.image, dtype=np.float32)
        mask = np.ascontiguousarray(self.mask, dtype=bool)
        if image.ndim != 2 or mask.shape != image.shape:
            raise InputError(f"{label} needs an image (H, W) and a mask of the same shape.")
        if not np.isfinite(image).all() or not mask.any():
            raise InputError(f"{label} needs finite pixels and a mask that leaves some of them.")
        if self.camera not in CAMERA_STATES or (self.camera == "absent") != (self.extrinsic is None):
            raise InputError(f'{label} has the camera "{self.camera}", which does not fit its extrinsic.')
        extrinsic = None if self.extrinsic is None else require_rigid(self.extrinsic, f"{label}: extrinsic")
        fixed = {
            "image": image,
            "mask": mask,
            "intrinsics": require_intrinsics(self.intrinsics),
            "extrinsic": extrinsic,
            "pixel_spacing_mm": tuple(float(part) for part in self.pixel_spacing_mm),
            "source_to_detector_mm": float(self.source_to_detector_mm),
            "provenance": tuple(self.provenance),
            "warnings": tuple(self.warnings),
        }
        for key, value in fixed.items():
            object.__setattr__(self, key, value)

    def placed_at(self, isocenter: ArrayLike) -> Xray:
        """Return the X-ray with a guess from angles moved so that this point (3,) LPS mm is at the isocentre.

        Other X-rays, and those whose isocentre was told, are returned as they are.
        """
        if self.isocenter is None or self.extrinsic is None or np.any(self.isocenter):
            return self
        point = tuple(float(part) for part in np.asarray(isocenter, dtype=np.float64))
        return replace(self, extrinsic=with_isocenter(self.extrinsic, self.isocenter, point), isocenter=point)


def place_isocenter(xrays: Sequence[Xray], isocenter: ArrayLike) -> tuple[Xray, ...]:
    """Place the guesses of several X-rays on one point of the patient, minding how the table moved between
    them.

    Args:
        xrays: of one patient and session.
        isocenter: (3,) LPS mm, the point at the isocentre in the first view whose guess comes from DICOM.

    Returns:
        The X-rays in their order; those whose camera is given or absent, or whose isocentre was told, are unchanged.

    """
    point = np.asarray(isocenter, dtype=np.float64)
    zero = next((np.array(xray.table_mm) for xray in xrays if xray.isocenter and xray.table_mm), None)
    placed = []
    for xray in xrays:
        moved = np.zeros(3) if zero is None or xray.table_mm is None else np.array(xray.table_mm) - zero
        placed.append(xray.placed_at(point - moved))
    return tuple(placed)


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
