"""Rigs of a study: one world for all of their cameras, images as calibrated, and known cameras that fit."""

import json
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK as sitk
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import RigPose, Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

HEIGHT, WIDTH = 40, 50
K = np.array([[400.0, 0, 24.5], [0, 400.0, 19.5], [0, 0, 1]])


def pose(seed: int) -> np.ndarray:
    """A camera (4, 4) some 700 mm away."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    matrix[:3, 3] = np.random.default_rng(seed).normal(size=3) * 30 + (0, 0, 700)
    return matrix


WORLD = pose(99)
"""From the CT to the world in which the rig was calibrated."""


@pytest.fixture
def folder(tmp_path):
    """Two X-rays, and the calibration of each as a projection matrix."""
    for n, name in enumerate(("ap", "side")):
        image = np.random.default_rng(n).random((HEIGHT, WIDTH)).astype(np.float32)
        sitk.WriteImage(sitk.GetImageFromArray(image), str(tmp_path / f"{name}.nii.gz"))
        calibration = {"projection": (K @ (pose(n) @ np.linalg.inv(WORLD))[:3]).tolist()}
        (tmp_path / f"{name}.json").write_text(json.dumps(calibration))
    return tmp_path


def xray(folder, n: int, *, calibrated: bool, placed: bool = False, **fields) -> Xray:
    """One X-ray of the rig, with its calibration file, its extrinsic in the CT's frame, or both."""
    name = ("ap", "side")[n]
    entry = {"image": f"{name}.nii.gz", "name": name, "rig": "biplane", **fields}
    entry |= {"calibration": f"{name}.json"} if calibrated else {"intrinsics": K.tolist()}
    entry |= {"extrinsic": pose(n).tolist()} if placed else {}
    return read_xray(folder / f"{name}.nii.gz", fields=entry)


def study(*xrays: Xray) -> Study:
    ct = Volume(np.random.default_rng(0).integers(-1000, 1500, (3, 4, 5)).astype(np.float32), np.eye(4))
    return Study(ct, Structures(("pelvis",), np.ones(ct.shape, int)), "pelvis", xrays)


