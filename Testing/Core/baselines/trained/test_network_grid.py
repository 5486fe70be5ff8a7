"""The network's grid: the same patient looks alike however the CT is stored, and millimetres come back."""

from itertools import permutations, product

import learned_phantom
import numpy as np
import pytest

from PolyPoseLib.baselines.trained.network_grid import FIELD_MM, NetworkGrid
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError


def stored(ct, order, flips):
    """The same voxels at the same places, in another order of the axes (k, j, i) and directions."""
    index = np.eye(4)
    voxels = np.transpose(ct.voxels, order)
    index[:3, :3] = 0
    for new, old in enumerate(order):
        index[2 - old, 2 - new] = 1
    for axis in (n for n in range(3) if flips[n]):
        voxels = np.flip(voxels, axis)
        mirror = np.eye(4)
        mirror[2 - axis, 2 - axis] = -1
        mirror[2 - axis, 3] = voxels.shape[axis] - 1
        index = index @ mirror
    return Volume(np.ascontiguousarray(voxels), ct.affine @ index)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_storage_order_does_not_matter(order):
    ct, _ = learned_phantom.phantom()
    wanted = NetworkGrid.of(ct, 16)
    image = wanted.resampled(ct)
    for flips in product((0, 1), repeat=3):
        other = stored(ct, order, flips)
        assert other.voxels_at(other.to_index(ct.corners()), 0.0) == pytest.approx(
            ct.voxels_at(ct.to_index(ct.corners()), 0.0)
        )
        grid = NetworkGrid.of(other, 16)
        np.testing.assert_allclose(grid.affine, wanted.affine, atol=1e-9)
        # Averages before resampling start at another end of an axis.
        assert np.corrcoef(grid.resampled(other).ravel(), image.ravel())[0, 1] > 0.95


def test_resampling_a_linear_ramp_is_exact():
    affine = np.diag([2.0, 3.0, -2.5, 1.0])
    affine[:3, 3] = (10, -20, 30)
    index = np.stack(np.meshgrid(*map(np.arange, (20, 18, 22)), indexing="ij"), -1)[..., ::-1]
    points = index @ affine[:3, :3].T + affine[:3, 3]
    ct = Volume((points @ (1.0, -2.0, 0.5) + 7).astype(np.float32), affine)
    grid = NetworkGrid.of(ct, 32)
    assert grid.points()[[0, -1], [0, -1], [0, -1]] == pytest.approx(ct.corners()[[1, -2]])
    np.testing.assert_allclose(grid.resampled(ct), grid.points() @ (1.0, -2.0, 0.5) + 7, atol=1e-3)


def test_fine_voxels_are_averaged_before_they_are_resampled():
    stripes = np.zeros((64, 64, 64), np.float32)
    stripes[:, :, ::2] = 100.0
    values = NetworkGrid.of(Volume(stripes, np.eye(4)), 16).resampled(Volume(stripes, np.eye(4)), 50.0)
    assert np.abs(values - 50).max() < 1.0


def test_a_displacement_comes_back_in_millimetres_and_covers_the_ct():
    ct, _ = learned_phantom.phantom()
    turn = np.array(
        [[np.cos(0.3), -np.sin(0.3), 0, 4], [np.sin(0.3), np.cos(0.3), 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
    )
    oblique = Volume(ct.voxels, turn @ ct.affine)
    grid = NetworkGrid.of(oblique, 16)
    nodes = grid.points()
    slope = np.array([[0.02, -0.01, 0], [0, 0.03, 0.01], [0.01, 0, -0.02]])
    field = DisplacementField(nodes @ slope.T + (1.0, -2, 3), grid.affine)
    back = grid.field(grid.displacement(field), oblique)
    assert (back.spacing <= FIELD_MM + 1e-9).all()
    inside = np.random.default_rng(0).dirichlet(np.ones(8), 200) @ oblique.corners()
    np.testing.assert_allclose(back.sample(inside), inside @ slope.T + (1.0, -2, 3), atol=2e-3)
    edges = Volume(np.zeros(back.shape), back.affine).to_index(oblique.corners())
    assert (edges >= 0).all() and (edges <= np.array(back.shape[::-1]) - 1).all()


def test_normalised_coordinates_end_at_the_outermost_nodes():
    grid = NetworkGrid.of(learned_phantom.phantom()[0], 16)
    ends = grid.normalised(grid.points()[[0, -1, 0], [0, -1, 0], [0, -1, -1]])
    np.testing.assert_allclose(ends, [[-1, -1, -1], [1, 1, 1], [1, -1, -1]], atol=1e-12)


def test_a_bent_ct_is_refused():
    affine = np.eye(4)
    affine[0, 1] = 0.3
    with pytest.raises(InputError, match="the CT"):
        NetworkGrid.of(Volume(np.zeros((4, 4, 4)), affine), 16)
