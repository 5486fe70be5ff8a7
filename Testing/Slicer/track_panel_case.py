"""The panel with CT, bones and X-ray sequences, and children that track them."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any
from unittest import mock

import children
import numpy as np
import scenes
import slicer
import track_scene_case
import vtk
from panel_case import PanelCase
from PolyPoseSlicer.process import track_run
from PolyPoseSlicer.process.track_folder import PREFIX, TRACKS
from PolyPoseSlicer.scene.frames import from_vtk, to_vtk
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.track_request import TrackSettings
from PolyPoseSlicer.study.xray_source import XraySource

FRAMES = track_scene_case.FRAMES
STEPS = """
for n in range({frames} + 1):
    tell(n, of={frames}, stage="tracking", similarity=0.9)
"""
GIVE_TRACK = STEPS + "import shutil\nshutil.copytree({folder!r}, output)\n"
TELL = """
Path({folder!r}, "arguments.json").write_text(json.dumps(arguments))
Path({folder!r}, "given.json").write_text(Path(arguments[arguments.index("track") + 1]).read_text())
"""
KEEP_FRAMES = """
sys.path.insert(0, {core!r})
from PolyPoseLib.io.tracking.checkpoint import checkpoint_path, opened_checkpoint
from PolyPoseLib.io.tracking.tracks import load_track
found = load_track({folder!r})
with opened_checkpoint(checkpoint_path(output), "0" * 64, found.names, "--resume" in arguments) as kept:
    for frame in found.frames[len(kept.done) : len(kept.done) + 3]:
        kept.keep(frame)
        tell(kept.kept, of={frames}, stage="tracking", similarity=0.9)
    {then}
"""
"""A run that fits three frames and keeps them as the core does."""


class TrackPanelCase(PanelCase):
    """Two cameras that are known exactly, with a sequence each; frame 0 is image 4 of the second."""

    def setUp(self) -> None:
        super().setUp()
        self.addCleanup(TRACKS.remove)

    def tearDown(self) -> None:
        slicer.mrmlScene.Clear()
        left = [
            each.name for each in Path(slicer.app.temporaryPath).iterdir() if each.name.startswith(PREFIX)
        ]
        self.assertEqual(left, [], "tracks were left")
        super().tearDown()

    def fill_sequences(self, known: bool = True) -> None:
        """A scene that can be tracked."""
        self.ct = scenes.add_ct()
        self.segmentation = scenes.add_segmentation(self.ct)
        self.ui.ctSelector.setCurrentNode(self.ct)
        self.ui.segmentationSelector.setCurrentNode(self.segmentation)
        self.panel.structures.propose()
        names = {"pelvis": "pelvis", "femur": "femur"}
        content = self.segmentation.GetSegmentation()
        ids = {content.GetSegmentIdBySegmentName(name): structure for name, structure in names.items()}
        self.panel.parameters.structures = json.dumps(ids)
        self.panel.parameters.anchor = "pelvis"
        self.xrays = {name: track_scene_case.add_sequence(name) for name in track_scene_case.OFFSETS}
        self.store([self.source(name, known) for name in self.xrays])
        self.ui.motionSection.collapsed = False

    def source(self, name: str, known: bool = True, **changes: Any) -> XraySource:
        """The row of a camera."""
        number = list(track_scene_case.OFFSETS).index(name)
        camera = track_scene_case.camera(number)
        fields = {
            "name": name,
            "intrinsics": camera.intrinsics.tolist(),
            "extrinsic": camera.extrinsic.tolist(),
        }
        if known:
            fields["camera"] = "known"
        given = {"frame": track_scene_case.OFFSETS[name], "fields": fields, **changes}
        return XraySource(self.xrays[name], **given)

    def store(self, sources: list[XraySource]) -> None:
        """Put rows into the table."""
        parameters.store_xray_sources(self.panel.parameters, sources)

    @property
    def settings(self) -> TrackSettings:
        """What the parameter node has."""
        return TrackSettings.of(self.panel.parameters.tracking)

    @property
    def button(self) -> str:
        """What the button says."""
        return self.ui.trackButton.text

    def tracker(self, body: str) -> None:
        """Let trackings of this test run a program of our own."""
        program = children.command(self.folder, body)
        script = self.folder / "tracker"
        script.write_text(f'#!/bin/sh\nexec "{program[0]}" "{program[1]}" "$@"\n')
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        patch = mock.patch.object(track_run, "python_executable", lambda: str(script))
        patch.start()
        self.addCleanup(patch.stop)

    def give_track(self, before: str = "", after: str = "", found: Any = None) -> Path:
        """Let trackings of this test end with a ready track; returns its folder."""
        count = len(list(self.folder.glob("track*")))
        folder = track_scene_case.save(self.folder / f"track{count}", found)
        self.tracker(before + GIVE_TRACK.format(folder=str(folder), frames=FRAMES) + after)
        return folder

    def keep_frames(self, then: str) -> None:
        """Let trackings of this test keep three frames and then do something else."""
        folder = self.folder / "kept"
        if not folder.exists():
            track_scene_case.save(folder)
        core = str(Path(track_run.__file__).resolve().parents[3])
        self.tracker(KEEP_FRAMES.format(core=core, folder=str(folder), frames=FRAMES, then=then))

    def told(self) -> tuple[list[str], dict[str, Any]]:
        """The arguments of the last child of `tell`, and the TRACK.json that it was given."""
        arguments = json.loads((self.folder / "arguments.json").read_text())
        return arguments, json.loads((self.folder / "given.json").read_text())

    @property
    def tell(self) -> str:
        """A child's first lines, which keep what it was called with."""
        return TELL.format(folder=str(self.folder))

    def end(self) -> None:
        """Wait for the tracking's end."""
        self.wait(lambda: not self.panel.tracking.running)

    def move(self, name: str, motion: np.ndarray) -> None:
        """Move a bone by hand as its handles do; motion: (4, 4) RAS mm."""
        node = self.panel.track_review.nodes.transforms[name]
        now = vtk.vtkMatrix4x4()
        node.GetMatrixTransformToParent(now)
        node.SetMatrixTransformToParent(to_vtk(motion @ from_vtk(now)))
