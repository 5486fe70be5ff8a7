"""A sequence read from its TRACK.json: what it holds, which files it may name, and what is refused."""

import json
import os

import numpy as np
import pytest
import SimpleITK as sitk
from json_values import assert_one_sentence
from result_case import make_result
from track_case import AFFINE, FRAMES, NAMES, SHAPE, camera, mayacam, picture, write_pictures, write_sequence
from xray_samples import dataset, save

import PolyPoseLib as pp
from PolyPoseLib.data.tracking.sequence import FrameImages
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.sequences import load_sequence

RIGID = [[1, 0, 0, 3], [0, 0, -1, 5], [0, 1, 0, 8], [0, 0, 0, 1]]


def change(path, **fields):
    """Change fields of a TRACK.json; None removes one."""
    given = json.loads(path.read_text())
    given.update(fields)
    path.write_text(json.dumps({name: value for name, value in given.items() if value is not None}))


def change_camera(path, number, **fields):
    given = json.loads(path.read_text())
    entry = {**given["cameras"][number], **fields}
    given["cameras"][number] = {name: value for name, value in entry.items() if value is not None}
    path.write_text(json.dumps(given))


def refused(path, match, **settings):
    with pytest.raises(InputError, match=match) as error:
        load_sequence(path, **settings)
    assert_one_sentence(error)
    assert path.name in str(error.value) or "images" in str(error.value)


@pytest.fixture
def path(tmp_path):
    return write_sequence(tmp_path / "walk")


def test_it_holds_what_the_file_says(path):
    change(
        path,
        still=["tibia", "tibia"],
        initial_poses={"talus": RIGID},
        landmarks={"talus.medial_malleolus": [1, 2, 3]},
        joints=[{"name": "ankle", "proximal": "tibia", "distal": "talus"}],
        options={"first": 1, "smooth": True},
    )
    sequence = pp.load_sequence(path)
    assert sequence.structures.names == NAMES and np.allclose(sequence.ct.affine, AFFINE)
    assert sequence.frames_per_second == 50 and sequence.reference == "tibia" and sequence.still == ("tibia",)
    assert np.array_equal(sequence.initial_poses["talus"], RIGID)
    assert np.array_equal(sequence.landmarks["talus.medial_malleolus"], [1, 2, 3])
    assert sequence.frames == range(1, FRAMES) and sequence.options.smooth
    assert np.array_equal(np.unique(sequence.source_segmentation.voxels), [0, 1, 2])
    assert sequence.label_names == {}
    for number, view in enumerate(sequence.views):
        assert view.name == f"camera {number + 1}" and view.images.count == FRAMES
        assert np.allclose(view.camera.extrinsic, camera(number).extrinsic)
        assert np.allclose(view.camera.intrinsics, camera(number).intrinsics)
        image, mask = view.images.read(3)
        assert np.corrcoef(image.ravel(), picture(number, 3).ravel())[0, 1] > 0.99999
        assert mask.shape == SHAPE
    protocol: FrameImages = sequence.views[0].images
    assert protocol.count == FRAMES


def test_a_table_names_its_labels(path):
    change(path, label_table="totalsegmentator_v2")
    assert pp.load_sequence(path).label_names[25] == "sacrum"


def test_what_is_odd_about_joints_is_said_before_the_tracking(path, caplog):
    joint = {
        "name": "ankle",
        "proximal": "tibia",
        "distal": "talus",
        "convention": "isb_ankle",
        "side": "left",
    }
    change(path, joints=[joint], landmarks={"tibia.medial_plateau": [1, 2, 3]})
    load_sequence(path)
    assert '"tibia.medial_malleolus" is missing' in caplog.text


def test_options_of_the_caller_win(path):
    change(path, options={"first": 1, "last": 4, "threads": 7})
    sequence = load_sequence(path, options={"last": 2, "smooth": True})
    assert sequence.frames == range(1, 3) and sequence.options.threads == 7 and sequence.options.smooth
    refused(path, "first <= last", options={"last": 0})


def test_the_scale_is_decided_on_tracked_frames_alone(path):
    """What comes before the first frame and after the last changes nothing in between."""
    whole = load_sequence(path, options={"first": 1, "last": 4}).views[0].images.read(2)[0]
    for number in (7, 12):  # the names of the first and the last image
        bright = np.full(SHAPE, 65535, np.uint16)
        bright[::7] = 0
        sitk.WriteImage(sitk.GetImageFromArray(bright), str(path.parent / f"cam0/im{number}.png"))
    assert np.array_equal(
        load_sequence(path, options={"first": 1, "last": 4}).views[0].images.read(2)[0], whole
    )
    assert not np.array_equal(load_sequence(path).views[0].images.read(2)[0], whole)
    late = load_sequence(path, options={"first": 1}).views[0].images.read(2)[0]
    (path.parent / "cam0/im12.png").write_bytes((path.parent / "cam0/im11.png").read_bytes())
    assert not np.array_equal(load_sequence(path, options={"first": 1}).views[0].images.read(2)[0], late)


def test_cameras_may_begin_at_different_images(path):
    change_camera(path, 0, first=2)
    sequence = load_sequence(path)
    assert sequence.available == FRAMES - 2
    assert any("different numbers of images" in line for line in sequence.warnings)
    change(path, options={"first": FRAMES - 1})
    refused(path, 'The camera "camera 1" has 6 images, none of them in the range')


