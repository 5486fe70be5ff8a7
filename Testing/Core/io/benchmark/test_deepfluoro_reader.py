"""DeepFluoro: replicas of both layouts, read end to end."""

import numpy as np
import pytest
import SimpleITK as sitk
import torch
from two_postures import moved, pixel_of, rigid, spot

h5py = pytest.importorskip("h5py")

import fluoro_replica as replica  # noqa: E402

from PolyPoseLib.errors import InputError  # noqa: E402
from PolyPoseLib.io.benchmark import deepfluoro, h5_values  # noqa: E402


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return replica.write_hdf5(tmp_path_factory.mktemp("fluoro") / "ipcai_2020_full_res_data.h5")


@pytest.fixture(scope="module")
def case(file):
    (found,) = deepfluoro.cases(file, "subject01", [])
    return found


def _reduced(pixel):
    """A pixel of the whole picture in one cropped by 50 and averaged over blocks of 8."""
    return (np.asarray(pixel) - 50 + 0.5) / 8 - 0.5


def test_the_papers_frames_are_given_and_the_others_held_out(file, case):
    assert deepfluoro.subjects(file) == deepfluoro.subjects(file.parent) == ["subject01"]
    assert (case.name, case.views, case.study.anchor) == ("subject01-10+9", "10+9", "pelvis")
    assert (case.subject, case.views) == deepfluoro.row_names("subject01", "paper")
    assert [xray.name for xray in case.study.xrays] == ["frame 010", "frame 009"]
    assert all(xray.image.shape == (179, 179) and xray.camera == "known" for xray in case.study.xrays)
    assert dict(case.labels) == {"pelvis": (1, 2, 3), "femur_left": (5,), "femur_right": (6,)}
    names = [view.name for view in case.truth.held_out]
    # Frame 3 of subject 1 is left out as in the paper, and too little of a femur is seen in frame 1.
    assert names == [
        "frame 000, pelvis",
        "frame 000, femur_left",
        "frame 000, femur_right",
        "frame 001, pelvis",
        "frame 001, femur_left",
    ]
    assert case.study.warnings == ()


def test_cameras_project_as_the_files_own_matrices_do(case):
    """Stored pictures are seen from behind the detector, and frame 10 must be turned.

    To 1e-6 pixels, because the half voxel of the published poses is a sixth of a pixel here, and went unnoticed.
    """
    points = replica.CENTRE + np.random.default_rng(0).uniform(-60, 60, (20, 3))
    for xray, camera, number in zip(case.study.xrays, case.truth.cameras, (10, 9), strict=True):
        assert np.linalg.det(camera.extrinsic[:3, :3]) == pytest.approx(1)
        assert xray.source_to_detector_mm == pytest.approx(replica.DISTANCE)
        for point in points:
            column, row = replica.stored_pixel(number, point)
            seen = (replica.SIZE - 1 - column, row)
            if number in replica.TURNED:
                seen = (replica.SIZE - 1 - seen[0], replica.SIZE - 1 - seen[1])
            assert pixel_of(camera, point) == pytest.approx(_reduced(seen), abs=1e-6)
        assert (
            camera.project(np.add(replica.CENTRE, [0, 0, 40]))[1] < camera.project(replica.CENTRE)[1]
        )  # the head is up


def test_the_marker_appears_where_the_camera_says_and_values_are_line_integrals(case):
    for xray, camera in zip(case.study.xrays, case.truth.cameras, strict=True):
        centre, radius = replica.MARKER
        expected = pixel_of(camera, centre)
        assert np.abs(spot(xray.image, expected) - expected).max() < 0.3
        assert np.median(xray.image) == pytest.approx(0.4 + np.log(65487 / 65000), abs=0.01)
        column, row = np.rint(expected).astype(int)
        assert xray.image[row, column] > 0.4 + 0.4 * 2 * radius * 0.6


def test_poses_of_the_femurs_are_those_of_the_registered_frames(case):
    assert case.truth.poses["femur_left"] == pytest.approx(np.linalg.inv(replica.FEMUR[9]), abs=1e-6)
    assert case.truth.poses["femur_right"] == pytest.approx(np.eye(4), abs=1e-6)
    assert "pelvis" not in case.truth.poses


