"""Grids whose axes are not perpendicular: gantry tilt is resampled away in every format, rounding is corrected."""

import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.shear import SHEAR_TOLERANCE_MM, sideways_drift, straightened
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, read_ct_with_warnings, read_volume, write_volume

SIZES = (8, 7, 6)
TILTS = [1.0, 5.0, 20.0]


def voxels() -> np.ndarray:
    values = np.random.default_rng(0).integers(-1000, 1500, SIZES[::-1]).astype("<i2")
    values.flat[:2] = -1000, 1500
    return values


def tilted(degrees: float, spacing=(20.0, 20.0, 20.0)) -> np.ndarray:
    """(3, 3) axes whose slices drift to the back by so many degrees."""
    axes = np.diag(spacing)
    axes[1, 2] = spacing[2] * np.sin(np.radians(degrees))
    axes[2, 2] = spacing[2] * np.cos(np.radians(degrees))
    return axes


def write(path, axes, qform=1, sform=1):
    """A CT of these axes (3, 3) in the format that the name says, with any forms that are NIfTI's."""
    if path.suffix in (".nii", ".hdr"):
        write_volume(Volume(voxels(), np.diag([*np.linalg.norm(axes, axis=0), 1.0])), path)
        head = bytearray(path.read_bytes())
        struct.pack_into("<2h", head, 252, qform, sform)
        struct.pack_into("<12f", head, 280, *np.column_stack([axes * [[-1], [-1], [1]], np.zeros(3)]).ravel())
        path.write_bytes(head)
        return path
    steps = np.linalg.norm(axes, axis=0)
    if path.suffix == ".nrrd":
        directions = " ".join("(" + ",".join(map(repr, each)) + ")" for each in axes.T.tolist())
        text = "NRRD0004\ntype: short\ndimension: 3\nsizes: 8 7 6\nspace: left-posterior-superior\n"
        text += f"space directions: {directions}\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n"
    else:
        matrix = " ".join(map(repr, (axes / steps).T.ravel().tolist()))
        text = (
            f"ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix = {matrix}\nOffset = 0 0 0\n"
        )
        text += f"ElementSpacing = {steps[0]!r} {steps[1]!r} {steps[2]!r}\nDimSize = 8 7 6\nElementType = MET_SHORT\n"
        text = text.replace("np.float64(", "").replace(")", "") + "ElementDataFile = LOCAL\n"
    path.write_bytes(text.encode() + voxels().tobytes())
    return path


@pytest.mark.parametrize("degrees", TILTS)
@pytest.mark.parametrize("name", ["ct.nii", "ct.hdr", "ct.nrrd", "ct.mha"])
def test_a_tilted_ct_is_made_straight_with_a_warning(tmp_path, name, degrees):
    ct, warnings = read_ct_with_warnings(write(tmp_path / name, tilted(degrees, (19.0, 19.0, 19.0))))
    directions = ct.affine[:3, :3] / ct.spacing
    assert np.allclose(directions.T @ directions, np.eye(3), atol=1e-9)
    assert np.allclose(ct.spacing, [19, 19, 19 * np.cos(np.radians(degrees))], rtol=1e-6)
    assert any(f"tilted by {degrees:.1f} degrees" in each for each in warnings)


@pytest.mark.parametrize("name", ["ct.nii", "ct.nrrd", "ct.mha"])
def test_no_gantry_tilts_so_far(tmp_path, name):
    with pytest.raises(InputError, match=r"sheared by 50\.0 degrees, .* resample the CT") as error:
        read_ct(write(tmp_path / name, tilted(50.0, (9.0, 19.0, 19.0))))
    assert name in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(("qform", "sform"), [(1, 1), (1, 2), (2, 1), (0, 1), (0, 2)])
@pytest.mark.parametrize("is_distance", [False, True])
def test_a_tilted_nifti_is_placed_by_its_sform(tmp_path, qform, sform, is_distance):
    """The toolkit takes other axes in its place; as pixdim some give the slices' distance, not the axis' length."""
    path = write(tmp_path / "ct.nii", tilted(10.0), qform, sform)
    if is_distance:
        head = bytearray(path.read_bytes())
        struct.pack_into("<f", head, 88, 20 * np.cos(np.radians(10.0)))
        path.write_bytes(head)
    assert np.allclose(read_volume(path).affine[:3, :3], tilted(10.0), atol=1e-4)
    assert np.array_equal(read_volume(path).voxels, voxels())


