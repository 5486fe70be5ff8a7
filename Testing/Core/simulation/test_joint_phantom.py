"""The drawn knee: bones in one piece each, a thin cortex around spongy bone, the same for the same seed."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion, label

from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.joint_phantom import NAMES, joint_phantom
from PolyPoseLib.simulation.shapes import ellipsoid, joined, round_cone, without


@pytest.fixture(scope="module", params=range(3))
def drawn(request):
    return joint_phantom(request.param, 1.5)


def test_every_bone_is_one_piece_within_the_skin(drawn):
    labels = drawn.structures.labels
    assert drawn.structures.names == NAMES
    body = drawn.ct.voxels > -400
    for number in range(1, 4):
        mask = labels == number
        assert label(mask)[1] == 1 and body[mask].all()
        assert not (binary_dilation(mask) & (labels > 0) & (labels != number)).any()
    sides = [labels[:, :, 0], labels[:, :, -1], labels[:, 0], labels[:, -1]]
    assert not any(side.any() for side in sides)


def test_long_bones_go_on_beyond_the_ct_and_the_patella_does_not(drawn):
    ends = {int(n) for end in (0, -1) for n in np.unique(drawn.structures.labels[end]) if n}
    assert ends == {1, 2}


def test_the_cortex_is_denser_than_what_it_encloses(drawn):
    for number in range(1, 4):
        mask = drawn.structures.labels == number
        core = binary_erosion(mask, iterations=4)
        surface = mask & ~binary_erosion(mask, iterations=2)
        inside, outside = drawn.ct.voxels[core], drawn.ct.voxels[surface]
        assert np.median(outside) > np.median(inside) + 150
        assert inside.std() > 60  # spongy bone is not even


def test_the_seed_fixes_the_knee():
    first, again, other = (joint_phantom(seed, 5.0) for seed in (1, 1, 2))
    assert np.array_equal(first.ct.voxels, again.ct.voxels)
    assert np.array_equal(first.structures.labels, again.structures.labels)
    assert not np.array_equal(first.structures.labels, other.structures.labels)


def test_landmarks_lie_at_their_bones(drawn):
    labels, ct = drawn.structures.labels, drawn.ct
    for name, point in drawn.landmarks.items():
        number = NAMES.index(name.split(".")[0]) + 1
        points = ct.to_world(np.argwhere(labels == number)[:, ::-1])
        assert np.linalg.norm(points - point, axis=1).min() < 6


def test_a_longer_knee_is_the_same_knee():
    short, long = (joint_phantom(2, 5.0, reach) for reach in (100.0, 200.0))
    inside = long.structures.labels[20:-20]
    assert np.mean(inside != short.structures.labels) < 1e-3
    with pytest.raises(InputError, match="phantom's reach"):
        joint_phantom(2, 5.0, 1000.0)


@pytest.mark.parametrize(("seed", "spacing"), [(-1, 1.0), (0, 0.1), (0, 50.0), (0, float("nan"))])
def test_what_cannot_be_drawn_is_refused(seed, spacing):
    with pytest.raises(InputError, match="phantom's"):
        joint_phantom(seed, spacing)


def test_distances_are_those_of_the_shapes():
    rng = np.random.default_rng(0)
    at = rng.uniform(-30, 30, (500, 3)).astype(np.float32)
    points = tuple(at.T)
    ball = ellipsoid(points, (1, 2, 3), (9, 9, 9))
    assert np.allclose(ball, np.linalg.norm(at - [1, 2, 3], axis=1) - 9, atol=1e-3)
    rod = round_cone(points, (0, 0, -10), (0, 0, 10), 5, 5)
    over = np.maximum(np.abs(at[:, 2]) - 10, 0)
    assert np.allclose(rod, np.sqrt(at[:, 0] ** 2 + at[:, 1] ** 2 + over**2) - 5, atol=1e-3)
    far = np.abs(ball - rod) > 4
    assert np.allclose(joined(ball, rod, 4)[far], np.minimum(ball, rod)[far])
    assert (joined(ball, rod, 4) <= np.minimum(ball, rod) + 1e-6).all()
    cut = without(ball, rod, 1)
    clear = np.abs(ball + rod) > 1
    assert np.allclose(cut[clear], np.maximum(ball, -rod)[clear], atol=1e-5)
