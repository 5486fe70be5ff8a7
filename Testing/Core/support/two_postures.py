"""A neck of analytic solids in two scans: the whole patient lies elsewhere in the second, and one vertebra has moved.

Nothing here uses the program's readers, renderers or poses: scans are sampled from formulas and written by SimpleITK.
"""

import numpy as np
import pytest
import SimpleITK as sitk

SKULL, C5, CORD, TRACHEA = 91, 46, 79, 16  # of TotalSegmentator's task total
MARKER = np.array([30.0, 30.0, -60.0])  # where the second scan's marker lies in the first one's world
MARKER_MM = 7.0
SHAPE = (68, 56, 60)  # (k, j, i)


@pytest.fixture(autouse=True, scope="module")
def plain_rendering():
    """Small pictures by the plain ray sum: ITK-RTK, which its own tests compare with it, takes long to load."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("PolyPoseLib.simulation.independent_projector.rtk_available", lambda: False)
        patch.setattr("PolyPoseLib.io.benchmark.two_scans.PIXELS", 128)
        yield


def rotation(axis, degrees):
    """Rodrigues."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.cross(np.eye(3), axis) * -1
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rigid(axis, degrees, shift, centre=(0, 0, 0)):
    """A turn about a centre, then a shift; (4, 4)."""
    motion = np.eye(4)
    motion[:3, :3] = rotation(axis, degrees)
    motion[:3, 3] = np.asarray(centre) - motion[:3, :3] @ centre + shift
    return motion


def moved(motion, points):
    return points @ motion[:3, :3].T + motion[:3, 3]


C5_CENTRE = np.array([0.0, 8.0, -35.0])
C5_MOTION = rigid((1, 0.2, 0), 12.0, (6.0, -7.0, 2.0), C5_CENTRE)  # first scan's posture to the second's
REPOSITIONED = rigid((0.2, 0.3, 1), 9.0, (11.0, -6.0, 8.0))  # first scan's world to the second's


def _ellipsoid(points, centre, radii):
    return (((points - centre) / radii) ** 2).sum(axis=-1) < 1


def labels_at(points, is_second):
    """Labels at points of the first scan's world."""
    at_c5 = moved(np.linalg.inv(C5_MOTION), points) if is_second else points
    labels = np.zeros(points.shape[:-1], np.uint8)
    labels[_ellipsoid(points, (0, 2, 35), (38, 46, 40))] = SKULL
    labels[_ellipsoid(points, (14, -30, 24), (12, 14, 12))] = (
        SKULL  # without it a turn would be told by little
    )
    labels[_ellipsoid(points, (0, -24, -45), (7, 7, 26))] = TRACHEA
    labels[_ellipsoid(at_c5, C5_CENTRE, (20, 14, 13))] = C5
    labels[_ellipsoid(at_c5, np.add(C5_CENTRE, [0, 16, 0]), (7, 11, 8))] = C5
    return labels


def scan(is_second, affine, shape=SHAPE, marker=True):
    """HU and labels (k, j, i) on a grid of the scan's own world."""
    k, j, i = np.indices(shape)
    points = np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]
    if is_second:
        points = moved(np.linalg.inv(REPOSITIONED), points)
    labels = labels_at(points, is_second)
    hu = np.where(_ellipsoid(points, (0, 0, 0), (70, 68, 115)), 30, -1000)
    hu[labels == SKULL], hu[labels == C5], hu[labels == TRACHEA] = 700, 500, -950
    if is_second and marker:
        hu[_ellipsoid(points, MARKER, (MARKER_MM,) * 3)] = 3000
    return hu.astype(np.int16), labels


def grids():
    """Affines of both scans, with other spacings and directions."""
    first = np.diag([3.2, 3.2, 3.4, 1.0])
    first[:3, 3] = -first[:3, :3] @ (np.array(SHAPE[::-1]) - 1) / 2
    second = np.eye(4)
    second[:3, :3] = rotation((0, 1, 0.3), 4.0) @ np.diag([-3.0, 3.2, 3.6])
    middle = moved(REPOSITIONED, np.zeros(3))
    second[:3, 3] = middle - second[:3, :3] @ (np.array(SHAPE[::-1]) - 1) / 2
    return first, second


def write_image(voxels, affine, path):
    image = sitk.GetImageFromArray(voxels)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    image.SetSpacing(spacing.tolist())
    image.SetDirection((affine[:3, :3] / spacing).ravel().tolist())
    image.SetOrigin(affine[:3, 3].tolist())
    path.parent.mkdir(parents=True, exist_ok=True)
    sitk.WriteImage(image, str(path))


def pixel_of(camera, point):
    """(column, row), by the textbook."""
    x = camera.intrinsics @ (camera.extrinsic[:3, :3] @ point + camera.extrinsic[:3, 3])
    return x[:2] / x[2]


def spot(image, pixel, half=6):
    """Centroid (column, row) of what is brighter than its surroundings around a pixel."""
    column, row = np.rint(pixel).astype(int)
    part = image[row - half : row + half + 1, column - half : column + half + 1].astype(float)
    rows, columns = np.indices(part.shape)
    rim = (rows < 2) | (columns < 2) | (rows > 2 * half - 2) | (columns > 2 * half - 2)
    plane = np.stack([rows[rim], columns[rim], np.ones(rim.sum())], axis=1)
    fit = np.linalg.lstsq(plane, part[rim], rcond=None)[0]
    weight = np.maximum(part - (fit[0] * rows + fit[1] * columns + fit[2]) - 0.15, 0)
    assert weight.sum() > 2, "there is no spot"
    return np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum() + [
        column - half,
        row - half,
    ]


def dice_of(case, numbers, motion):
    """Dice coefficient of labels pulled through a rigid motion, fixed to moving, against the truth."""
    truth, source = case.truth.labels, case.study.source_segmentation
    k, j, i = np.indices(truth.voxels.shape)
    points = np.stack([i, j, k], axis=-1) @ truth.affine[:3, :3].T + truth.affine[:3, 3]
    index = moved(np.linalg.inv(source.affine), moved(motion, points))
    near = np.rint(index).astype(int)
    size = np.array(source.voxels.shape[::-1])
    inside = ((near >= 0) & (near < size)).all(axis=-1)
    near = np.clip(near, 0, size - 1)
    warped = np.isin(source.voxels[near[..., 2], near[..., 1], near[..., 0]], numbers) & inside
    true = np.isin(truth.voxels, numbers)
    return 2 * (warped & true).sum() / (warped.sum() + true.sum())
