"""A small case for the tests of the registration: a phantom pelvis whose femur and vertebrae moved."""

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.simulation.simulate import SimulatedCase, SimulationOptions, simulate_case, view_cameras

NAMES = ("pelvis", "femur_left", "vertebra_L5")
HEAD = np.array([45.0, 5.0, -20.0])


def phantom() -> tuple[Volume, Structures]:
    """A CT (HU) with three asymmetric bones in a body, 3 mm voxels, left-handed as common CTs are."""
    spacing, size = 3.0, np.array([64, 44, 72])
    affine = np.diag([spacing, -spacing, spacing, 1.0])
    affine[:3, 3] = -affine[:3, :3] @ ((size - 1) / 2)
    kji = np.stack(np.meshgrid(*map(np.arange, size[::-1]), indexing="ij"), -1)
    x = kji[..., ::-1] @ affine[:3, :3].T + affine[:3, 3]
    from_head = np.linalg.norm(x - HEAD, axis=-1)
    socket = (from_head > 22) & (from_head < 32) & (x[..., 2] > HEAD[2] + 2)
    wing = _ellipsoid(x, (-35, -8, 5), (22, 9, 30)) | _box(x, (-10, 12, -15), (22, 12, 14))
    crest = _ellipsoid(x, (-50, 20, -25), (10, 14, 20))
    neck = _ellipsoid(x, (60, 8, -32), (20, 8, 8)) | _ellipsoid(x, (72, 18, -28), (9, 9, 14))
    femur = (from_head < 18) | neck | ((np.hypot(x[..., 0] - 70, x[..., 1] - 8) < 10) & (x[..., 2] < -30))
    vertebra = (
        _box(x, (0, 10, 45), (20, 15, 14))
        | _box(x, (0, -18, 42), (4, 14, 6))
        | _box(x, (0, -8, 48), (34, 4, 4))
    )
    labels = np.zeros(x.shape[:3], np.int16)
    for number, mask in enumerate((socket | wing | crest, femur, vertebra), start=1):
        labels[mask & (labels == 0)] = number
    body = _ellipsoid(x, (0, 0, 0), (92, 60, 400))
    hu = np.where(body, 20.0, -1000.0)
    hu[_ellipsoid(x, (-30, 30, 50), (20, 15, 20)) & body] = -300.0
    hu[labels > 0] = 700.0
    return Volume(hu.astype(np.float32), affine), Structures(NAMES, labels)


def case(seed: int = 0, angles=(0.0, 60.0), scale: float = 0.6) -> SimulatedCase:
    """Its bones moved about their joints; X-rays of 120 x 120 pixels."""
    ct, structures = phantom()
    cameras = view_cameras(ct, angles, 120, detector_mm=330.0)
    options = SimulationOptions(motion_scale=scale, rotation_deg=3.0, translation_mm=8.0, projector="sum")
    return simulate_case(ct, structures, cameras=cameras, seed=seed, options=options)


def study(simulated: SimulatedCase, options: dict | None = None, camera: str = "initial") -> Study:
    """What a registration gets of a case."""
    return case_to_study(simulated, options=options or {}, camera=camera)


def _box(x, centre, half) -> np.ndarray:
    return (np.abs(x - np.array(centre)) < np.array(half)).all(axis=-1)


def _ellipsoid(x, centre, radii) -> np.ndarray:
    return np.linalg.norm((x - np.array(centre)) / np.array(radii), axis=-1) < 1
