"""The head CT of the benchmark of a jaw: read as it is or refused in a sentence, and parted where bones touch."""

import io
import plistlib
import tarfile

import head_ct
import jaw_anatomy
import numpy as np
import pytest
from head_ct import read_head
from jaw_anatomy import Head, completed, head_of, mouth, split_bones
from jaw_teeth import teeth_numbers, true_mouth, warped_mouths

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.posed_ct import pose_ct


def project(path, voxels, spacing=(0.5, 0.75, 2.0), claimed=None, settings=None, without=()):
    """Write an InVesalius project."""
    matrix = {"filename": "matrix.dat", "dtype": "int16", "shape": list(claimed or voxels.shape)}
    main = {"modality": "CT", "spacing": list(spacing), "matrix": matrix} | (settings or {})
    files = {"main.plist": plistlib.dumps(main), "matrix.dat": voxels.astype("<i2").tobytes()}
    with tarfile.open(path, "w:gz") as archive:
        for name in files.keys() - set(without):
            entry = tarfile.TarInfo(f"folder/{name}")
            entry.size = len(files[name])
            archive.addfile(entry, io.BytesIO(files[name]))
    return path


def test_a_project_is_read_from_its_file_and_from_a_folder_above(tmp_path):
    voxels = np.random.default_rng(0).integers(-1000, 3000, (3, 4, 5))
    (tmp_path / "usr" / "share").mkdir(parents=True)
    path = project(tmp_path / "usr" / "share" / "Head.inv3", voxels)
    for given in (path, tmp_path):
        head = read_head(given)
        assert np.array_equal(head.voxels, voxels)
        # Columns go to the left, rows to the front, slices to the head: LPS is left, posterior, superior.
        assert np.allclose(head.to_world(np.array([[1.0, 2.0, 1.0]])), [[0.5, -1.5, 2.0]])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"claimed": (3, 4, 6)}, "has 120 bytes and not 144"),
        ({"claimed": (3, 4)}, "shape"),
        ({"claimed": (0, 4, 5)}, "shape"),
        ({"claimed": (10**9, 10**9, 10**9)}, "shape"),
        ({"spacing": (0.5, 0.0, 1.0)}, "spacing"),
        ({"spacing": (0.5, float("nan"), 1.0)}, "spacing"),
        ({"spacing": (0.5, 0.5)}, "spacing"),
        ({"settings": {"modality": "MRI"}}, "no CT"),
        ({"settings": {"matrix": 3}}, 'lacks "matrix"'),
        ({"settings": {"spacing": ["one", 1, 1]}}, 'lacks "matrix" or "spacing"'),
        ({"without": ["main.plist"]}, "lacks main.plist"),
        ({"without": ["matrix.dat"]}, "lacks matrix.dat"),
    ],
)
def test_what_is_no_head_ct_is_refused_in_one_sentence(tmp_path, change, says):
    path = project(tmp_path / "Head.inv3", np.zeros((3, 4, 5)), **change)
    with pytest.raises(InputError, match="invesalius-examples") as refusal:
        read_head(path)
    assert says in str(refusal.value) and str(path) in str(refusal.value)


