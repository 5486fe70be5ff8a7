"""Results: the folder is whole or absent, and comes back as it was."""

import dataclasses
import errno
import json
import os
import subprocess
import sys

import numpy as np
import pytest
import result_case
import SimpleITK as sitk
from result_case import FILES, make_result, random_pose
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.result import StructureResult
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import report
from PolyPoseLib.io.results import load_result, save_result
from PolyPoseLib.io.whole_folders import check_destination
from PolyPoseLib.registration.magnification import at_true_size


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_folder_holds_exactly_what_is_promised(tmp_path):
    result = make_result()
    assert result.save(tmp_path / "out") == tmp_path / "out"
    assert set(contents(tmp_path / "out")) == FILES
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    fields = json.loads((tmp_path / "out" / "result.json").read_text())
    assert fields["version"] == 1
    assert {"fixed_to_moving", "motion", "uncertainty"} <= set(fields["structures"]["femur"])
    assert "uncertainty" not in fields["structures"]["pelvis"]
    assert {"rotation_deg", "translation_mm", "axis"} <= set(fields["structures"]["pelvis"]["motion"])
    assert {"K", "extrinsic", "similarity"} <= set(fields["cameras"][0])
    assert {"seconds", "device", "versions", "warnings", "similarity"} <= set(fields)


def test_a_result_comes_back_as_it_was(tmp_path):
    result = make_result(1)
    result.distrust = ("nothing fits",)
    result.save(tmp_path / "out")
    back = load_result(tmp_path / "out")
    for name, structure in result.structures.items():
        assert np.allclose(back.structures[name].fixed_to_moving, structure.fixed_to_moving, atol=1e-12)
        assert np.allclose(back.structures[name].translation_mm, structure.translation_mm, atol=1e-12)
        assert back.structures[name].uncertainty == structure.uncertainty
    for found, camera in zip(back.cameras, result.cameras, strict=True):
        assert np.allclose(found.extrinsic, camera.extrinsic, atol=1e-12)
        assert (found.height, found.width, found.name) == (camera.height, camera.width, camera.name)
    assert back.history == result.history
    assert (back.seconds, back.device, back.versions) == (result.seconds, result.device, result.versions)
    assert (back.warnings, back.distrust, back.anchor) == (result.warnings, result.distrust, "pelvis")
    assert not back.trusted
    assert np.array_equal(back.warped_ct.voxels, np.rint(result.warped_ct.voxels))
    assert np.array_equal(back.warped_labels.voxels, result.warped_labels.voxels)
    assert back.warped_ct.same_grid(result.warped_ct, 1e-3)
    assert np.array_equal(back.transform.vectors, result.transform.vectors)
    assert np.allclose(back.renderings_after, result.renderings_after)


def test_what_carries_points_comes_back_and_earlier_folders_lack_it(tmp_path):
    result = make_result(4)
    folder = result.save(tmp_path / "out")
    back = load_result(folder)
    assert np.array_equal(back.structure_labels.voxels, result.structure_labels.voxels)
    assert back.structure_labels.same_grid(result.structure_labels, 1e-3)
    assert np.array_equal(back.inverse_transform.vectors, result.inverse_transform.vectors)
    assert np.array_equal(back.soft_tissue_deviation_mm, result.soft_tissue_deviation_mm)
    assert back.segmentation_labels == result.segmentation_labels
    inverse = sitk.ReadTransform(str(folder / "inverse_transform.h5"))
    assert np.allclose(
        inverse.TransformPoint((9.0, -9.0, 7.0)), back.inverse_transform(np.array([9.0, -9, 7])), atol=1e-4
    )
    for name in FILES - {"report.png"}:
        assert name.replace("0", "N").replace("1", "N") in (folder / "README.txt").read_text() + "README.txt"
    fields = json.loads((folder / "result.json").read_text())
    del fields["soft_tissue_deviation_mm"], fields["segmentation_labels"]
    (folder / "result.json").write_text(json.dumps(fields))
    (folder / "inverse_transform.h5").unlink()
    (folder / "structures.nii.gz").unlink()
    earlier = load_result(folder)
    assert earlier.inverse_transform is None and earlier.structure_labels is None
    assert earlier.soft_tissue_deviation_mm is None and earlier.segmentation_labels is None
    earlier.save(tmp_path / "again")
    assert not (tmp_path / "again" / "structures.nii.gz").exists()


@pytest.mark.parametrize(("low", "high"), [(-1, 2), (0, 3)])
def test_structures_that_result_json_does_not_list_are_refused(tmp_path, low, high):
    result = make_result()
    labels = result.structure_labels.voxels.copy()
    labels[0, 0, :2] = low, high
    result.save(tmp_path / "out")
    image = sitk.GetImageFromArray(labels)
    sitk.WriteImage(image, str(tmp_path / "out" / "structures.nii.gz"))
    with pytest.raises(InputError, match=r"structures\.nii\.gz.*damaged"):
        load_result(tmp_path / "out")


