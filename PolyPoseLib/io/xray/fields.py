"""The entry of one X-ray in study.json, validated: an XrayFields that exists is valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.landmarks import FARTHEST, Landmarks, parse_landmarks
from PolyPoseLib.data.xray import CAMERA_STATES, DISTANCE_RANGE_MM
from PolyPoseLib.errors import InputError, shown
from PolyPoseLib.geometry.camera import require_intrinsics
from PolyPoseLib.geometry.carm import PATIENT_POSITIONS
from PolyPoseLib.geometry.rigid import is_real_number, require_rigid
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS
from PolyPoseLib.io.xray.intensity import INTENSITIES

CALIBRATION_FRAMES = ("own", "ct")

SPACING_RANGE_MM = (0.005, 10.0)


@dataclass(frozen=True)
class XrayFields:
    """What study.json says about one X-ray; None where it says nothing.

    Attributes:
        name: shown to people.
        source_to_detector_mm: distance from the source to the detector's plane.
        pixel_spacing_mm: at the detector, (between rows, between columns), DICOM's order.
        principal_point_px: (column, row) in the file's own pixels, centres at whole numbers.
        intrinsics: K (3, 3) in the file's own pixels; takes the place of distance, spacing and principal
            point.
        extrinsic: (4, 4) world LPS mm to camera, for the image as seen from the source.
        camera: "known", "initial" or "absent".
        frame: image of a run or stack, counted from 0.
        mask: path of an image whose pixels that are not zero are used; a Path is taken as it is.
        intensity: one of INTENSITIES.
        unattenuated: pixel value of the direct beam (I0).
        mirrored: whether the file shows the detector's side; None leaves it to DICOM.
        isocenter_mm: (3,) LPS, the point of the patient at the isocentre.
        source_to_isocenter_mm: distance from the source to the isocentre.
        primary_angle_deg: positive toward LAO.
        secondary_angle_deg: positive toward CRA.
        patient_position: "HFS" and so on, how the patient lay under a stand with these angles.
        standard_view: one of STANDARD_VIEWS, around which the camera is searched.
        landmarks: points in the CT and in the file's own pixels, from which the camera is computed.
        calibration: path of a calibrated camera (imaging.calibration); a Path is taken as it is.
        calibration_frame: "ct" when its rotation and translation start from the CT's LPS mm, "own" (the default)
            when they start from the calibration's world.
        rig: name of the calibrated rig (a biplane stand, say) that took it; the cameras of one rig keep their relative
            pose, which their calibrations tell, or else their extrinsics; all of them in the same world.

    """

    name: str | None = None
    source_to_detector_mm: float | None = None
    pixel_spacing_mm: tuple[float, float] | None = None
    principal_point_px: tuple[float, float] | None = None
    intrinsics: np.ndarray | None = None
    extrinsic: np.ndarray | None = None
    camera: str | None = None
    frame: int | None = None
    mask: str | Path | None = None
    intensity: str | None = None
    unattenuated: float | None = None
    mirrored: bool | None = None
    isocenter_mm: tuple[float, float, float] | None = None
    source_to_isocenter_mm: float | None = None
    primary_angle_deg: float | None = None
    secondary_angle_deg: float | None = None
    patient_position: str | None = None
    standard_view: str | None = None
    landmarks: Landmarks | None = None
    calibration: str | Path | None = None
    calibration_frame: str | None = None
    rig: str | None = None

    @staticmethod
    def parse(entry: Mapping[str, Any], where: str) -> XrayFields:
        """Validate an entry; fields that are null count as absent and fields of others are left alone.

        Args:
            entry: the JSON object.
            where: opening of the sentences of errors.

        Raises:
            InputError: a field that breaks its rule, named with the rule.

        """
        reader = _Reader(entry, where)
        extrinsic = reader.get("extrinsic")
        return XrayFields(
            name=reader.text("name"),
            source_to_detector_mm=reader.number("source_to_detector_mm", DISTANCE_RANGE_MM, "millimetres"),
            pixel_spacing_mm=reader.pixel_spacing(),
            principal_point_px=reader.numbers("principal_point_px", 2, "[column, row] in pixels", FARTHEST),
            extrinsic=None if extrinsic is None else require_rigid(extrinsic, f'{where}: "extrinsic"'),
            camera=reader.choice("camera", CAMERA_STATES),
            intrinsics=reader.intrinsics(),
            frame=reader.frame(),
            mask=reader.path("mask"),
            intensity=reader.intensity(),
            unattenuated=reader.number("unattenuated", (1e-12, 1e12), "a pixel value"),
            mirrored=reader.flag("mirrored"),
            isocenter_mm=reader.numbers("isocenter_mm", 3, "[x, y, z], LPS millimetres", FARTHEST),
            source_to_isocenter_mm=reader.number("source_to_isocenter_mm", DISTANCE_RANGE_MM, "millimetres"),
            primary_angle_deg=reader.number("primary_angle_deg", (-180, 180), "degrees, LAO positive"),
            secondary_angle_deg=reader.number("secondary_angle_deg", (-90, 90), "degrees, CRA positive"),
            patient_position=reader.choice("patient_position", PATIENT_POSITIONS),
            standard_view=reader.choice("standard_view", tuple(STANDARD_VIEWS)),
            landmarks=parse_landmarks(reader.get("landmarks"), where),
            calibration=reader.path("calibration"),
            calibration_frame=reader.choice("calibration_frame", CALIBRATION_FRAMES),
            rig=reader.label("rig"),
        )


FIELDS = (*XrayFields.__dataclass_fields__, "image", "polarity")
"""Every key that an X-ray's entry may have as far as reading the image is concerned."""


