"""Images of a camera become line integrals by one scale for all frames, as a single X-ray by its own would."""

import json

import numpy as np
import pytest
import SimpleITK as sitk
from hypothesis import given
from hypothesis import strategies as st
from json_values import assert_one_sentence
from track_case import SHAPE, camera, mayacam, picture, write_pictures
from xray_samples import dataset, save

from PolyPoseLib.data.tracking.track_inputs import spread
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.cameras import read_camera
from PolyPoseLib.io.xray.read import read_xray

EXTRINSIC = camera(0).extrinsic.tolist()
KNOWN = {"intrinsics": camera(0).intrinsics.tolist(), "extrinsic": EXTRINSIC}


def shaded(number, shape=SHAPE):
    """A bone that grows darker from image to image, over a direct beam that stays."""
    row, column = np.mgrid[: shape[0], : shape[1]]
    lines = (2 + 0.2 * number) * np.exp(-((row - 20) ** 2 + (column - 20) ** 2) / 80) + 0.05
    return np.rint(60000 * np.exp(-lines)).astype(np.uint16)


def write(folder, images):
    folder.mkdir()
    for number, image in enumerate(images):
        sitk.WriteImage(sitk.GetImageFromArray(image), str(folder / f"{number}.png"))
    return folder


@pytest.mark.parametrize("intensity", ["attenuation", "log_transmission", "transmission"])
def test_a_run_of_equal_images_is_converted_as_a_single_xray_is(tmp_path, intensity):
    folder = write(tmp_path / "cam", [shaded(0)] * 4)
    entry = {"images": folder, "intensity": intensity, **KNOWN}
    read = read_camera(entry, "cam", None)
    image, mask = read.view.images.read(2)
    xray = read_xray(folder / "0.png", fields={"intensity": intensity, "camera": "known", **KNOWN})
    np.testing.assert_allclose(image, xray.image, atol=1e-5)
    assert np.array_equal(mask, xray.mask)
    assert np.allclose(read.view.camera.intrinsics, xray.intrinsics)
    assert np.allclose(read.view.camera.extrinsic, xray.extrinsic)


@pytest.mark.parametrize("intensity", ["attenuation", "log_transmission", "transmission"])
def test_the_scale_is_one_for_all_images(tmp_path, intensity):
    """What does not change in the files does not change in the line integrals, whatever else comes into view."""
    stack = [shaded(number) for number in range(12)]
    read = read_camera(
        {"images": write(tmp_path / "cam", stack), "intensity": intensity, **KNOWN}, "cam", None
    )
    images = [read.view.images.read(number)[0] for number in range(12)]
    values, order = np.concatenate([each.ravel() for each in stack]), None
    lines = np.concatenate([each.ravel() for each in images])
    order = np.argsort(values, kind="stable")
    steps = np.diff(lines[order])
    assert (steps <= 1e-6).all() if intensity != "attenuation" else (steps >= -1e-6).all()
    same = values[order][1:] == values[order][:-1]
    assert same.any() and np.abs(steps[same]).max() == 0
    masks = [read.view.images.read(number)[1] for number in range(12)]
    assert all(np.array_equal(mask, masks[0]) for mask in masks)


def test_the_scale_is_that_of_images_spread_over_the_tracked_frames(tmp_path):
    """A bright first image, before the shutter settles, is not looked at when tracking begins after it."""
    stack = [np.full(SHAPE, 65535, np.uint16), *(shaded(number) for number in range(9))]
    stack[0][0, 0] = 0
    folder = write(tmp_path / "cam", stack)
    entry = {"images": folder, "intensity": "transmission", **KNOWN}
    late = read_camera(entry, "cam", None, range(1, 10)).view.images.read(5)[0]
    alone = read_camera(
        {**entry, "images": write(tmp_path / "other", stack[1:])}, "cam", None
    ).view.images.read(4)[0]
    np.testing.assert_array_equal(late, alone)


@given(st.integers(0, 50), st.integers(1, 3000), st.integers(1, 9))
def test_images_that_are_looked_at_are_spread(start, count, most):
    numbers = range(start, start + count)
    chosen = spread(numbers, most)
    assert chosen == sorted(set(chosen)) and len(chosen) == min(most, count)
    assert chosen[0] == start and set(chosen) <= set(numbers)
    assert most == 1 or chosen[-1] == numbers[-1]
    gaps = np.diff(chosen)
    assert not len(gaps) or gaps.max() - gaps.min() <= 1


