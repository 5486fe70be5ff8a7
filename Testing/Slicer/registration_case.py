"""A scene with inputs, and registrations of it by real child processes of our own."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import children
import scenes
import slicer
from PolyPoseSlicer import calls
from PolyPoseSlicer.process import registration
from PolyPoseSlicer.process.registration import State
from PolyPoseSlicer.study.results import OutputNodes
from slicer_case import SlicerTestCase

GIVE_RESULT = "import shutil\ntell(1)\ntell(2, similarity=0.8)\nshutil.copytree('{folder}', output)\n"
STRUCTURES = {"pelvis": ["pelvis"], "femur": ["femur"]}


class RegistrationCase(SlicerTestCase):
    """A scene with inputs, and a way to run a child of our own on them."""

    def setUp(self) -> None:
        super().setUp()
        self.ct = scenes.add_ct(scenes.affine(left_handed=True, tilt_deg=10.0))
        self.segmentation = scenes.add_segmentation(self.ct)
        self.xrays = [scenes.add_xray("AP"), scenes.add_xray("lateral")]

    def tearDown(self) -> None:
        self.assertEqual(registration.leftover_folders(), [], "temporary folders were left")
        super().tearDown()

    def start(self, body: str, nodes: OutputNodes | None = None, **options) -> registration.Registration:
        inputs = (self.ct, self.segmentation, STRUCTURES, self.xrays, "pelvis", nodes or OutputNodes())
        run = calls.start(calls.Request(*inputs, **options), children.command(self.folder, body))
        self.addCleanup(run.close)
        return run

    def start_with_result(self, **changes) -> registration.Registration:
        folder = scenes.save_result(
            self.folder / "given", ct_affine=scenes.affine(left_handed=True, tilt_deg=10.0), **changes
        )
        return self.start(GIVE_RESULT.format(folder=folder))

    def wait_for(self, run: registration.Registration, state: State, seconds: float = 45.0) -> None:
        deadline = time.monotonic() + seconds
        while run.poll() is not state:
            self.assertFalse(run.state.ended, f"ended as {run.state}: {run.error}")
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    @contextlib.contextmanager
    def nothing_added(self) -> Iterator[None]:
        before = slicer.mrmlScene.GetNumberOfNodes()
        yield
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), before)
