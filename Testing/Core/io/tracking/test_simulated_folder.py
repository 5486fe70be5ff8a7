"""The folder of a simulated sequence: images within rounding, the truth number for number, tables of poses."""

import json

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from knee_case import knee, knee_sequence
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking import simulated
from PolyPoseLib.io.tracking.given_poses import COLUMNS, read_poses
from PolyPoseLib.io.tracking.sequences import load_sequence
from PolyPoseLib.io.tracking.simulated import write_sequence
from PolyPoseLib.io.tracking.track_truths import is_track_truth, load_track_truth, save_track_truth
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.kinematics.joint_motions import joint_motions
from PolyPoseLib.simulation.sequence_truth import truth_of_sequence


@pytest.fixture(scope="module")
def sequence():
    return knee_sequence(seed=2, frames=3, first=(0, 2), blank={1: (3,)}, pixels=64)


def track_of(sequence):
    """The truth of a sequence as a track that made no error."""
    truth = truth_of_sequence(sequence)
    count = len(truth.names)
    spread, fine = np.tile(np.eye(6) * 1e-6, (count, 1, 1)), ((),) * count
    return Track(
        names=truth.names,
        reference=truth.reference,
        centroids=truth.centroids,
        frames=tuple(
            TrackedFrame(n, poses, spread, np.zeros(count), fine, ("forward",) * count)
            for n, poses in enumerate(truth.poses)
        ),
        frames_per_second=truth.frames_per_second,
        cameras=truth.cameras,
    )


@pytest.mark.parametrize("image_format", ["dicom", "tiff"])
def test_a_folder_says_what_the_sequence_is(sequence, tmp_path, image_format):
    steps = []
    path = write_sequence(sequence, tmp_path, image_format, 980.0, knee().landmarks, steps.append)
    fields = json.loads(path.read_text())
    assert fields["reference"] == "femur" and fields["frames_per_second"] == 30.0
    assert fields["structures"] == {"femur": [1], "tibia": [2], "patella": [3]}
    assert set(fields["landmarks"]) == set(knee().landmarks)
    assert np.array_equal(read_volume(tmp_path / "labels.nii.gz").voxels, knee().structures.labels)
    assert np.abs(read_ct(tmp_path / "ct.nii.gz").voxels - knee().ct.voxels).max() <= 0.5
    for name, pose in sequence.initial_poses.items():
        assert np.allclose(fields["initial_poses"][name], pose)
    assert [camera["first"] for camera in fields["cameras"]] == [0, 2]
    for entry, view in zip(fields["cameras"], sequence.views, strict=True):
        assert np.allclose(entry["extrinsic"], view.camera.extrinsic)
        focal = entry["source_to_detector_mm"] / np.array(entry["pixel_spacing_mm"])
        assert np.allclose(focal, [view.camera.intrinsics[1, 1], view.camera.intrinsics[0, 0]])
    assert [step.iteration for step in steps] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert steps[-1].of == 8


def test_a_folder_is_read_with_its_joints_and_the_knee_bends_as_far_as_was_asked(tmp_path):
    true = knee_sequence(frames=5, amplitude=50.0)
    path = write_sequence(true, tmp_path, "tiff", landmarks=knee().landmarks, joints=knee().joints)
    read = load_sequence(path)
    assert read.joints == knee().joints
    motions = joint_motions(track_of(true), read)
    sources = [(each.proximal_axes.source, each.distal_axes.source) for each in motions]
    assert sources == [("landmarks", "landmarks")] * 2 and not any(each.warnings for each in motions)
    for motion, least in zip(motions, (45.0, 20.0), strict=True):
        assert motion.angle_quantities[0].name == "flexion" and motion.joint.side == "right"
        change = motion.angles_deg[:, 0] - motion.angles_deg[0, 0]
        # There and back, bent being positive; the frame after the last would be the first again.
        assert (
            least < change[2] < 55.0 and abs(change[2] - change[3]) < 1.0 and abs(change[1] - change[4]) < 1.0
        )


def test_dicom_holds_every_frame_at_one_scale(sequence, tmp_path):
    write_sequence(sequence, tmp_path, "dicom")
    for number, view in enumerate(sequence.views, start=1):
        run = pydicom.dcmread(tmp_path / f"view_{number}.dcm")
        assert run.NumberOfFrames == view.images.count and float(run.FrameTime) == pytest.approx(1000 / 30)
        block = run.private_block(0x0011, "POLYPOSE")
        lines = block[2].value * run.pixel_array.astype(float) + block[3].value
        true = np.stack([view.images.read(n)[0] for n in range(view.images.count)])
        assert np.abs(lines - true).max() <= 0.51 * abs(block[2].value)
        assert str(run.PatientName) == "ANONYMOUS"


def test_pictures_are_line_integrals_as_they_are(sequence, tmp_path):
    path = write_sequence(sequence, tmp_path, "tiff")
    assert all(camera["intensity"] == "line_integral" for camera in json.loads(path.read_text())["cameras"])
    for number, view in enumerate(sequence.views, start=1):
        files = sorted((tmp_path / f"view_{number}").iterdir())
        assert len(files) == view.images.count
        for n, file in enumerate(files):
            assert np.array_equal(sitk.GetArrayFromImage(sitk.ReadImage(str(file))), view.images.read(n)[0])