def test_distortion_is_undone_as_in_a_single_xray(tmp_path):
    stack = [picture(0, number) for number in range(3)]
    folder = write(tmp_path / "cam", stack)
    found = camera(0)
    calibration = tmp_path / "cam.json"
    calibration.write_text(
        json.dumps(
            {
                "intrinsics": found.intrinsics.tolist(),
                "distortion": [9.0, 0, 0.01, 0],
                "rotation": found.extrinsic[:3, :3].tolist(),
                "translation": found.extrinsic[:3, 3].tolist(),
            }
        )
    )
    entry = {"images": folder, "intensity": "attenuation", "calibration": calibration}
    view = read_camera(entry, "cam", None).view
    sitk.WriteImage(sitk.GetImageFromArray(stack[0]), str(tmp_path / "one.png"))
    alone = read_camera({**entry, "images": tmp_path / "one.png"}, "cam", None).view
    xray = read_xray(tmp_path / "one.png", fields={"intensity": "attenuation", "calibration": calibration})
    image, mask = alone.images.read(0)
    np.testing.assert_allclose(image, xray.image, atol=1e-5)
    assert np.array_equal(mask, xray.mask) and not mask.all()
    assert np.array_equal(view.images.read(1)[1], mask)
    assert np.allclose(view.camera.intrinsics, xray.intrinsics)
    assert np.allclose(view.camera.extrinsic, found.extrinsic), "its world is that of the calibration"


def test_mirrored_files_are_seen_from_the_source(tmp_path):
    folder = write(tmp_path / "cam", [shaded(number) for number in range(3)])
    plain = read_camera({"images": folder, "intensity": "attenuation", **KNOWN}, "cam", None).view
    turned = read_camera(
        {"images": folder, "intensity": "attenuation", "mirrored": True, **KNOWN}, "cam", None
    ).view
    assert np.array_equal(turned.images.read(1)[0], plain.images.read(1)[0][:, ::-1])
    assert turned.camera.intrinsics[0, 2] == SHAPE[1] - 1 - plain.camera.intrinsics[0, 2]
    (tmp_path / "cam.txt").write_text(mayacam(camera(0)))
    entry = {
        "images": folder,
        "calibration": tmp_path / "cam.txt",
        "mirrored": True,
        "intensity": "attenuation",
    }
    with pytest.raises(InputError, match="detector's side") as error:
        read_camera(entry, "cam", None)
    assert_one_sentence(error)


def test_a_given_mask_and_a_shutter_hold_for_all_images(tmp_path):
    stack = [shaded(number, (80, 100)) for number in range(4)]
    for image in stack:
        image[:, :20] = 0  # a collimator
    folder = write(tmp_path / "cam", stack)
    entry = {"images": folder, "intensity": "transmission", **KNOWN}
    mask = read_camera(entry, "cam", None).view.images.read(3)[1]
    assert not mask[:, :20].any() and mask[:, 24:].all()
    given_mask = np.zeros((80, 100), np.uint8)
    given_mask[10:70, 30:90] = 1
    sitk.WriteImage(sitk.GetImageFromArray(given_mask), str(tmp_path / "mask.png"))
    mask = read_camera({**entry, "mask": tmp_path / "mask.png"}, "cam", None).view.images.read(3)[1]
    assert np.array_equal(mask, given_mask > 0)


def test_a_bone_may_move_into_what_was_plain_before(tmp_path):
    """Rows of clipped direct beam are no border once anything is seen in them."""
    row, column = np.mgrid[:80, :100]
    stack = []
    for place in np.linspace(15, 85, 9):
        lines = 4 * np.exp(-((row - 40) ** 2) / 2000 - ((column - place) ** 2) / 60)
        stack.append(np.rint(np.clip(65000 - 20000 * lines, 0, 60000)).astype(np.uint16))
    entry = {"images": write(tmp_path / "cam", stack), "intensity": "log_transmission", **KNOWN}
    mask = read_camera(entry, "cam", None).view.images.read(4)[1]
    assert mask[20:60, 10:90].all()


