"""A small chest for the tests of breathing: spine, ribs as bent tubes, sternum, lungs over a dome, liver, heart."""

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume

NUMBERS = (2, 4, 6, 8)
RIBS = tuple(f"rib_{side}_{number}" for side in ("left", "right") for number in NUMBERS)
NAMES = ("thoracic_spine", *RIBS, "sternum")
LABELS = {11: "lung_lower_lobe_left", 14: "lung_lower_lobe_right", 5: "liver", 51: "heart"}
LUNG_AXES = np.array([38.0, 46.0])


def chest(spacing=4.0, handedness=1):
    """CT (HU), structures, full segmentation with LABELS, in LPS mm around the origin."""
    size = np.ceil(np.array([260.0, 190.0, 230.0]) / spacing).astype(int)
    affine = np.diag([handedness * spacing, spacing, spacing, 1.0])
    affine[:3, 3] = -affine[:3, :3] @ ((size - 1) / 2)
    kji = np.stack(np.meshgrid(*map(np.arange, size[::-1]), indexing="ij"), -1)
    x = kji[..., ::-1] @ affine[:3, :3].T + affine[:3, 3]
    labels = np.zeros(x.shape[:3], np.int16)
    labels[np.hypot(x[..., 0], x[..., 1] - 58) < 16] = 1
    for place, name in enumerate(RIBS, start=2):
        tube = _tube(x, arc("left" in name, int(name.rsplit("_", 1)[1])))
        labels[tube & (labels == 0)] = place
    sternum = (np.abs(x[..., 0]) < 12) & (np.abs(x[..., 1] + 68) < 7) & (np.abs(x[..., 2] + 5) < 50)
    labels[sternum & (labels == 0)] = len(NAMES)
    source = np.zeros_like(labels)
    heart = np.linalg.norm(x - [6, -22, 0], axis=-1) < 27
    for label, middle in ((11, 48.0), (14, -48.0)):
        radius = np.hypot((x[..., 0] - middle) / LUNG_AXES[0], (x[..., 1] - 2) / LUNG_AXES[1])
        base = -50 + 40 * (1 - radius**2)
        lung = (radius < 1) & (x[..., 2] > base) & (x[..., 2] < 85)
        source[lung & ~heart] = label
        if label == 14:
            source[(radius < 1) & (x[..., 2] < base - 3) & (x[..., 2] > -95)] = 5
    source[heart] = 51
    source[labels > 0] = 0
    hu = np.where(np.hypot(x[..., 0] / 122, x[..., 1] / 86) < 1, 30.0, -1000.0)
    hu[np.isin(source, (11, 14))] = -800.0
    hu[source == 5], hu[source == 51], hu[labels > 0] = 60.0, 45.0, 700.0
    source[labels > 0] = labels[labels > 0] + 100
    ct = Volume(hu.astype(np.float32), affine)
    return ct, Structures(NAMES, labels), Volume(source, affine)


def arc(left, number):
    """The middle line (N, 3) of a rib, from the spine to the front."""
    t = np.linspace(0, 1, 120)
    side = 1.0 if left else -1.0
    out = side * (19 + 76 * np.sin(np.pi * t) ** 0.8)
    return np.stack([out, 55 - 118 * t, 88 - 17 * (number - 2) - 38 * t], axis=-1)


def _tube(x, line):
    """Voxels less than 5.5 mm from a line."""
    from scipy.spatial import KDTree

    distance, _ = KDTree(line).query(x.reshape(-1, 3))
    return (distance < 5.5).reshape(x.shape[:3])