def test_doubts_come_back_and_are_absent_where_there_are_none(tmp_path):
    result = make_result()
    doubts = ("metal hides it in X-ray 2", "only X-ray 1 shows it")
    result.structures["femur"] = dataclasses.replace(result.structures["femur"], doubts=doubts)
    save_result(result, tmp_path / "result")
    structures = json.loads((tmp_path / "result" / "result.json").read_text())["structures"]
    assert structures["femur"]["doubts"] == list(doubts) and "doubts" not in structures["pelvis"]
    loaded = load_result(tmp_path / "result").structures
    assert (loaded["femur"].doubts, loaded["pelvis"].doubts) == (doubts, ())
    assert at_true_size(result, 4.0).structures["femur"].doubts == doubts


def test_the_transform_is_an_itk_transform_from_fixed_to_moving(tmp_path):
    result = make_result(2)
    result.save(tmp_path / "out")
    transform = sitk.ReadTransform(str(tmp_path / "out" / "transform.h5"))
    index = np.random.default_rng(0).uniform(0.1, 0.9, (20, 3)) * (np.array(result.transform.shape[::-1]) - 1)
    points = index @ result.transform.affine[:3, :3].T + result.transform.affine[:3, 3]
    for point in points:
        assert np.allclose(transform.TransformPoint(point.tolist()), result.transform(point), atol=1e-4)


def test_motion_is_that_of_the_bone_from_the_ct_to_the_xrays():
    rng = np.random.default_rng(3)
    for _ in range(50):
        pose, centroid = random_pose(rng, 170), rng.uniform(-200, 200, 3)
        found = StructureResult.from_pose(pose, centroid)
        in_fixed = np.linalg.inv(pose) @ [*centroid, 1]
        assert np.allclose(centroid + found.translation_mm, in_fixed[:3])
        turn = Rotation.from_rotvec(np.radians(found.rotation_deg) * found.axis).as_matrix()
        assert np.allclose(turn, pose[:3, :3].T, atol=1e-9)
    still = StructureResult.from_pose(np.eye(4), np.ones(3))
    assert still.rotation_deg == 0
    assert np.isclose(np.linalg.norm(still.axis), 1)


def test_numbers_that_are_not_finite_become_null(tmp_path):
    result = make_result()
    result.cameras[0] = dataclasses.replace(result.cameras[0], similarity=float("nan"))
    result.history.append({"stage": "x", "iteration": 0, "similarity": float("inf")})
    result.save(tmp_path / "out")
    text = (tmp_path / "out" / "result.json").read_text()
    assert "NaN" not in text
    assert "Infinity" not in text
    assert np.isnan(load_result(tmp_path / "out").cameras[0].similarity)


def test_an_existing_folder_is_refused_unless_it_may_be_replaced(tmp_path):
    first, second = make_result(4), make_result(5, views=1)
    (tmp_path / "out").mkdir()
    first.save(tmp_path / "out")
    before = contents(tmp_path / "out")
    with pytest.raises(InputError, match="--overwrite"):
        second.save(tmp_path / "out")
    assert contents(tmp_path / "out") == before
    second.save(tmp_path / "out", overwrite=True)
    assert set(contents(tmp_path / "out")) == FILES - {"xray_1_drr.nii.gz", "xray_1.nii.gz"}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_nothing_but_results_is_ever_replaced(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.doc").write_text("years of work")
    with pytest.raises(InputError, match=r"thesis\.doc"):
        make_result().save(tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "thesis.doc").read_text() == "years of work"
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="this is a file"):
        make_result().save(tmp_path / "file", overwrite=True)
    with pytest.raises(InputError, match="does not exist"):
        make_result().save(tmp_path / "no" / "out")


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "the disk is full"),
        (errno.EACCES, "not permitted"),
        (errno.EIO, "could not be written"),
    ],
)
@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("kind", ["write_page", "write_picture"])
def test_a_failure_while_writing_leaves_nothing_behind(tmp_path, monkeypatch, number, words, kind, overwrite):
    if overwrite:
        make_result(6).save(tmp_path / "out")
    before = contents(tmp_path / "out") if overwrite else None

    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(report, kind, fail)
    with pytest.raises(InputError, match=words):
        make_result(7).save(tmp_path / "out", overwrite=overwrite)
    assert [path.name for path in tmp_path.iterdir()] == (["out"] if overwrite else [])
    assert not overwrite or contents(tmp_path / "out") == before


def test_an_interrupt_while_writing_leaves_nothing_behind(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "write_picture", interrupt)
    with pytest.raises(KeyboardInterrupt):
        make_result().save(tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="limits of a process are POSIX")
