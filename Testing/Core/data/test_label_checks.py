"""Labels compared with the CT: silent where they fit, however poor the CT or the labels; refused where they do not."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion, gaussian_filter

from PolyPoseLib.data.label_checks import check_labels
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

SHAPE = (48, 56, 64)
SPACING = 3.0
AFFINE = np.array([[-3.0, 0, 0, 90], [0, -3.0, 0, 80], [0, 0, 3.0, -60], [0, 0, 0, 1]])
NAMES = ("spine", "left", "right", "front")


def ellipsoid(centre, radii) -> np.ndarray:
    return sum(((g - c) / r) ** 2 for g, c, r in zip(np.indices(SHAPE), centre, radii, strict=True)) <= 1


def phantom() -> tuple[Volume, np.ndarray]:
    """A body with a column, two rods that differ, and a plate: dense shells around a core, as bones are."""
    bones = [
        ellipsoid((24, 38, 33), (20, 6, 6)), ellipsoid((20, 26, 50), (12, 4, 5)),
        ellipsoid((28, 22, 17), (14, 4, 4)), ellipsoid((26, 14, 36), (7, 3, 9)),
    ]  # fmt: skip
    labels = np.zeros(SHAPE, np.int16)
    hu = np.where(ellipsoid((24, 27, 32), (60, 25, 30)), 40.0, -1000.0)
    for number, bone in enumerate(bones, start=1):
        labels[bone] = number
        hu[bone] = 250
        hu[bone & ~binary_erosion(bone)] = 700
    rng = np.random.default_rng(0)
    return Volume((gaussian_filter(hu, 0.6) + rng.normal(0, 15, SHAPE)).astype(np.float32), AFFINE), labels


CT, LABELS = phantom()
BLOBS = gaussian_filter(np.random.default_rng(1).normal(size=SHAPE), 3)


def values(change: Callable[[np.ndarray], np.ndarray]) -> Volume:
    return CT.with_voxels(change(CT.voxels).astype(np.float32))


def resized(step: Callable[..., np.ndarray], voxels: int) -> np.ndarray:
    out = np.zeros_like(LABELS)
    for number in range(1, len(NAMES) + 1):
        out[step(number == LABELS, iterations=voxels) & ((LABELS == 0) | (number == LABELS))] = number
    return out


def shifted(voxels: int, axis: int) -> np.ndarray:
    return np.roll(LABELS, voxels, axis)


COARSE = np.repeat(np.repeat(np.repeat(LABELS[::2, ::2, ::2], 2, 0), 2, 1), 2, 2)


@pytest.mark.parametrize(
    ("ct", "labels"),
    [
        (CT, LABELS),
        (values(lambda hu: np.where(hu > 0, hu / 2, hu)), LABELS),
        (values(lambda hu: np.clip(hu, -160, 240)), LABELS),
        (values(lambda hu: np.where(LABELS > 0, hu, -1000)), LABELS),
        (values(lambda hu: np.where((np.quantile(BLOBS, 0.97) < BLOBS) & (hu > -200), 400, hu)), LABELS),
        (values(lambda hu: np.where(np.quantile(BLOBS, 0.998) < BLOBS, 3000, hu)), LABELS),
        (values(lambda hu: hu + np.random.default_rng(2).normal(0, 100, SHAPE)), LABELS),
        (CT, COARSE),
        (CT, resized(binary_erosion, 1)),
        (CT, resized(binary_dilation, 1)),
        (CT, resized(binary_dilation, 2)),
        (CT, shifted(1, 2)),
    ],
    ids=["sound", "osteoporosis", "window", "bones only", "contrast", "metal", "noise", "coarse", "small", "large",
         "larger", "3 mm"],
)  # fmt: skip
def test_labels_that_fit_are_not_spoken_of(ct, labels):
    assert check_labels(ct, Structures(NAMES, labels)) == ()


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (LABELS[:, :, ::-1], "mirrored left-right"),
        (LABELS[:, ::-1], "mirrored front-back"),
        (LABELS[::-1], "mirrored head-foot"),
        (LABELS[:, ::-1, ::-1], "half a turn"),
        (shifted(8, 0), "24 mm away"),
        (shifted(-8, 1), "24 mm away"),
        (shifted(8, 2), "24 mm away"),
    ],
)
@pytest.mark.parametrize("density", [1.0, 0.5])
def test_labels_beside_bone_are_refused_with_the_place_where_they_fit(labels, words, density):
    ct = values(lambda hu: np.where(hu > 0, density * hu, hu))
    with pytest.raises(InputError, match=words):
        check_labels(ct, Structures(NAMES, np.ascontiguousarray(labels)))


@pytest.mark.parametrize("bones", [(1, 2, 3), (1, 3, 4), (2, 3, 4)])
def test_labels_far_too_small_are_not_refused(bones):
    small = resized(binary_erosion, 2)
    labels = np.select([small == number for number in bones], [1, 2, 3]).astype(np.int16)
    assert check_labels(CT, Structures(NAMES[:3], labels)) == ()


def test_a_structure_of_soft_tissue_is_named():
    labels = np.where(LABELS == 4, 0, LABELS)
    labels[ellipsoid((12, 30, 42), (5, 5, 4)) & (labels == 0)] = 4
    warnings = check_labels(CT, Structures(NAMES, labels))
    assert len(warnings) == 1
    assert '"front"' in warnings[0]


@pytest.mark.parametrize("seed", range(3))
def test_a_ct_without_bone_tells_nothing(seed):
    noise = np.random.default_rng(seed).integers(-1000, 1500, SHAPE).astype(np.float32)
    assert check_labels(CT.with_voxels(noise), Structures(NAMES, LABELS)) == ()
    assert check_labels(CT.with_voxels(np.full(SHAPE, 40, np.float32)), Structures(NAMES, LABELS)) == ()


def test_labels_without_surroundings_tell_nothing():
    assert check_labels(CT, Structures(("all",), np.ones(SHAPE, np.int16))) == ()