class _Reader:
    """Reads typed values from a JSON object."""

    def __init__(self, entry: Mapping[str, Any], where: str) -> None:
        if not isinstance(entry, Mapping):
            raise InputError(f'{where}: its entry is not an object; write {{"image": "..."}}.')
        self.entry = entry
        self.where = where

    def get(self, key: str) -> Any:
        return self.entry.get(key)

    def fail(self, key: str, rule: str) -> InputError:
        return InputError(f'{self.where}: "{key}" is {shown(self.get(key))}; give {rule}.')

    def label(self, key: str) -> str | None:
        value = self.text(key)
        if value is not None and not value.strip():
            raise self.fail(key, "a name that is not empty")
        return value

    def text(self, key: str) -> str | None:
        value = self.get(key)
        if value is not None and not isinstance(value, str):
            raise self.fail(key, "a text")
        return value

    def path(self, key: str) -> str | Path | None:
        value = self.get(key)
        if value is not None and not (isinstance(value, str | Path) and str(value).strip()):
            raise self.fail(key, "the path of a file")
        return value

    def choice(self, key: str, choices: Sequence[str]) -> str | None:
        value = self.get(key)
        if value is not None and value not in choices:
            raise self.fail(key, "one of " + ", ".join(f'"{choice}"' for choice in choices))
        return value

    def flag(self, key: str) -> bool | None:
        value = self.get(key)
        if value is not None and not isinstance(value, bool):
            raise self.fail(key, "true or false")
        return value

    def number(self, key: str, bounds: tuple[float, float], unit: str) -> float | None:
        value = self.get(key)
        if value is None:
            return None
        if not is_real_number(value) or not bounds[0] <= value <= bounds[1]:
            raise self.fail(key, f"a number from {bounds[0]:g} to {bounds[1]:g} ({unit})")
        return float(value)

    def numbers(
        self, key: str, count: int, meaning: str, largest: float | None = None
    ) -> tuple[float, ...] | None:
        value = self.get(key)
        if value is None:
            return None
        items = list(value) if isinstance(value, list | tuple | np.ndarray) else []
        if len(items) != count or not all(map(is_real_number, items)):
            raise self.fail(key, f"{count} finite numbers: {meaning}")
        if largest is not None and max(abs(item) for item in items) > largest:
            raise self.fail(key, f"{count} numbers from {-largest:g} to {largest:g}: {meaning}")
        return tuple(float(item) for item in items)

    def pixel_spacing(self) -> tuple[float, float] | None:
        key = "pixel_spacing_mm"
        value = self.get(key)
        spacing = (
            (float(value),) * 2
            if is_real_number(value)
            else self.numbers(key, 2, "[between rows, between columns], millimetres at the detector")
        )
        low, high = SPACING_RANGE_MM
        if spacing is not None and not all(low <= item <= high for item in spacing):
            raise self.fail(
                key, f"[between rows, between columns] from {low:g} to {high:g} millimetres at the detector"
            )
        return spacing

    def intrinsics(self) -> np.ndarray | None:
        value = self.get("intrinsics")
        if value is None:
            return None
        return require_intrinsics(value, f'{self.where}: "intrinsics"')

    def frame(self) -> int | None:
        value = self.get("frame")
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
            raise self.fail("frame", "a whole number, counted from 0")
        return value

    def intensity(self) -> str | None:
        intensity, polarity = self.choice("intensity", INTENSITIES), self.choice("polarity", INTENSITIES)
        if None not in (intensity, polarity) and intensity != polarity:
            raise InputError(
                f'{self.where}: "intensity" is "{intensity}" and "polarity" is "{polarity}"; '
                "they mean the same, give one."
            )
        return intensity or polarity