def test_one_camera_is_enough_and_is_flagged(path):
    change(path, cameras=json.loads(path.read_text())["cameras"][:1])
    assert any("one camera only" in line for line in load_sequence(path).warnings)


def test_cameras_of_a_registration_are_taken_by_name(path):
    result = make_result()
    result.cameras[:] = [
        type(result.cameras[0])(camera(number), 0.5, name) for number, name in enumerate(("left", "right"))
    ]
    result.renderings_after[:] = [np.zeros(SHAPE, np.float32)] * 2
    result.xray_images[:] = result.renderings_after
    pp.save_result(result, path.parent / "result", report=False)
    for place in ("result", "result/result.json"):
        change(path, cameras_from=place)
        for number, name in enumerate(("right", "left")):
            change_camera(path, number, name=name, calibration=None)
        sequence = load_sequence(path)
        assert np.array_equal(sequence.views[0].camera.extrinsic, camera(1).extrinsic)
        assert np.array_equal(sequence.views[1].camera.intrinsics, camera(0).intrinsics)
    change_camera(path, 0, name="rigth")
    refused(path, 'did you mean "right"')
    change_camera(path, 0, name="right", extrinsic=RIGID)
    refused(path, "both say where the camera stands")
    change_camera(path, 0, extrinsic=None)
    small = write_pictures(path.parent / "small", 5, frames=FRAMES)
    for number, each in enumerate(sorted(small.iterdir())):
        sitk.WriteImage(sitk.GetImageFromArray(picture(5, number, (30, 50))), str(each))
    change_camera(path, 0, images="small")
    refused(path, "took 50 x 40 pixels, but these images have 50 x 30")
    (path.parent / "result" / "result.json").write_text("{}")
    with pytest.raises(InputError, match="register again"):
        load_sequence(path)


@pytest.mark.parametrize("field", ["images", "calibration", "mask"])
def test_no_file_of_a_camera_lies_outside(path, tmp_path, field):
    write_pictures(tmp_path / "outside", 8)
    (tmp_path / "cam.txt").write_text(mayacam(camera(0)))
    names = {"images": "outside", "calibration": "cam.txt", "mask": "outside/im7.png"}
    for name in (f"../{names[field]}", str(tmp_path / names[field])):
        change_camera(path, 0, **{field: name})
        refused(path, "outside the study's folder")
        assert load_sequence(path, allow_outside=True).views[0].images.count == FRAMES


@pytest.mark.parametrize("field", ["ct", "segmentation", "cameras_from"])
def test_no_other_file_lies_outside(path, tmp_path, field):
    (path.parent / "ct.nii.gz").rename(tmp_path / "ct.nii.gz")
    change(path, **{field: "../ct.nii.gz"})
    refused(path, "outside the study's folder|no such file")


def test_links_of_a_folder_that_lead_outside_are_refused(path, tmp_path):
    secret = tmp_path / "secret.png"
    (path.parent / "cam0" / "im7.png").rename(secret)
    os.symlink(secret, path.parent / "cam0" / "im7.png")
    refused(path, 'reads "im7.png" outside')


def test_images_that_two_cameras_share_are_refused(path):
    change_camera(path, 1, images="cam0")
    refused(path, "the same images")
    for each in (path.parent / "cam0").iterdir():
        (path.parent / "cam1" / each.name).write_bytes(each.read_bytes())
    change_camera(path, 1, images="cam1")
    refused(path, "the same picture")


def test_structures_that_are_not_there_are_left_out_but_not_the_reference(path):
    change(path, structures={"tibia": [1], "talus": [2], "femur": [9]}, still=["femur"],
           initial_poses={"femur": RIGID})  # fmt: skip
    sequence = load_sequence(path)
    assert sequence.structures.names == NAMES and not sequence.still and not sequence.initial_poses
    change(path, reference="femur")
    refused(path, '"femur"')


def test_one_frame_is_a_sequence_and_none_is_not(path):
    change(path, options={"first": 2, "last": 2})
    assert load_sequence(path).frame_count == 1
    for number in range(2):
        for each in (path.parent / f"cam{number}").iterdir():
            each.unlink()
    refused(path, "no image")


def test_a_frame_rate_is_compared_with_dicoms(path):
    stack = np.stack([picture(7, frame) % 4000 for frame in range(FRAMES)]).astype(np.uint16)
    for rate, name in ((20.0, "FrameTime"), (1000 / 30, "FrameTime"), (25, "CineRate"), (50, "CineRate")):
        value = rate if name == "FrameTime" else int(rate)
        save(dataset(stack, "XA", **{name: value}), path.parent / "run.dcm")
        change_camera(path, 0, images="run.dcm", intensity=None)
        odd = [line for line in load_sequence(path).warnings if "frames per second" in line]
        assert len(odd) == (value not in (20.0, 50)), odd


def test_narrow_views_are_flagged(path):
    for number in range(2):
        found = camera(0)
        (path.parent / f"cam{number}.txt").write_text(mayacam(found))
    assert any("within 0 degrees" in line for line in load_sequence(path).warnings)


def test_no_warning_names_a_file(path):
    (path.parent / "cam0" / "Doe_Jane.txt").write_text("x")
    change_camera(path, 1, intensity=None)
    warnings = load_sequence(path).warnings
    assert any("were left out" in line for line in warnings) and any(
        "gray levels" in line for line in warnings
    )
    assert not any("Doe" in line or "cam0" in line or "im7" in line for line in warnings)