def test_a_truth_is_read_as_it_was_written(sequence, tmp_path):
    truth = truth_of_sequence(sequence)
    save_track_truth(truth, tmp_path / "truth.json")
    for place in (tmp_path, tmp_path / "truth.json"):
        assert is_track_truth(place)
        again = load_track_truth(place)
        assert np.array_equal(again.poses, truth.poses) and np.array_equal(again.centroids, truth.centroids)
        assert again.names == truth.names and again.reference == "femur" and again.unseen == {"view 2": (1,)}
        for name, camera in truth.cameras.items():
            assert np.array_equal(again.cameras[name].extrinsic, camera.extrinsic)
            assert np.allclose(again.points["tibia"], truth.points["tibia"], atol=1e-3)


def test_points_of_the_truth_lie_on_the_bones(sequence):
    truth = truth_of_sequence(sequence)
    for number, name in enumerate(truth.names, start=1):
        index = np.rint(knee().ct.to_index(truth.points[name])).astype(int)[:, ::-1]
        assert (knee().structures.labels[tuple(index.T)] == number).all()
        assert 50 < len(truth.points[name]) <= 500


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: t.pop("structures"), '"structures" is missing'),
        (lambda t: t.update(structures={}), '"structures" is empty'),
        (lambda t: t.update(reference="skull"), '"reference"'),
        (lambda t: t.update(version=9), "version 9"),
        (lambda t: t["structures"]["tibia"]["rig_to_ct"].pop(), "different numbers of frames"),
        (lambda t: t["structures"]["tibia"].update(rig_to_ct=[[[1, 2], [3, 4]]]), "rig_to_ct"),
        (lambda t: t["structures"]["tibia"].update(points=[]), "points"),
        (lambda t: t["structures"]["tibia"].update(centroid=[1, None, 2]), "centroid"),
        (lambda t: t["cameras"]["view 1"].update(width=0), "width"),
        (lambda t: t.update(unseen={"view 1": [-1]}), "unseen"),
        (lambda t: t.update(frames_per_second=0), "frames_per_second"),
        (lambda t: t.update(of="study"), '"of"'),
    ],
)
def test_a_damaged_truth_is_one_sentence(sequence, tmp_path, change, says):
    path = tmp_path / "truth.json"
    save_track_truth(truth_of_sequence(sequence), path)
    fields = json.loads(path.read_text())
    change(fields)
    path.write_text(json.dumps(fields))
    with pytest.raises(InputError) as refusal:
        load_track_truth(path)
    assert says in str(refusal.value) and "truth.json" in str(refusal.value)


def test_what_is_no_truth_of_a_sequence(tmp_path):
    assert not is_track_truth(tmp_path)
    (tmp_path / "truth.json").write_text('{"version": 1, "structures": {}}')
    assert not is_track_truth(tmp_path)
    with pytest.raises(InputError):
        load_track_truth(tmp_path / "absent.json")


def test_too_many_images_for_one_file_are_refused(sequence, tmp_path, monkeypatch):
    monkeypatch.setattr(simulated, "MOST_PIXELS", 1000)
    with pytest.raises(InputError, match='the format "tiff"'):
        write_sequence(sequence, tmp_path, "dicom")
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="png"):
        write_sequence(sequence, tmp_path, "png")


def table_of(poses, names, centroids, path):
    """A poses.csv made with scipy alone."""
    lines = [",".join((*COLUMNS, "doubts"))]
    for frame, row in enumerate(poses):
        for name, pose, centre in zip(names, row, centroids, strict=True):
            motion = np.linalg.inv(pose)
            place = motion[:3, :3] @ centre + motion[:3, 3]
            turn = Rotation.from_matrix(motion[:3, :3]).as_quat()
            numbers = ",".join(f"{each:.9f}" for each in (*place, *turn))
            lines.append(f"{frame},{name},{numbers},nothing")
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("seed", range(3))
def test_a_table_of_poses_is_read(sequence, tmp_path, seed):
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (4, 3, 1, 1))
    poses[..., :3, :3] = Rotation.random(12, rng).as_matrix().reshape(4, 3, 3, 3)
    poses[..., :3, 3] = rng.normal(0, 100, (4, 3, 3))
    names, centroids = sequence.structures.names, knee().structures.centroids(knee().ct.affine)
    table_of(poses, names, centroids, tmp_path / "poses.csv")
    assert np.allclose(read_poses(tmp_path / "poses.csv", names, centroids), poses, atol=1e-5)
    assert read_poses(tmp_path / "poses.csv", names[:1], centroids[:1]).shape == (4, 1, 4, 4)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: text.replace("quaternion_w", "q"), 'lacks the column "quaternion_w"'),
        (lambda text: text.replace("1,tibia", "1,ulna"), 'no row of frame 1 and "tibia"'),
        (lambda text: text.replace("1,tibia", "0,tibia"), "is there already"),
        (lambda text: text.replace("1,tibia", "x,tibia"), 'the frame is "x"'),
        (lambda text: text.replace("1,tibia", "99999999999,tibia"), "the frame is"),
        (lambda text: text.replace("tibia,", "tibia,nan,"), "line 3"),
        (lambda text: text.replace("tibia,", "tibia,,"), "line 3"),
        (lambda text: text.replace("femur", "a").replace("tibia", "b").replace("patella", "c"), "no row of"),
        (lambda text: "", "lacks the column"),
    ],
)
def test_a_damaged_table_is_one_sentence(sequence, tmp_path, change, says):
    names, centroids = sequence.structures.names, knee().structures.centroids(knee().ct.affine)
    path = tmp_path / "poses.csv"
    table_of(sequence.poses, names, centroids, path)
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError) as refusal:
        read_poses(path, names, centroids)
    assert says in str(refusal.value)