def test_held_out_views_do_not_blame_a_motion_for_another_posture(case):
    """The femur of frame 0 lies 15 mm from where frames 9 and 10 have it; the true motion still fits its mask."""
    views = {view.name: view for view in case.truth.held_out}
    view = views["frame 000, femur_left"]
    assert set(view.masks) == {"femur_left"}
    centre, radius = replica.BALLS[5]
    rows, columns = np.nonzero(view.masks["femur_left"])
    middle = np.array([columns.mean(), rows.mean()])
    true = pixel_of(view.camera, moved(replica.FEMUR[9], centre))
    rest = pixel_of(view.camera, centre)
    assert np.abs(middle - true).max() < 0.7 < 2 < np.linalg.norm(middle - rest)
    # And the mask is where the frame shows the femur.
    column, row = replica.stored_pixel(0, moved(replica.FEMUR[0], centre))
    assert np.abs(middle - _reduced((replica.SIZE - 1 - column, row))).max() < 0.7
    magnified = radius * replica.DISTANCE / 750 / (8 * replica.PITCH)
    assert rows.size == pytest.approx(np.pi * magnified**2, rel=0.15)
    pelvis = views["frame 000, pelvis"]
    assert np.allclose(pelvis.pixel_spacing_mm, 8 * replica.PITCH)
    column, row = replica.stored_pixel(0, replica.BALLS[3][0])
    ball = np.rint(_reduced((replica.SIZE - 1 - column, row))).astype(int)
    assert pelvis.masks["pelvis"][ball[1], ball[0]]


@pytest.mark.long
def test_other_frames_can_be_asked_for(file):
    (case,) = deepfluoro.cases(file, "subject01", ["9+0"])
    assert case.views == "9+0" and [xray.name for xray in case.study.xrays] == ["frame 009", "frame 000"]
    assert any("femur_left lies up to" in line for line in case.study.warnings)
    for views in ("2x30", "9+9", "", "9+"):
        with pytest.raises(InputError, match="frame"):
            list(deepfluoro.cases(file, "subject01", [views]))
    with pytest.raises(InputError, match="no frame 77"):
        list(deepfluoro.cases(file, "subject01", ["9+77"]))


@pytest.mark.parametrize("newer", [False, True])
def test_the_folder_of_the_same_subject_gives_the_same_cameras_and_pictures(case, newer, tmp_path):
    """Newer files' poses are turned, which gave cameras that looked away from the patient."""
    origin = np.array([5.0, 7.0, -3.0])
    replica.write_folder(tmp_path, frames=(0, 9, 10), origin=origin, newer=newer, numbers=torch.float64)
    assert deepfluoro.subjects(tmp_path) == ["subject01"]
    (other,) = deepfluoro.cases(tmp_path, "subject01", [])
    points = replica.CENTRE + np.random.default_rng(1).uniform(-60, 60, (9, 3))
    for number in range(2):
        here, there = case.truth.cameras[number], other.truth.cameras[number]
        assert here.project(points) == pytest.approx(
            there.project(points - replica.ORIGIN + origin), abs=1e-6
        )
        assert np.abs(case.study.xrays[number].image - other.study.xrays[number].image).max() < 1e-3
    assert [view.name for view in other.truth.held_out] == ["frame 000, pelvis"] and not other.truth.poses
    assert any("HDF5" in line for line in other.study.warnings)


def test_poses_of_single_precision_are_read(case, tmp_path):
    replica.write_folder(tmp_path, frames=(9, 10), origin=replica.ORIGIN)
    (other,) = deepfluoro.cases(tmp_path, "subject01", [])
    for here, there in zip(case.truth.cameras, other.truth.cameras, strict=True):
        assert here.project(replica.CENTRE) == pytest.approx(there.project(replica.CENTRE), abs=0.01)


