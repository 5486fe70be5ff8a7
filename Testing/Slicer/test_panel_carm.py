"""Placing the C-arm: the numbers, the live rendering by a real child process, and the initial camera that it sets."""

from __future__ import annotations

import json
import sys
import time
import unittest
from collections.abc import Callable

import children
import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.process.render_client import RenderClient, Rendering
from PolyPoseSlicer.process.renderer import Renderer
from PolyPoseSlicer.scene import xray_views
from PolyPoseSlicer.scene.cameras import camera_of
from PolyPoseSlicer.scene.carm_placement import Placement, intrinsics_at
from PolyPoseSlicer.scene.nodes import read_volume
from PolyPoseSlicer.study import parameters
from slicer_case import SlicerTestCase

from PolyPoseLib.geometry.camera import Camera

LIVE_SECONDS = 0.150

SLOW_RENDERER = """
import numpy
print(json.dumps({"ready": True}), flush=True)
for line in sys.stdin:
    request = json.loads(line)
    time.sleep(0.05)
    numpy.full((request["height"], request["width"]), request["id"], "float32").tofile(request["output"])
    print(json.dumps({"id": request["id"], "seconds": 0.05}), flush=True)
"""


class PlacementTest(SlicerTestCase):
    def test_angles_and_table_come_back_from_the_camera(self) -> None:
        rng = np.random.default_rng(5)
        for _ in range(50):
            reference = rng.uniform(-200, 200, 3)
            placement = Placement(
                rng.uniform(-179, 179),
                rng.uniform(-80, 80),
                rng.uniform(-170, 170),
                rng.uniform(400, 900),
                1000.0,
            )
            extrinsic = placement.extrinsic(reference)
            found = Placement.of(extrinsic, 1000.0, reference)
            np.testing.assert_allclose(found.table_mm, 0, atol=1e-6)
            self.assertAlmostEqual(found.source_to_isocenter_mm, placement.source_to_isocenter_mm, places=6)
            moved = Placement(*_numbers(placement)[:3], 700.0, 1000.0, tuple(rng.uniform(-90, 90, 3)))
            again = Placement.of(moved.extrinsic(reference), 1000.0, reference)
            np.testing.assert_allclose(again.extrinsic(reference), moved.extrinsic(reference), atol=1e-6)

    def test_the_table_moves_the_patient(self) -> None:
        still, moved = Placement(), Placement(table_mm=(0.0, 0.0, 50.0))
        point = np.array([0.0, 0.0, 0.0, 1.0])
        shift = (moved.extrinsic(np.zeros(3)) - still.extrinsic(np.zeros(3))) @ point
        np.testing.assert_allclose(
            shift[:3], [0, -50, 0], atol=1e-9
        )  # toward the head is upwards in the image

    def test_intrinsics_follow_the_detector(self) -> None:
        found = intrinsics_at(np.array([[500.0, 0, 10], [0, 400.0, 20], [0, 0, 1]]), 1000.0, 1100.0)
        np.testing.assert_allclose(found, [[550, 0, 10], [0, 440, 20], [0, 0, 1]])


def _numbers(placement: Placement) -> tuple[float, ...]:
    return (placement.primary_deg, placement.secondary_deg, placement.rotation_deg)


