"""A small track with known poses: its folder as the core writes it, and the nodes that it was made from."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scenes
import slicer
from PolyPoseSlicer.study.track_nodes import TrackNodes
from PolyPoseSlicer.study.track_scene import TrackInputs, show_track
from slicer_case import SlicerTestCase

from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.data.tracking.track import Track, TrackedFrame
from PolyPoseLib.geometry.camera import Camera, look_at

FIRST, FRAMES = 3, 8
"""The track begins at frame 3."""

DOUBTFUL, LOST = 5, 7
"""The femur is flagged in the one frame, and lost in the other."""

SHAPE = (40, 30)
NAMES = ("pelvis", "femur")
OFFSETS = {"left": 0, "right": 4}
"""Image of frame 0 of each camera."""

CENTRE = np.array([10.0, -20.0, 30.0])


def camera(number: int) -> Camera:
    """One of two cameras, 70 degrees apart, 800 mm from the CT's middle."""
    angle = np.radians(70 * number)
    place = CENTRE + 800 * np.array([np.sin(angle), -np.cos(angle), 0.1])
    return Camera(np.array([[400.0, 0, 14.5], [0, 400, 19.5], [0, 0, 1]]), look_at(place, CENTRE), *SHAPE)


def pose(bone: int, frame: int) -> np.ndarray:
    """Rig's world to the CT, LPS mm: both bones sway, and the femur turns besides."""
    patient = scenes.rotation((1, 2, 0.5), 2.0 * frame)
    patient[:3, 3] = (1.5 * frame, -frame, 0.5 * frame)
    turn = scenes.rotation((1, 0.2, 0), 6.0 * frame * bone)
    turn[:3, 3] = CENTRE - turn[:3, :3] @ CENTRE
    return np.linalg.inv(patient @ turn)


def track(numbers: Sequence[int] = tuple(range(FIRST, FIRST + FRAMES)), lost: int = LOST) -> Track:
    """Two bones; in one frame the femur is lost, without a pose."""
    frames = []
    for number in numbers:
        poses = np.stack([pose(bone, number) for bone in range(2)])
        if number == lost:
            poses[1] = np.nan
        frames.append(
            TrackedFrame(
                frame=number,
                poses=poses,
                covariances=np.stack([np.diag([1e-4] * 3 + [0.04] * 3)] * 2),
                residuals=np.array([0.1, 0.2]),
                doubts=((), ("the X-rays contradict it",) if number in (DOUBTFUL, lost) else ()),
                sources=("forward", "none" if number == lost else "backward"),
            )
        )
    return Track(
        names=NAMES,
        reference="pelvis",
        centroids=np.array([[-8.0, -22.5, 30.0], [28.0, -20.0, 30.0]]),
        frames=tuple(frames),
        frames_per_second=50.0,
        cameras={name: camera(number) for number, name in enumerate(OFFSETS)},
    )


def save(folder: Path, found: Track | None = None) -> Path:
    """The folder of a track with joint tables, as the core writes them; the usual one is written once and copied."""
    if found is not None:
        return _written(folder, found)
    shutil.copytree(_usual_track(), folder)
    return folder


@functools.cache
def _usual_track() -> Path:
    home = Path(tempfile.mkdtemp(prefix="polypose-track-"))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    return _written(home / "track", track())


def _written(folder: Path, found: Track) -> Path:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.tracking.sequence import Sequence as Tracked
    from PolyPoseLib.data.tracking.sequence import TrackView
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
    from PolyPoseLib.io.tracking.tracks import save_track
    from PolyPoseLib.kinematics.joint_motions import joint_motions

    volume = Volume(scenes.voxels(), scenes.affine())
    labels = np.where(scenes.labels() <= 2, scenes.labels(), 0).astype(np.uint8)
    views = tuple(TrackView(name, each, _Images(), OFFSETS[name]) for name, each in found.cameras.items())
    sequence = Tracked(
        volume,
        Structures(NAMES, labels),
        views,
        found.frames_per_second,
        "pelvis",
        joints=(Joint("hip", "pelvis", "femur"),),
    )
    save_track(found, folder)
    write_joint_tables(found, joint_motions(found, sequence), folder)
    return folder


class _Images:
    """Images that nobody reads."""

    count = 40

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """One image."""
        return np.full(SHAPE, index, np.float32), np.ones(SHAPE, bool)


def add_sequence(name: str, count: int = 20) -> slicer.vtkMRMLSequenceNode:
    """X-rays as Slicer loads them: times in seconds, an image whose every pixel is its number, a browser of its own."""
    sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", f"XA {name}")
    volume = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode")
    for number in range(count):
        slicer.util.updateVolumeFromArray(
            volume, np.full((1, *SHAPE), number, np.float32) + np.eye(*SHAPE, dtype=np.float32) / 2
        )
        sequence.SetDataNodeAtValue(volume, f"{number / 50:.3f}")
    slicer.mrmlScene.RemoveNode(volume)
    browser = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode", f"XA {name} browser")
    browser.AddSynchronizedSequenceNode(sequence)
    return sequence


class TrackCase(SlicerTestCase):
    """A scene with CT, bones and X-rays, and the folder of their track."""

    def setUp(self) -> None:
        super().setUp()
        self.ct = scenes.add_ct()
        self.segmentation = scenes.add_segmentation(self.ct)
        self.xrays = {name: add_sequence(name) for name in OFFSETS}
        self.saved = save(self.folder / "track")
        self.before = self.nodes()

    def nodes(self) -> set[str]:
        """IDs of all nodes."""
        nodes = slicer.mrmlScene.GetNodes()
        return {nodes.GetItemAsObject(number).GetID() for number in range(nodes.GetNumberOfItems())}

    def inputs(self) -> TrackInputs:
        """The nodes of the track."""
        content = self.segmentation.GetSegmentation()
        segments = {name: [content.GetSegmentIdBySegmentName(name)] for name in NAMES}
        return TrackInputs(self.ct, self.segmentation, segments, self.xrays, OFFSETS)

    def show(self, replaced: TrackNodes | None = None) -> TrackNodes:
        """Show the track."""
        shown = show_track(self.saved, self.inputs(), replaced)
        self.addCleanup(shown.release)
        return shown