def test_the_half_voxel_of_a_folder_does_not_depend_on_the_order_of_its_voxels(case, tmp_path):
    """It is that of the CT that was registered, whatever program has saved the file since."""
    replica.write_folder(tmp_path, frames=(9, 10), origin=replica.ORIGIN, numbers=torch.float64)
    for name in ("volume", "mask"):
        path = tmp_path / f"subject01/{name}.nii.gz"
        sitk.WriteImage(sitk.Flip(sitk.ReadImage(str(path)), (True, True, False)), str(path))
    (other,) = deepfluoro.cases(tmp_path, "subject01", [])
    for here, there in zip(case.truth.cameras, other.truth.cameras, strict=True):
        assert here.project(replica.CENTRE) == pytest.approx(there.project(replica.CENTRE), abs=1e-4)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (np.diag([1.0, 1, 1, 1e-3]), "another unit"),
        (np.diag([-1.0, 1, 1, 1]), "mirror"),
        (np.zeros((4, 4)), "pose"),
    ],
)
def test_a_pose_that_no_convention_explains_is_told_with_its_file(change, told, tmp_path):
    folder = replica.write_folder(tmp_path, frames=(9, 10))
    path = folder / "xrays/009.pt"
    stored = torch.load(path, weights_only=False)
    pose = stored["pose"][0].double().numpy()
    pose[:3, 3] *= change[3, 3]
    pose[:3, :3] = pose[:3, :3] @ change[:3, :3]
    torch.save({**stored, "pose": torch.tensor(pose)[None]}, path)
    with pytest.raises(InputError, match=rf"009\.pt.*{told}"):
        list(deepfluoro.cases(tmp_path, "subject01", []))


@pytest.mark.parametrize(("subject", "number"), [("subject01", 3), ("subject04", 4)])
def test_frames_whose_published_poses_are_questionable_are_refused_and_not_scored(subject, number, tmp_path):
    specimen = {"subject01": "17-1882", "subject04": "18-2799"}[subject]
    path = replica.write_hdf5(tmp_path / "doubted.h5", specimen, frames=(number, 9, 10))
    with pytest.raises(InputError, match=rf"frame {number} of {subject} has a questionable published pose"):
        list(deepfluoro.cases(path, subject, [f"9+{number}"]))
    (case,) = deepfluoro.cases(path, subject, ["10"])
    assert {view.name.split(",")[0] for view in case.truth.held_out} == {"frame 009"}


def _changed(file, tmp_path, change):
    """A copy of the replica, without most of its pictures, that was changed."""
    path = tmp_path / "changed.h5"
    with h5py.File(file) as source, h5py.File(path, "w") as copy:
        source.copy("proj-params", copy)
        subject = copy.create_group("17-1882")
        for name in ("vol", "vol-seg"):
            source.copy(f"17-1882/{name}", subject)
        for number in ("009", "010"):
            source.copy(f"17-1882/projections/{number}", subject.require_group("projections"))
        change(copy)
    return path


def _replaced(name, value):
    def change(copy):
        del copy[name]
        copy[name] = value

    return change


def _of_time(group, name):
    """A dataset of a kind of number that NumPy does not have."""

    def change(copy):
        del copy[group][name]
        kind, size = h5py.h5t.UNIX_D32LE, h5py.h5s.create_simple((3,))
        h5py.h5d.create(copy[group].id, name.encode(), kind, size)

    return change