@pytest.mark.parametrize("limit", [200, 2000, 9000])
def test_a_disk_that_is_full_is_noticed_in_every_file(tmp_path, limit):
    code = (
        "import resource, sys; sys.path.insert(0, sys.argv[1])\n"
        "from result_case import make_result\n"
        "from PolyPoseLib.errors import InputError\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), resource.RLIM_INFINITY))\n"
        "try:\n    make_result().save(sys.argv[2])\n"
        "except InputError as error:\n    print('refused', error)\n"
    )
    command = [
        sys.executable,
        "-c",
        code,
        os.path.dirname(result_case.__file__),
        str(tmp_path / "out"),
        str(limit),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith("refused"), done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("damage", ["absent", "json", "version", "field", "volume"])
def test_damaged_results_are_refused_by_name(tmp_path, damage):
    folder = tmp_path / "out"
    make_result().save(folder)
    path = folder / "result.json"
    fields = json.loads(path.read_text())
    if damage == "absent":
        path.unlink()
    elif damage == "json":
        path.write_text("{")
    elif damage == "version":
        path.write_text(json.dumps({**fields, "version": 9}))
    elif damage == "field":
        path.write_text(json.dumps({**fields, "cameras": [{"K": 1}]}))
    else:
        path = folder / "warped_ct.nii.gz"
        path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match=path.name):
        load_result(folder)
    with pytest.raises(InputError, match="no such folder"):
        load_result(tmp_path / "absent")


def test_what_is_saved_is_checked_first(tmp_path):
    check_destination(tmp_path / "new", overwrite=False)
    assert not (tmp_path / "new").exists()


HARD_NAMES = ("$\\frac$", "a$\\x$", "\ud800", "fe\nmur", "\t", "骨盤")


@pytest.mark.parametrize("name", HARD_NAMES)
def test_a_name_that_is_hard_to_draw_does_not_lose_the_result(tmp_path, caplog, name):
    result = make_result()
    result.structures[name] = result.structures.pop("femur")
    result.cameras[0] = dataclasses.replace(result.cameras[0], name=name)
    result.history[0]["stage"] = f"camera {name}"
    result.warnings, result.distrust = [f"{name} is odd"], (f"{name} is odd",)
    with caplog.at_level("WARNING", "PolyPoseLib"):
        result.save(tmp_path / "out")
    assert set(contents(tmp_path / "out")) == FILES and not caplog.records
    assert set(load_result(tmp_path / "out").structures) == {"pelvis", name}


@pytest.mark.parametrize("how", ["no matplotlib", "cannot be drawn", "no folder for settings"])
def test_a_result_is_saved_without_the_picture_when_that_cannot_be_drawn(tmp_path, monkeypatch, caplog, how):
    def half_written(_, path):
        path.write_bytes(b"half")
        raise ValueError("Image size of 1740x80000 pixels is too large.")

    def without_settings(*_):
        raise OSError("Matplotlib requires access to a writable cache directory")

    if how == "no folder for settings":
        monkeypatch.setattr(report, "write_picture", without_settings)
    elif how == "no matplotlib":
        monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    else:
        monkeypatch.setattr(report, "write_picture", half_written)
    with caplog.at_level("WARNING", "PolyPoseLib"):
        make_result().save(tmp_path / "out")
    assert set(contents(tmp_path / "out")) == FILES - {"report.png"}
    words = {"no matplotlib": "pip install matplotlib", "cannot be drawn": "too large"}
    assert words.get(how, "writable cache directory") in caplog.text
    assert "saved without report.png" in caplog.text


def _reordered(folder, change=lambda fields: None):
    """Rewrite result.json with its structures in the opposite order of keys, as any editor of JSON may."""
    path = folder / "result.json"
    fields = json.loads(path.read_text())
    fields["structures"] = dict(reversed(fields["structures"].items()))
    change(fields["structures"])
    path.write_text(json.dumps(fields))


def test_the_label_of_a_structure_does_not_hang_on_the_order_of_keys(tmp_path):
    from carried_case import carried_result

    result = carried_result()
    folder = result.save(tmp_path / "result")
    points = np.array([result.structures["femur"].centroid, [20.0, 30.0, 5.0]])
    expected = load_result(folder).transform_points(points)
    assert "femur" in expected.moved_by
    _reordered(folder)
    found = load_result(folder).transform_points(points)
    assert found.moved_by == expected.moved_by
    np.testing.assert_array_equal(found.points, expected.points)


def test_without_labels_the_order_counts_and_half_of_them_are_refused(tmp_path):
    from carried_case import carried_result

    folder = carried_result().save(tmp_path / "result")
    _reordered(folder, lambda structures: [each.pop("label") for each in structures.values()])
    assert list(load_result(folder).structures) == ["femur", "pelvis"]
    for wrong in (None, 1, 3):
        folder = carried_result().save(tmp_path / f"result{wrong}")
        _reordered(folder, lambda structures, wrong=wrong: structures["femur"].update(label=wrong))
        with pytest.raises(InputError, match=r'damaged.*"label"'):
            load_result(folder)
