"""X-rays of balls by the formula for a chord, through cameras on a circle: no projector's code is used."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera, look_at

SOURCE_MM = 700.0
DETECTOR_MM = 1000.0


def orbit(
    count, arc_deg, turned=(0.0, 0.0, 0.0), pixels=(72, 80), pitch_mm=(4.0, 4.0), rolls=(0.0,), centre=None
):
    """Cameras around the origin; the whole orbit is turned, and every detector rolled and off its principal point."""
    height, width = pixels
    whole = Rotation.from_rotvec(turned, degrees=True).as_matrix()
    column, row = ((width - 1) / 2, (height - 1) / 2) if centre is None else centre
    cameras = []
    for number, angle in enumerate(np.radians(np.arange(count) * arc_deg / count)):
        source = whole @ [SOURCE_MM * np.sin(angle), -SOURCE_MM * np.cos(angle), 0.0]
        extrinsic = look_at(source, np.zeros(3), up=whole @ [0.0, 0.0, 1.0])
        roll = np.eye(4)
        roll[:3, :3] = Rotation.from_rotvec([0, 0, rolls[number % len(rolls)]], degrees=True).as_matrix()
        intrinsics = [
            [DETECTOR_MM / pitch_mm[1], 0, column],
            [0, DETECTOR_MM / pitch_mm[0], row],
            [0, 0, 1],
        ]
        cameras.append(Camera(np.array(intrinsics), roll @ extrinsic, height, width))
    return cameras


def xray_of_balls(camera, balls, name="view", mask=None):
    """Line integrals of balls (centre, radius_mm, attenuation per mm)."""
    directions = camera.pixel_directions()
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    image = np.zeros(directions.shape[:2])
    for centre, radius, attenuation in balls:
        to_centre = np.asarray(centre) - camera.source
        along = directions @ to_centre
        squared = radius**2 - (to_centre @ to_centre - along**2)
        image += 2 * np.sqrt(np.maximum(squared, 0)) * attenuation
    return xray(camera, image, name, mask)


def xray(camera, image, name="view", mask=None):
    """An X-ray whose camera is known."""
    focal = camera.intrinsics[[1, 0], [1, 0]]
    return Xray(
        image.astype(np.float32),
        np.ones(image.shape, bool) if mask is None else mask,
        camera.intrinsics,
        camera.extrinsic,
        "known",
        tuple(DETECTOR_MM / focal),
        DETECTOR_MM,
        name=name,
    )