def test_damaged_and_missing_files_are_refused(tmp_path, monkeypatch):
    good = project(tmp_path / "Head.inv3", np.random.default_rng(1).integers(0, 999, (20, 20, 20)))
    whole = good.read_bytes()
    cut = tmp_path / "cut.bin"
    for length in (0, 1, 20, len(whole) // 2, len(whole) - 1):
        cut.write_bytes(whole[:length])
        with pytest.raises(InputError, match=r"cut\.bin"):
            read_head(cut)
    for given in (tmp_path / "absent", tmp_path.joinpath("empty")):
        with pytest.raises(InputError, match="there is no such file or folder"):
            read_head(given)
    (tmp_path / "more").mkdir()
    with pytest.raises(InputError, match=r"holds 0 files \*\.inv3"):
        read_head(tmp_path / "more")
    monkeypatch.setattr(head_ct, "MOST_BYTES", 1000)
    with pytest.raises(InputError, match="grows beyond"):
        read_head(good)


def phantom():
    """A skull with teeth, and two rami that touch it at the joint over less dense bone.

    HU (k, j, i) on this benchmark's grid, as far as its cut planes need it, and where the rami are.
    """
    voxels = np.full((34, 190, 200), 40, np.int16)
    voxels[26:30, 20:185, 20:180] = 1200  # the base of the skull
    voxels[8:26, 168:172, 110:150] = 1200  # the maxilla
    voxels[0:8, 168:172, 112:148:6] = 2400  # teeth
    rami = np.zeros(voxels.shape, bool)
    rami[0:25, 135:160, 60:66] = rami[0:25, 135:160, 170:176] = True
    voxels[rami] = 1000
    voxels[25, 140:145, 60:66] = 350  # the joint
    voxels[0:6, 105:130, 95:165] = 900  # the atlas
    return voxels, rami


def test_rami_are_parted_from_the_skull_where_they_touch():
    voxels, rami = phantom()
    labels = split_bones(voxels)
    assert (labels[rami] == 2).all()
    assert (labels[26:30, 20:185, 20:180] == 1).all() and (labels[0:8, 168:172, 112] == 1).all()
    outside = (labels == 2) & ~rami
    assert set(np.argwhere(outside)[:, 0]) <= {25}, "only the joint's own voxels are anybody's"
    assert not labels[0:6, 105:130, 95:165].any(), "the atlas is no structure"


@pytest.mark.parametrize("fault", ["fused", "one", "none"])
def test_a_head_without_two_rami_is_refused(fault):
    voxels, rami = phantom()
    if fault == "fused":
        voxels[25, 140:145, 60:66] = 1000
    else:
        rami[:, :, 100:] &= fault == "none"
        voxels[rami] = 40
    with pytest.raises(InputError, match="two rami"):
        split_bones(voxels)


def test_the_lower_row_is_the_upper_one_mirrored_and_nothing_else_is_bone_below():
    voxels, _ = phantom()
    labels = split_bones(voxels)
    more, parts = completed(voxels, labels)
    n = jaw_anatomy.BELOW_SLICES
    assert np.array_equal(more[n:], voxels) and np.array_equal(parts[n:], labels)
    arch = (slice(165, 175), slice(97, 164))
    for depth in range(jaw_anatomy.ALVEOLAR_SLICES):
        assert np.array_equal(more[n - 1 - depth][arch], voxels[depth][arch])
        assert np.array_equal(parts[n - 1 - depth][arch] == 2, labels[depth][arch] == 1)
    below = parts[:n]
    assert not (below == 1).any() and (more[:n][below == 0] <= jaw_anatomy.SOFT_LIMIT_HU).all()
    assert not parts[: n - jaw_anatomy.JAW_SLICES].any()


@pytest.fixture(scope="module")
def small_head():
    """A block of two rows of teeth that touch, in a head of which all but the mouth is left out."""
    n = jaw_anatomy.BELOW_SLICES
    voxels = np.full((n + 40, 30, 34), 40.0)
    labels = np.zeros(voxels.shape, np.int16)
    for part, number in ((slice(n - 6, n), 2), (slice(n, n + 6), 1)):
        voxels[part, 12:18, 8:26], labels[part, 12:18, 8:26] = 2500.0, number
    affine = np.diag([1.0, -1.0, 1.5, 1.0])
    return Head(Volume(voxels, affine), Volume(labels, affine))


def test_composing_opens_the_rows_and_smooth_warps_draw_teeth_out(small_head):
    down = rigid_about(np.zeros(3), np.zeros(3), np.array([0.0, 0.0, -15.0]))
    poses = {"skull": np.eye(4), "mandible": np.linalg.inv(down)}
    posed = pose_ct(small_head.ct, small_head.structures, poses)
    rest, truth = mouth(small_head), true_mouth(small_head, Volume(posed.hu, posed.grid.affine))
    assert teeth_numbers(rest, truth, truth) == {
        "volume_ratio": 1.0,
        "dice": 1.0,
        "extra_ml": 0.0,
        "missing_ml": 0.0,
    }
    numbers = {
        form: teeth_numbers(rest, truth, each) for form, each in warped_mouths(small_head, poses).items()
    }
    gap = 18 * 6 * 15.0 / 1000
    composed, smooth, paper = (numbers[form] for form in ("composed", "smooth", "paper"))
    assert composed["dice"] > 0.99 and composed["extra_ml"] == composed["missing_ml"] == 0
    # Both smooth warps fill most of the gap with enamel.
    assert 0.5 * gap < smooth["extra_ml"] < gap and smooth["volume_ratio"] > 1.5
    assert paper["extra_ml"] > 0.3 * gap


def test_at_rest_every_form_is_the_ct(small_head):
    rest = mouth(small_head)
    for each in warped_mouths(small_head, {"skull": np.eye(4), "mandible": np.eye(4)}).values():
        assert np.allclose(each.voxels, rest.voxels, atol=1e-2)
        assert each.same_grid(rest)


def test_heads_are_made_of_the_scan_or_of_more(monkeypatch):
    voxels, _ = phantom()
    padded = np.pad(voxels, ((0, 0), (20, 20), (20, 20)), constant_values=-1000)
    # The cut planes are those of this benchmark's CT: shift them as the phantom was.
    for name in ("ARCH", "VERTEBRAE"):
        shifted = [
            slice(each.start and each.start + 20, each.stop and each.stop + 20)
            for each in getattr(jaw_anatomy, name)[-2:]
        ]
        monkeypatch.setattr(jaw_anatomy, name, (*getattr(jaw_anatomy, name)[:-2], *shifted))
    scan = Volume(padded, np.diag([1.0, -1.0, 1.5, 1.0]))
    whole, bare = head_of(scan, "completed"), head_of(scan, "scanned")
    assert bare.ct.shape[0] == 34 and whole.ct.shape[0] == 34 + jaw_anatomy.BELOW_SLICES
    for head in (whole, bare):
        assert head.structures.names == ("skull", "mandible") and head.ct.shape[1] == 190 + 12
        # Every voxel stays where it was in the world.
        place = head.ct.to_world(np.argwhere(head.labels.voxels == 1)[:, ::-1].astype(float))
        assert (scan.voxels_at(scan.to_index(place), -1000) >= 250).all()
    assert (whole.labels.voxels == 2).sum() > (bare.labels.voxels == 2).sum()
