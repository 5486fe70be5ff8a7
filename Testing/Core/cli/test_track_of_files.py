"""A sequence on disk, tracked by the command: poses near the truth, whatever files the images come from."""

import json

import numpy as np
import pytest
import SimpleITK as sitk
from track_case import mayacam

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.geometry.rigid import perturbation_between
from PolyPoseLib.io.tracking.checkpoint import checkpoint_path, frames_left
from PolyPoseLib.io.tracking.tracks import load_track
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom

pytest.importorskip("PolyPoseLib.tracking.follow")
moving_knee = pytest.importorskip("moving_knee")


def write_knee(knee, folder):
    """CT and labels; one camera's images as multi-frame DICOM, the other's as pictures of 16 bits, an image late."""
    write_volume(Volume(np.rint(knee.ct.voxels).astype(np.int16), knee.ct.affine), folder / "ct.nii.gz")
    write_volume(Volume(knee.structures.labels, knee.ct.affine), folder / "labels.nii.gz")
    frames = range(knee.options.frames)
    left = np.stack([knee.image(frame, 0) for frame in frames])
    camera = knee.cameras[0]
    spacing = 1000.0 / camera.intrinsics[0, 0]
    stand = Stand(source_to_detector_mm=1000.0, pixel_spacing_mm=(spacing, spacing))
    write_xray_dicom(folder / "left.dcm", left.astype(np.float32), stand, Storage(bits=16, encoding="log"))
    (folder / "right").mkdir()
    right = np.stack([knee.image(frame, 1) for frame in frames])
    gray = 60000 * (1 - (right - right.min()) / np.ptp(right))  # bone is dark
    for number, image in enumerate([gray[0], *gray]):
        page = sitk.GetImageFromArray(np.rint(image).astype(np.uint16))
        sitk.WriteImage(page, str(folder / "right" / f"f{number}.tif"))
    (folder / "right.txt").write_text(mayacam(knee.cameras[1]))
    fields = {
        "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "reference": "femur", "frames_per_second": 10,
        "structures": {name: [n] for n, name in enumerate(moving_knee.NAMES, start=1)},
        "cameras": [
            {"name": "left", "images": "left.dcm", "extrinsic": camera.extrinsic.tolist(),
             "intrinsics": camera.intrinsics.tolist()},
            {"name": "right", "images": "right", "calibration": "right.txt", "first": 1,
             "intensity": "log_transmission"},
        ],
        "initial_poses": dict(zip(moving_knee.NAMES, knee.poses[0].tolist(), strict=True)),
    }  # fmt: skip
    path = folder / "TRACK.json"
    path.write_text(json.dumps(fields))
    return path


@pytest.mark.long
def test_bones_are_followed_and_an_interrupted_run_finds_the_same(tmp_path, monkeypatch):
    knee = moving_knee.MovingKnee(0, moving_knee.KneeOptions(**{**moving_knee.SMALL, "frames": 4}))
    (tmp_path / "knee").mkdir()
    path = write_knee(knee, tmp_path / "knee")
    command = ["track", str(path), "--threads", "1", "--progress", "none", "--output"]
    assert main([*command, str(tmp_path / "out")]) in (0, 3)
    track = load_track(tmp_path / "out")
    assert track.numbers.tolist() == list(range(knee.options.frames))
    for frame, truth in zip(track.frames, knee.poses, strict=True):
        for k, pose in enumerate(truth):
            off = perturbation_between(pose, frame.poses[k], track.centroids[k])
            # The patella has fifteen pixels.
            most_deg = 12.0 if moving_knee.NAMES[k] == "patella" else 2.0
            assert np.linalg.norm(off[3:]) < 1.0 and np.degrees(np.linalg.norm(off[:3])) < most_deg

    from PolyPoseLib.io.tracking.checkpoint import Checkpoint

    keep = Checkpoint.keep

    def stop_after_two(self, frame):
        keep(self, frame)
        if self.kept == 2:
            raise CancelledError("enough")

    other = tmp_path / "other"
    monkeypatch.setattr(Checkpoint, "keep", stop_after_two)
    assert main([*command, str(other)]) == 130
    monkeypatch.undo()
    assert frames_left(checkpoint_path(other)) == 2 and not other.exists()
    assert main([*command, str(other), "--resume"]) in (0, 3)
    resumed = load_track(other)
    np.testing.assert_array_equal(resumed.poses, track.poses)
    np.testing.assert_array_equal(resumed.covariances, track.covariances)