class RenderClientTest(SlicerTestCase):
    def client(self, body: str) -> RenderClient:
        client = RenderClient(read_volume(scenes.add_ct()), children.command(self.folder, body))
        self.addCleanup(client.close)
        return client

    def run_until(self, client: RenderClient, done) -> list[Rendering]:
        renderings, deadline = [], time.monotonic() + 20
        while not done(renderings):
            self.assertLess(time.monotonic(), deadline)
            rendering = client.poll()
            if rendering is not None:
                renderings.append(rendering)
            time.sleep(0.002)
        return renderings

    def test_the_newest_request_wins_and_none_is_queued(self) -> None:
        client = self.client(SLOW_RENDERER)
        self.run_until(client, lambda _images: client.ready)
        for _ in range(100):
            client.ask(Camera(np.eye(3), np.eye(4), 4, 5))
        renderings = self.run_until(client, lambda _images: not client.busy)
        self.assertEqual([int(each.image[0, 0]) for each in renderings], [1, 100])
        self.assertEqual([each.number for each in renderings], [1, 100])
        self.assertLess(renderings[-1].seconds, 0.3)

    def test_requests_of_one_purpose_do_not_replace_those_of_another(self) -> None:
        client = self.client(SLOW_RENDERER)
        self.run_until(client, lambda _images: client.ready)
        camera = Camera(np.eye(3), np.eye(4), 4, 5)
        asked = [client.ask(camera, purpose) for purpose in ("a", "a", "b", "a", "b", "c")]
        client.drop("c")
        renderings = self.run_until(client, lambda _images: not client.busy)
        self.assertEqual([each.number for each in renderings], [asked[0], asked[3], asked[4]])

    def test_a_process_that_ends_is_one_sentence(self) -> None:
        client = self.client("print('polypose: no memory is left', file=sys.stderr)\nsys.exit(1)")
        client.ask(Camera(np.eye(3), np.eye(4), 4, 5))
        self.run_until(client, lambda _images: client.error)
        self.assertIn("no memory is left", client.error)

    def test_an_answer_with_an_error_and_rubbish(self) -> None:
        client = self.client(
            "print('rubbish'); print('[1]')\nprint(json.dumps({'ready': True}), flush=True)\n"
            "sys.stdin.readline()\nprint(json.dumps({'id': 1, 'error': 'too large'}), flush=True)\ntime.sleep(60)"
        )
        client.ask(Camera(np.eye(3), np.eye(4), 4, 5))
        self.run_until(client, lambda _images: client.error)
        self.assertEqual(client.error, "too large")

    def test_a_program_that_is_not_there(self) -> None:
        client = RenderClient(read_volume(scenes.add_ct()), [str(self.folder / "nowhere")])
        self.addCleanup(client.close)
        self.run_until(client, lambda _images: client.error)


class RendererTest(SlicerTestCase):
    def setUp(self) -> None:
        super().setUp()
        self.failures: list[str] = []
        self.renderer = Renderer(self.failures.append, children.command(self.folder, SLOW_RENDERER))
        self.addCleanup(self.renderer.close)
        self.ct = scenes.add_ct()
        self.came: list[tuple[str, float]] = []

    def ask(self, name: str, size: int, purpose: str) -> None:
        """Ask for an image of so many rows, which tells it from the others."""
        self.renderer.ask(
            self.ct,
            Camera(np.eye(3), np.eye(4), size, 5),
            lambda image, _seconds: self.came.append((name, len(image))),
            purpose,
        )

    def wait(self, condition: Callable[[], bool]) -> None:
        """Let the event loop run until a condition holds."""
        deadline = time.monotonic() + 30
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            slicer.app.processEvents()
            time.sleep(0.002)

    def finish(self) -> None:
        """Wait for everything that was asked."""
        self.wait(lambda: not self.renderer.busy)
        self.assertEqual(self.failures, [])

    def test_every_image_goes_to_the_request_that_it_answers(self) -> None:
        rng = np.random.default_rng(4)
        sizes: dict[str, int] = {}
        for number in range(40):
            name = f"request {number}"
            sizes[name] = int(rng.integers(2, 60))
            self.ask(name, sizes[name], str(rng.choice(["C-arm", "before"])))
            if rng.random() < 0.3:
                count = len(self.came)
                self.wait(lambda: len(self.came) > count)  # noqa: B023
        self.finish()
        self.assertIn("request 39", [name for name, _rows in self.came])
        for name, rows in self.came:
            self.assertEqual(rows, sizes[name], name)

    def test_what_is_forgotten_does_not_come(self) -> None:
        for name, purpose in (("first", "C-arm"), ("second", "C-arm"), ("other", "before")):
            self.ask(name, 6, purpose)
        self.renderer.forget("C-arm")
        self.finish()
        self.assertEqual([name for name, _rows in self.came], ["other"])


class CarmPanelTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.ui.xraysTable.selectRow(0)

    def live(self) -> None:
        self.ui.carmLive.checked = True
        self.wait(lambda: self.panel.carm.seconds)

    def test_the_sliders_follow_the_xray(self) -> None:
        _intrinsics, extrinsic = scenes.camera_matrix()
        found = self.panel.carm.placement().extrinsic(self.panel.carm.reference())
        np.testing.assert_allclose(found[:3, :3], extrinsic[:3, :3], atol=2e-3)
        np.testing.assert_allclose(found[:3, 3], extrinsic[:3, 3], atol=2.0)

    def test_the_rendering_follows_the_sliders_at_once(self) -> None:
        self.live()
        self.assertIn("ms per image", self.ui.carmStatus.text)
        for step in range(8):
            count = len(self.panel.carm.seconds)
            self.ui.carmSecondary.value = 3 + 2 * step
            self.wait(lambda: len(self.panel.carm.seconds) > count)  # noqa: B023
        self.assertLess(np.median(self.panel.carm.seconds[1:]), LIVE_SECONDS)
        image = xray_views.part(0, "image")
        self.assertEqual(image.GetImageData().GetNumberOfScalarComponents(), 3)
        self.assertIsNotNone(xray_views.part(0, "detector"))
        was = slicer.util.arrayFromVolume(image).copy()
        self.ui.carmOpacity.value = 0
        self.assertTrue((slicer.util.arrayFromVolume(image) != was).any())

    def test_a_rendering_never_lies_over_another_xray(self) -> None:
        self.panel.renderer._command = children.command(self.folder, SLOW_RENDERER)
        self.live()
        drawn = []
        show_image = xray_views.show_image
        xray_views.show_image = lambda number, *rest: (drawn.append(number), show_image(number, *rest))[1]
        self.addCleanup(setattr, xray_views, "show_image", show_image)
        for row in (1, 0, 1):
            self.ui.carmPrimary.value += 3  # a request for the X-ray that is left is under way
            count = len(self.panel.carm.seconds)
            self.ui.xraysTable.selectRow(row)
            drawn.clear()
            self.ui.carmOpacity.value = 40 + row
            self.assertEqual(drawn, [])  # nothing was rendered for this X-ray yet
            self.wait(lambda: len(self.panel.carm.seconds) > count)  # noqa: B023
            xray, _rendering = self.panel.carm._rendering
            self.assertIs(xray, self.panel.xrays.report().xray)
            self.assertEqual(set(drawn), {row})

    def test_use_as_initial_guess_and_back(self) -> None:
        self.ui.carmSecondary.value = 12
        self.ui.carmDetectorDistance.value = 1100
        expected = self.panel.carm.placement().extrinsic(self.panel.carm.reference())
        self.ui.carmUse.click()
        source = parameters.xray_sources(self.panel.parameters)[0]
        np.testing.assert_allclose(camera_of(source.camera_transform).extrinsic, expected, atol=1e-9)
        self.assertEqual(source.fields["camera"], "initial")
        self.assertEqual(source.fields["source_to_detector_mm"], 1100)
        self.assertEqual(self.ui.xraysTable.item(0, 1).text(), "transform")
        entry = json.loads(json.dumps(source.entry("x", None)))
        np.testing.assert_allclose(entry["extrinsic"], expected, atol=1e-9)
        self.ui.carmPrimary.value = 40
        self.ui.carmReset.click()
        self.assertAlmostEqual(self.ui.carmSecondary.value, 12, places=0)

    def test_full_turns_go_on_at_the_other_end(self) -> None:
        for slider in (self.ui.carmPrimary, self.ui.carmRotation):
            for given, shown in ((180, 180), (181, -179), (-185.5, 174.5), (-180, -180), (199, -161)):
                slider.value = given
                self.assertAlmostEqual(slider.value, shown)
        self.ui.carmPrimary.value = 181
        turned = self.panel.carm.placement().extrinsic(np.zeros(3))
        self.ui.carmPrimary.value = -179
        np.testing.assert_allclose(self.panel.carm.placement().extrinsic(np.zeros(3)), turned, atol=1e-9)

    def test_without_a_ct_it_is_said(self) -> None:
        self.live()
        self.ui.ctSelector.setCurrentNode(None)
        self.assertFalse(self.ui.carmLive.enabled)
        self.assertFalse(self.ui.carmLive.checked)
        self.assertIn("CT", self.ui.carmStatus.text)

    def test_a_renderer_that_dies_is_said(self) -> None:
        self.panel.renderer._command = children.command(self.folder, "sys.exit(1)")
        self.ui.carmLive.checked = True
        self.wait(lambda: "cannot be rendered" in self.ui.carmStatus.text)

    def test_torch_stays_out_of_this_process(self) -> None:
        self.live()
        if "torch" in sys.modules:
            self.skipTest("another test of this process has imported torch")
        self.assertNotIn("torch", sys.modules)


if __name__ == "__main__":
    unittest.main()