@pytest.mark.parametrize("sform", [3, 4])
def test_an_sform_that_leads_to_a_template_does_not_place_a_ct(tmp_path, sform):
    ct = read_ct(write(tmp_path / "ct.nii", tilted(10.0), 1, sform))
    assert np.allclose(ct.affine[:3, :3], np.diag([20, 20, 20]), atol=1e-4)


@pytest.mark.parametrize(("qform", "sform"), [(1, 1), (1, 2), (0, 1)])
@pytest.mark.parametrize("axis", range(3))
def test_an_sform_of_another_spacing_is_refused(tmp_path, qform, sform, axis):
    path = write(tmp_path / "ct.nii", tilted(0.0, (2.0, 2.0, 2.0)), qform, sform)
    head = bytearray(path.read_bytes())
    struct.pack_into("<f", head, 80 + 4 * axis, 3.0)
    path.write_bytes(head)
    with pytest.raises(InputError, match="by its pixdim but 2 x 2 x 2 mm by its sform"):
        read_volume(path)


@pytest.mark.parametrize("name", ["ct.nii", "ct.nrrd", "ct.mha"])
@pytest.mark.parametrize("decimals", [4, 5, 8])
@pytest.mark.parametrize("seed", range(3))
def test_axes_that_were_rounded_are_read_and_straight(tmp_path, name, decimals, seed):
    axes = Rotation.random(random_state=seed).as_matrix() * [2.0, 1.0, 3.0]
    ct = read_ct(write(tmp_path / name, np.round(axes, decimals), 0))
    assert np.abs(ct.affine[:3, :3] - axes).max() < 2 * 10.0**-decimals + 1e-6
    directions = ct.affine[:3, :3] / ct.spacing
    assert np.abs(directions.T @ directions - np.eye(3)).max() < 1e-6


@pytest.mark.parametrize("name", ["labels.nrrd", "labels.mha"])
def test_tilted_labels_are_resampled_rightly(tmp_path, name):
    """Only a CT must be straight: its grid is that of the results."""
    segmentation = read_volume(write(tmp_path / name, tilted(10.0)))
    assert np.allclose(segmentation.affine[:3, :3], tilted(10.0))


@pytest.mark.parametrize("seed", range(30))
def test_straight_axes_keep_their_lengths_and_sides(seed):
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 600, 3)
    axes = Rotation.random(random_state=seed).as_matrix() * rng.uniform(0.3, 5, 3) * rng.choice([-1, 1], 3)
    bent = axes * (1 + rng.uniform(-1, 1, (3, 3)) * 1e-5)
    straight = straightened(bent, sizes)
    directions = straight / np.linalg.norm(straight, axis=0)
    assert np.allclose(directions.T @ directions, np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.norm(straight, axis=0), np.linalg.norm(bent, axis=0))
    corners = np.stack(np.meshgrid(*[(0, n - 1) for n in sizes], indexing="ij"), axis=-1).reshape(8, 3)
    moved = np.linalg.norm(corners @ (straight - bent).T, axis=1).max()
    assert moved <= 3 * sideways_drift(bent, sizes)[0] + 1e-9
    assert np.array_equal(straightened(axes, sizes), axes)


@pytest.mark.parametrize("degrees", TILTS)
@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (2, 0)])
def test_the_drift_is_that_of_the_last_slice(degrees, pair):
    axes, sizes = np.eye(3), np.array([400, 400, 400])
    sizes[pair[1]] = 101
    axes[pair[0], pair[1]] = np.tan(np.radians(degrees))
    drift, angle = sideways_drift(axes, sizes)
    assert np.isclose(drift, 100 * np.tan(np.radians(degrees))) and np.isclose(angle, degrees)
    assert drift > SHEAR_TOLERANCE_MM and np.array_equal(straightened(axes, sizes), axes)