PELVIS = "17-1882/projections/009/gt-poses/cam-to-pelvis-vol"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (_replaced("17-1882/vol/spacing", [[0.004]] * 3), "unit"),
        (_replaced("proj-params/pixel-col-spacing", 1.94e-4), "unit"),
        (_replaced("proj-params/intrinsic", np.diag([-5.2, -5.2, 1.0])), "unit"),
        (_replaced(PELVIS, np.eye(3)), "shape"),
        (_replaced(PELVIS, np.diag([1.0, 1, 1.2, 1])), "cam-to-pelvis-vol"),
        (_replaced(PELVIS, rigid((1, 0, 0), 0, (9e3, 0, 0))), "CT's middle"),
        (_replaced("17-1882/vol/pixels", np.zeros((5, 5, 5), "f4")), "every voxel"),
        (_replaced("17-1882/vol/pixels", np.zeros((5, 5), "f4")), "dimensions"),
        (_replaced("17-1882/vol/pixels", h5py.Empty("f4")), "no numbers"),
        (_of_time("17-1882/vol", "spacing"), "no numbers"),
        (_replaced("17-1882/vol-seg/image/pixels", np.full((5, 5, 5), 1.5)), "whole numbers"),
        (_replaced("17-1882/vol-seg/image/pixels", np.full((5, 5, 5), 2**31, "u4")), "labels run from"),
        (_replaced("17-1882/vol-seg/image/origin", [[900.0]] * 3), "another grid"),
        (_replaced("17-1882/vol-seg/image/pixels", np.full(replica.SHAPE, 5, "u1")), "nothing of the pelvis"),
        (_replaced("17-1882/projections/009/image/pixels", np.zeros((9, 9), "f4")), "the detector"),
        (_replaced("17-1882/projections/009/image/pixels", np.ones((1536, 1536), "f4")), "no detector's intensities"),
        (lambda copy: copy["17-1882"].pop("vol-seg"), '"vol-seg"'),
        (lambda copy: copy["17-1882/projections"].pop("009"), "no frame 9"),
        (_replaced("17-1882/vol/pixels", h5py.SoftLink("/17-1882/vol-seg/image/pixels")), "link"),
        (_replaced("17-1882/vol/pixels", h5py.ExternalLink("/etc/passwd", "/")), "link"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told(file, tmp_path, change, told):
    with pytest.raises(InputError) as caught:
        list(deepfluoro.cases(_changed(file, tmp_path, change), "subject01", []))
    assert told in str(caught.value) and "changed.h5" in str(caught.value)


def test_a_file_that_disagrees_with_its_own_labels_is_told(file, tmp_path):
    """Pictures that were read mirrored, say, would go unnoticed by everything else."""
    name = "17-1882/projections/009/gt-seg/pixels"
    with h5py.File(file) as source:
        mirrored = source[name][()][:, ::-1]
    (case,) = deepfluoro.cases(_changed(file, tmp_path, _replaced(name, mirrored)), "subject01", [])
    assert any("frame 009: only" in line for line in case.study.warnings)
    assert not any("frame 010" in line for line in case.study.warnings)


def test_other_files_are_told(file, tmp_path):
    (tmp_path / "a.h5").write_bytes(file.read_bytes()[:5000])
    with h5py.File(tmp_path / "small.h5", "w") as small:
        small["01/projs"] = np.zeros((2, 8, 8))
    for name, told in (("a.h5", "damaged"), ("small.h5", "preprocessed"), ("none.h5", "JHU Data Archive")):
        with pytest.raises(InputError, match=told):
            deepfluoro.subjects(tmp_path / name)
    with pytest.raises(InputError, match="2 HDF5 files"):
        deepfluoro.subjects(tmp_path)
    with pytest.raises(InputError, match='no subject "subject02"'):
        list(deepfluoro.cases(file, "subject02", []))


def test_a_missing_package_is_named_with_the_extra(file, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(h5_values.importlib, "import_module", missing)
    with pytest.raises(InputError, match=r'pip install "polypose\[benchmark\]"'):
        deepfluoro.subjects(file)


def test_poses_are_not_unpickled(tmp_path):
    """A file of torch may run anything when it is unpickled; this one would write a file."""
    import os
    import pickle

    folder = replica.write_folder(tmp_path, frames=(9, 10))

    class Evil:
        def __reduce__(self):
            return os.system, (f"touch {tmp_path / 'ran'}",)

    (folder / "xrays" / "009.pt").write_bytes(pickle.dumps({"pose": Evil()}))
    with pytest.raises(InputError, match="no file of tensors"):
        list(deepfluoro.cases(tmp_path, "subject01", []))
    assert not (tmp_path / "ran").exists()


def test_a_mask_of_the_folder_that_is_no_label_map_is_told(tmp_path):
    """Rounded silently, an image resampled smoothly would become other bones."""
    replica.write_folder(tmp_path, frames=(9, 10))
    mask = tmp_path / "subject01/mask.nii.gz"
    image = sitk.Cast(sitk.ReadImage(str(mask)), sitk.sitkFloat32)
    image[3, 4, 5] = 4.5
    sitk.WriteImage(image, str(mask))
    with pytest.raises(InputError, match=r"mask\.nii\.gz: its labels are not whole numbers"):
        list(deepfluoro.cases(tmp_path, "subject01", []))


def test_a_mask_of_the_folder_without_a_pelvis_is_told_with_its_place(tmp_path):
    replica.write_folder(tmp_path, frames=(9, 10))
    mask = tmp_path / "subject01/mask.nii.gz"
    image = sitk.ReadImage(str(mask))
    sitk.WriteImage(image * (image == 5), str(mask))
    with pytest.raises(InputError, match=r"subject01: the labels hold nothing of the pelvis"):
        list(deepfluoro.cases(tmp_path, "subject01", []))
