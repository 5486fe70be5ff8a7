"""X-rays of a study are different images, however their files are spelt; frames of one run are different images."""

import json
import os

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.paths import require_different_images
from PolyPoseLib.io.volumes import write_volume

SHAPE = (6, 7, 8)


@pytest.fixture
def folder(tmp_path):
    """A CT, labels, two X-rays, a run of three frames, and other names of the first X-ray."""
    rng = np.random.default_rng(0)
    write_volume(Volume(rng.integers(-1000, 1500, SHAPE).astype(np.int16), np.eye(4)), tmp_path / "ct.nii.gz")
    write_volume(Volume(np.ones(SHAPE, np.uint8), np.eye(4)), tmp_path / "labels.nii.gz")
    for name, shape in (("ap", (40, 50)), ("side", (40, 50)), ("run", (3, 40, 50))):
        image = sitk.GetImageFromArray(rng.random(shape).astype(np.float32))
        sitk.WriteImage(image, str(tmp_path / f"{name}.nii.gz"))
    (tmp_path / "deeper").mkdir()
    (tmp_path / "link.nii.gz").symlink_to("ap.nii.gz")
    (tmp_path / "deeper" / "link.nii.gz").symlink_to("../ap.nii.gz")
    os.link(tmp_path / "ap.nii.gz", tmp_path / "hard.nii.gz")
    return tmp_path


def study(folder, *images) -> Study:
    """The study of X-rays (name, frame)."""
    geometry = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4, "camera": "absent"}
    xrays = [
        {"image": str(name), **geometry} | ({} if frame is None else {"frame": frame})
        for name, frame in images
    ]
    fields = {"version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "structures": {"pelvis": [1]}}
    (folder / "study.json").write_text(json.dumps({**fields, "anchor": "pelvis", "xrays": xrays}))
    return Study.load(folder / "study.json")


@pytest.mark.parametrize(
    "spelling",
    [
        "ap.nii.gz",
        "./ap.nii.gz",
        "deeper/../ap.nii.gz",
        "link.nii.gz",
        "deeper/link.nii.gz",
        "hard.nii.gz",
        ...,
    ],
)
def test_one_image_under_two_names_is_refused(folder, spelling):
    second = folder / "ap.nii.gz" if spelling is ... else spelling
    for images in ([("ap.nii.gz", None), (second, None)], [(second, None), ("ap.nii.gz", None)]):
        with pytest.raises(InputError, match=r'"xrays"\[2\] is the same image as "xrays"\[0\]') as error:
            study(folder, images[0], ("side.nii.gz", None), images[1])
        message = str(error.value)
        assert message.startswith(str(folder / "study.json")) and "\n" not in message


def test_copies_are_one_picture_and_frames_of_a_run_are_different_ones(folder):
    (folder / "copy.nii.gz").write_bytes((folder / "ap.nii.gz").read_bytes())
    with pytest.raises(InputError, match=r'"xrays"\[1\] shows the same picture as "xrays"\[0\]'):
        study(folder, ("ap.nii.gz", None), ("copy.nii.gz", None), ("side.nii.gz", None))
    runs = study(folder, ("run.nii.gz", 0), ("./run.nii.gz", 2), ("run.nii.gz", 1)).xrays
    assert not np.array_equal(runs[0].image, runs[1].image)


@pytest.mark.parametrize(("first", "second"), [(1, 1), (None, 1), (1, None), (None, None)])
def test_frames_that_may_be_the_same_are_refused(folder, first, second):
    with pytest.raises(InputError, match='"frame"'):
        require_different_images([(folder / "run.nii.gz", first), (folder / "run.nii.gz", second)])


def test_a_copy_in_another_format_and_grey_scale_is_refused(folder):
    pixels = sitk.GetArrayFromImage(sitk.ReadImage(str(folder / "ap.nii.gz")))
    grey = np.rint(255 * (1 - np.sqrt(pixels))).astype(np.uint8)
    sitk.WriteImage(sitk.GetImageFromArray(grey), str(folder / "copy.png"))
    with pytest.raises(InputError, match=r'"xrays"\[1\] shows the same picture as "xrays"\[0\]'):
        study(folder, ("ap.nii.gz", None), ("copy.png", None))


@pytest.mark.parametrize(
    ("depth", "sentence"), [(1500, "behind the detector at 1000 mm"), (-700, "behind the X-ray")]
)
def test_a_camera_that_cannot_have_taken_its_x_ray_is_refused(folder, depth, sentence):
    study(folder, ("ap.nii.gz", None))
    fields = json.loads((folder / "study.json").read_text())
    pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, depth]]
    fields["xrays"][0] |= {"camera": "known", "extrinsic": pose}
    (folder / "study.json").write_text(json.dumps(fields))
    with pytest.raises(InputError, match=sentence) as error:
        Study.load(folder / "study.json")
    assert str(error.value).startswith(str(folder / "study.json"))