@pytest.mark.parametrize("intensity", ["attenuation", "transmission"])
def test_images_without_exposure_change_neither_scale_nor_mask(tmp_path, intensity):
    """The tube is off at both ends of the run, and in its middle; the collimator stays."""
    shown = [shaded(number, (80, 100)) for number in range(9)]
    for image in shown:
        image[:, :20] = 0 if intensity == "transmission" else 65535
    rng = np.random.default_rng(0)
    dark = [rng.integers(200, 260, (80, 100)).astype(np.uint16) for _ in range(3)]
    entry = {"intensity": intensity, **KNOWN}
    alone = read_camera({**entry, "images": write(tmp_path / "alone", shown)}, "cam", None).view
    stack = [dark[0], *shown[:4], dark[1], *shown[5:], dark[2]]
    mixed = read_camera({**entry, "images": write(tmp_path / "mixed", stack)}, "cam", None).view
    image, mask = alone.images.read(3)
    other, other_mask = mixed.images.read(4)
    assert np.array_equal(mask, other_mask) and not mask[:, :20].any()
    assert np.abs(image - other)[mask].max() < 0.05 * np.ptp(image[mask])


def test_dicom_says_what_its_values_mean_and_where_its_detector_is(tmp_path):
    stack = np.stack([shaded(number) // 16 for number in range(5)]).astype(np.uint16)
    path = save(dataset(stack, "XA"), tmp_path / "run.dcm")
    read = read_camera({"images": path, "extrinsic": EXTRINSIC}, "cam", None)
    xray = read_xray(path, fields={"extrinsic": EXTRINSIC, "mirrored": False, "frame": 2})
    assert np.allclose(read.view.camera.intrinsics, xray.intrinsics)
    image, _ = read.view.images.read(2)
    assert abs(np.corrcoef(image.ravel(), xray.image.ravel())[0, 1]) > 0.9999
    assert any("intensity: pixel intensity relationship LIN" in line for line in read.provenance)


def test_what_is_read_twice_is_not_shared(tmp_path):
    view = read_camera({"images": write_pictures(tmp_path / "cam", 0), **KNOWN}, "cam", None).view
    first, mask = view.images.read(0)
    kept = first.copy()
    first[:], mask[:] = 0, False
    again, mask = view.images.read(0)
    assert np.array_equal(again, kept) and mask.any()


@pytest.mark.parametrize(
    ("entry", "match"),
    [
        ({"extrinsic": None, "intrinsics": None}, "source_to_detector_mm"),
        ({"extrinsic": None}, "nothing says where the camera stands"),
        ({"first": 6}, '"first" is 6, but there are 6 images'),
    ],
)
def test_a_camera_that_is_not_known_is_refused(tmp_path, entry, match):
    given_entry = {
        "images": write_pictures(tmp_path / "cam", 0),
        "intensity": "attenuation",
        **KNOWN,
        **entry,
    }
    with pytest.raises(InputError, match=match) as error:
        read_camera(given_entry, "cam", None)
    assert_one_sentence(error)


def test_a_calibration_of_another_size_is_refused(tmp_path):
    (tmp_path / "cam.txt").write_text(mayacam(camera(0)).replace("50,40", "51,40"))
    folder = write(tmp_path / "cam", [picture(0, n) for n in range(2)])
    with pytest.raises(InputError, match="its calibration is for images of 40 rows x 51 columns") as error:
        read_camera(
            {"images": folder, "calibration": tmp_path / "cam.txt", "intensity": "attenuation"}, "cam", None
        )
    assert_one_sentence(error)


def test_a_round_field_without_a_calibration_is_flagged(tmp_path):
    row, column = np.mgrid[:100, :100]
    outside = (row - 49.5) ** 2 + (column - 49.5) ** 2 > 48**2
    stack = [np.where(outside, 0, shaded(n, (100, 100))).astype(np.uint16) for n in range(3)]
    entry = {"images": write(tmp_path / "cam", stack), "intensity": "transmission", **KNOWN}
    assert any("its field is round" in line for line in read_camera(entry, "cam", None).warnings)
    said = read_camera({**entry, "distortion_corrected": True}, "cam", None).warnings
    assert not any("its field is round" in line for line in said)
