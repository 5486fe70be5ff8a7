"""Displacement fields: interpolation, ITK's view of them, files."""

import subprocess
import sys

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.io.transforms import read_transform, write_transform


def field_of(affine, shape=(7, 9, 8), seed=0) -> DisplacementField:
    vectors = np.random.default_rng(seed).normal(0, 5, (*shape, 3)).astype(np.float32)
    return DisplacementField(vectors, affine)


def points_in(field, count=300, seed=1) -> np.ndarray:
    index = np.random.default_rng(seed).uniform(0, np.array(field.shape[::-1]) - 1, (count, 3))
    return index @ field.affine[:3, :3].T + field.affine[:3, 3]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_points_agree_with_itk(affine_of, seed):
    field = field_of(affine_of(seed))
    points = points_in(field)
    transform = field.to_sitk_transform()
    expected = np.array([transform.TransformPoint(p.tolist()) for p in points])
    assert np.abs(field(points) - expected).max() < 1e-4


def test_linear_fields_are_exact_between_nodes(affine_of):
    rng = np.random.default_rng(3)
    affine = affine_of(1)
    matrix, offset = rng.normal(size=(3, 3)), rng.normal(size=3)
    field = field_of(affine)
    nodes = np.argwhere(np.ones(field.shape))[:, ::-1] @ affine[:3, :3].T + affine[:3, 3]
    linear = DisplacementField((nodes @ matrix.T + offset).reshape(*field.shape, 3), affine)
    points = points_in(field)
    assert np.abs(linear.sample(points) - (points @ matrix.T + offset)).max() < 1e-3


def test_value_beyond_the_grid_is_that_of_its_nearest_point(affine_of):
    field = field_of(affine_of(0))
    inside = field.affine[:3, :3] @ [7, 4, 3] + field.affine[:3, 3]
    assert np.allclose(field.sample(inside + np.array([500, 0, 0])), field.sample(inside), atol=1e-5)


def test_sampling_keeps_the_shape_of_the_points(affine_of):
    field = field_of(affine_of(0))
    points = points_in(field, 12)
    assert np.array_equal(field.sample(points.reshape(3, 4, 3)).reshape(-1, 3), field.sample(points))
    assert field.sample(points[0]).shape == (3,)


def test_an_axis_of_one_node_is_constant():
    values = np.arange(6.0).reshape(1, 2, 3, 1)
    index = np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 3.0], [2.0, 1.0, -2.0]])
    assert np.allclose(trilinear(values, index)[:, 0], [2.0, 2.0, 5.0])


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_h5_round_trip(affine_of, tmp_path, seed):
    field = field_of(affine_of(seed))
    write_transform(field, tmp_path / "transform.h5")
    read = read_transform(tmp_path / "transform.h5")
    assert np.array_equal(read.vectors, field.vectors)
    assert np.abs(read.affine - field.affine).max() < 1e-9
    point = points_in(field, 1)[0]
    again = sitk.ReadTransform(str(tmp_path / "transform.h5")).TransformPoint(point.tolist())
    assert np.abs(field(point) - again).max() < 1e-4


def test_files_that_are_not_fields_are_refused(tmp_path, affine_of):
    with pytest.raises(InputError, match="no such file"):
        read_transform(tmp_path / "absent.h5")
    sitk.WriteTransform(sitk.TranslationTransform(3), str(tmp_path / "shift.h5"))
    with pytest.raises(InputError, match="displacement field"):
        read_transform(tmp_path / "shift.h5")
    (tmp_path / "junk.h5").write_bytes(b"junk")
    with pytest.raises(InputError, match=r"junk\.h5"):
        read_transform(tmp_path / "junk.h5")
    with pytest.raises(InputError, match=r"\.h5"):
        write_transform(field_of(affine_of(0)), tmp_path / "transform.txt")
    with pytest.raises(InputError, match="nowhere does not exist"):
        write_transform(field_of(affine_of(0)), tmp_path / "nowhere" / "transform.h5")


def test_impossible_fields_are_refused(affine_of):
    good = np.zeros((2, 2, 2, 3))
    with pytest.raises(InputError, match="shape"):
        DisplacementField(good[..., :2], affine_of(0))
    with pytest.raises(InputError, match="NaN"):
        DisplacementField(good + np.nan, affine_of(0))
    sheared = affine_of(0)
    sheared[0, 1] = 1.0
    with pytest.raises(InputError, match="right angles"):
        DisplacementField(good, sheared)
    with pytest.raises(InputError, match="singular"):
        DisplacementField(good, np.diag([1.0, 1, 0, 1]))


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("spacing_mm", [1.0, 2.2, 4.0])
def test_covering_grid_reaches_every_voxel_edge(affine_of, seed, spacing_mm):
    affine, shape = affine_of(seed), (11, 13, 17)
    grid, nodes = covering_grid(affine, shape, spacing_mm, margin_mm=3.0)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    assert np.allclose(np.linalg.norm(grid[:3, :3], axis=0), np.maximum(spacing, spacing_mm))
    size = np.array(shape[::-1])
    ends = np.stack([-0.5 - 3.0 / spacing, size - 0.5 + 3.0 / spacing])
    world = ends @ affine[:3, :3].T + affine[:3, 3]
    index = (world - grid[:3, 3]) @ np.linalg.inv(grid[:3, :3]).T
    assert (index[0] > -1e-9).all() and (index[1] < np.array(nodes[::-1]) - 1 + 1e-9).all()


def test_covering_grid_needs_a_spacing(affine_of):
    with pytest.raises(InputError, match="spacing"):
        covering_grid(affine_of(0), (3, 3, 3), 0.0)


def test_results_can_be_stored_without_torch():
    """Fields, grids and composition are numpy and SimpleITK only."""
    modules = "dense", "composition", "vote", "infill", "distances"
    code = "import sys\nimport PolyPoseLib.data.displacement_field\n"
    code += "".join(f"import PolyPoseLib.warp.{name}\n" for name in modules)
    code += "sys.exit('torch' in sys.modules or 'numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