def turned(xray: Xray, degrees: float, mm: float) -> Xray:
    """The X-ray with its camera turned about its source, which also moves."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec([0, np.radians(degrees), 0]).as_matrix()
    motion[:3, 3] = [mm, 0, 0]
    return replace(xray, extrinsic=motion @ xray.extrinsic)


@pytest.mark.parametrize("seen", [False, True])
def test_places_told_in_one_world_are_taken(folder, seen):
    own = [xray(folder, n, calibrated=True, placed=seen) for n in range(2)]
    assert [each.rig.frame for each in study(*own).xrays] == ["own", "own"]
    ct = [xray(folder, n, calibrated=False, placed=True) for n in range(2)]
    assert [each.rig.frame for each in study(*ct).xrays] == ["ct", "ct"]
    registered = [xray(folder, n, calibrated=True, calibration_frame="ct") for n in range(2)]
    assert [each.rig.frame for each in study(*registered).xrays] == ["ct", "ct"]


@pytest.mark.parametrize("placed", [False, True])
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_two_worlds_in_one_rig_are_refused(folder, placed, order):
    mixed = [xray(folder, 0, calibrated=True, placed=placed), xray(folder, 1, calibrated=False, placed=True)]
    with pytest.raises(InputError, match='"biplane" mixes two coordinate frames') as error:
        study(*(mixed[n] for n in order))
    assert '"ap"' in str(error.value) and '"side"' in str(error.value)
    study(mixed[0], xray(folder, 1, calibrated=True), replace(mixed[1], rig=None))


def test_known_cameras_that_fit_their_rig_are_taken(folder):
    known = [xray(folder, n, calibrated=True, placed=True, camera="known") for n in range(2)]
    assert len(study(*known).xrays) == 2
    assert len(study(known[0], turned(known[1], 0.9, 0.0)).xrays) == 2
    assert len(study(known[0], turned(known[1], 0.0, 1.9)).xrays) == 2


@pytest.mark.parametrize(("degrees", "mm"), [(1.1, 0), (-170, 0), (180, 0), (0, 2.1), (0, -500), (3, 3)])
@pytest.mark.parametrize("number", [0, 1])
def test_known_cameras_that_contradict_their_rig_are_refused(folder, degrees, mm, number):
    cameras = [xray(folder, n, calibrated=True, placed=True, camera="known") for n in range(2)]
    cameras[number] = turned(cameras[number], degrees, mm)
    with pytest.raises(InputError, match=f"{abs(degrees):.1f} degrees and"):
        study(*cameras)
    initial = replace(cameras[number], camera="initial")
    assert len(study(*(initial if n == number else each for n, each in enumerate(cameras))).xrays) == 2


@pytest.mark.parametrize("wrong", ["nan", "scaled", "far", "small"])
def test_a_place_that_is_none_is_refused(wrong):
    far = np.eye(4)
    far[0, 3] = 1e300
    matrix = {
        "nan": np.full((4, 4), np.nan),
        "scaled": np.diag([2, 2, 2, 1]),
        "far": far,
        "small": np.eye(3),
    }[wrong]
    with pytest.raises(InputError, match='The place in the rig "biplane"'):
        RigPose("biplane", matrix)


@pytest.mark.parametrize(("calibrated", "placed"), [(True, False), (True, True), (False, True)])
def test_two_cameras_at_one_place_are_no_rig(folder, calibrated, placed):
    first, second = (xray(folder, n, calibrated=calibrated, placed=placed) for n in range(2))
    place = first.rig.extrinsic
    nearly = np.eye(4)
    nearly[:3, :3] = Rotation.from_rotvec([0, np.radians(0.5), 0]).as_matrix()
    for extrinsic in (place, np.round(place, 5), nearly @ place):
        for cameras in ([first, second], [second, first]):
            same = [replace(each, rig=RigPose("biplane", extrinsic, first.rig.frame)) for each in cameras]
            with pytest.raises(InputError, match='have the same place in the rig "biplane"') as error:
                study(*same)
            assert '"ap"' in str(error.value) and '"side"' in str(error.value)


@pytest.mark.parametrize(("degrees", "mm"), [(5.0, 0.0), (0.0, 10.0), (180.0, 0.0)])
def test_cameras_apart_by_little_are_a_rig(folder, degrees, mm):
    first, second = (xray(folder, n, calibrated=True) for n in range(2))
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec([0, np.radians(degrees), 0]).as_matrix()
    motion[:3, 3] = [mm, 0, 0]
    apart = replace(second, rig=RigPose("biplane", motion @ first.rig.extrinsic))
    assert len(study(first, apart).xrays) == 2


def mayacam(height: int, width: int) -> str:
    blocks = {
        "image size": f"{width},{height}",
        "camera matrix": "400,0,24.5\n0,400,19.5\n0,0,1",
        "rotation": "1,0,0\n0,1,0\n0,0,1",
        "translation": "0\n0\n700",
    }
    return "\n\n".join(f"{head}\n{body}" for head, body in blocks.items()) + "\n"


def calibration(height: int, width: int) -> str:
    return json.dumps({"intrinsics": K.tolist(), "image_size": [height, width]})


@pytest.mark.parametrize(("write", "ending"), [(mayacam, "txt"), (calibration, "json")])
def test_a_calibration_for_another_image_size_is_refused(folder, write, ending):
    entry = {"image": "ap.nii.gz", "calibration": f"c.{ending}"}
    (folder / f"c.{ending}").write_text(write(HEIGHT, WIDTH))
    np.testing.assert_allclose(read_xray(folder / "ap.nii.gz", fields=entry).intrinsics, K)
    for height, width in ((WIDTH, HEIGHT), (2 * HEIGHT, 2 * WIDTH), (HEIGHT, WIDTH + 1), (480, 640)):
        (folder / f"c.{ending}").write_text(write(height, width))
        with pytest.raises(InputError, match="calibration is for images") as error:
            read_xray(folder / "ap.nii.gz", fields=entry)
        message = str(error.value)
        assert f"{height} rows x {width} columns" in message and f"{HEIGHT} rows x {WIDTH} columns" in message
        own = read_xray(folder / "ap.nii.gz", fields={**entry, "intrinsics": K.tolist()})
        np.testing.assert_allclose(own.intrinsics, K)
