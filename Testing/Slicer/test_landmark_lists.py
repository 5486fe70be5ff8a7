"""Lists of landmarks as nodes: frames of pixels, pairs, and the camera that follows from them."""

from __future__ import annotations

import json
import unittest
from dataclasses import replace
from types import SimpleNamespace

import landmark_case
import numpy as np
import scenes
import slicer
from PolyPoseSlicer.scene import landmark_lists, pixel_frames, xray_views
from PolyPoseSlicer.study import landmark_fit
from PolyPoseSlicer.study.camera_source import CameraSource
from PolyPoseSlicer.study.xray_reading import read_source
from PolyPoseSlicer.study.xray_source import XraySource
from slicer_case import SlicerTestCase

from PolyPoseLib.geometry.camera import Camera


def xray_of(camera: Camera, mirrored: bool = False) -> SimpleNamespace:
    """What a fit needs to know of an X-ray, as seen from the source."""
    image = np.zeros((camera.height, camera.width), np.float32)
    return SimpleNamespace(image=image, intrinsics=camera.intrinsics, mirrored=mirrored)


def moved(rng: np.random.Generator) -> np.ndarray:
    """A rigid motion of RAS."""
    matrix = scenes.rotation(tuple(rng.normal(size=3)), rng.uniform(5, 170))
    matrix[:3, 3] = rng.uniform(-90, 90, 3)
    return matrix


class FrameTest(SlicerTestCase):
    def test_pixels_stay_pixels_wherever_the_picture_goes(self) -> None:
        rng = np.random.default_rng(1)
        for mirrored in (False, True):
            camera = landmark_case.random_camera(rng)
            pixels = rng.uniform(0, 29, (5, 2))
            node = landmark_case.add_xray_list(pixels, number=0)
            frame = pixel_frames.frame_above(node)
            for _ in range(4):
                picture = xray_views.XrayPicture(
                    "AP",
                    Camera(
                        camera.intrinsics,
                        landmark_case.random_camera(rng).extrinsic,
                        camera.height,
                        camera.width,
                    ),
                    1000.0,
                    np.zeros((camera.height, camera.width)),
                    mirrored=mirrored,
                )
                xray_views.show_image(0, picture, np.zeros((camera.height, camera.width, 3), np.uint8))
                seen = pixels * [-1, 1] + [camera.width - 1, 0] if mirrored else pixels
                homogeneous = np.column_stack([seen, np.zeros(5), np.ones(5)])
                for n in range(5):
                    np.testing.assert_allclose(
                        node.GetNthControlPointPositionWorld(n),
                        (picture.plane @ homogeneous[n])[:3],
                        atol=1e-6,
                    )
                    np.testing.assert_allclose(node.GetNthControlPointPosition(n)[:2], pixels[n], atol=1e-9)
            # The ray through the shown point meets the pixel again.
            world = np.array(node.GetNthControlPointPositionWorld(0)) * [-1, -1, 1]
            shown = Camera(camera.intrinsics, picture.camera.extrinsic, camera.height, camera.width)
            np.testing.assert_allclose(shown.project(world[None])[0], seen[0], atol=1e-6)
            slicer.mrmlScene.RemoveNode(node)
            slicer.mrmlScene.RemoveNode(frame)

    def test_another_views_frame_stays(self) -> None:
        frame = pixel_frames.new_frame("pixels", 3)
        pixel_frames.place(2, np.diag([2.0, 2, 2, 1]), 10, False)
        self.assertTrue(frame.GetMatrixTransformToParent() is None or _is_identity(frame))
        pixel_frames.place(3, np.diag([2.0, 2, 2, 1]), 10, False)
        self.assertFalse(_is_identity(frame))

    def test_a_list_of_the_world_keeps_its_places_when_it_enters_a_frame(self) -> None:
        rng = np.random.default_rng(2)
        frame = pixel_frames.new_frame("pixels", 0)
        pixel_frames.place(0, moved(rng) @ np.diag([2.0, 3.0, 2.0, 1.0]), 30, True)
        node = landmark_lists.new_list("mine", in_xray=True)
        places = rng.uniform(-100, 100, (4, 3))
        landmark_lists.fill(node, places)
        landmark_lists.put_into_frame(node, frame)
        found = [node.GetNthControlPointPositionWorld(n) for n in range(4)]
        np.testing.assert_allclose(found, places, atol=1e-6)
        self.assertEqual(node.GetNumberOfDefinedControlPoints(), 4)


class PairsTest(SlicerTestCase):
    def names(self, ct: list[str], xray: list[str]) -> landmark_lists.Pairs:
        rng = np.random.default_rng(0)
        return landmark_lists.pairs_of(
            landmark_case.add_ct_list(rng.uniform(-9, 9, (len(ct), 3)), ct),
            landmark_case.add_xray_list(rng.uniform(0, 9, (len(xray), 2)), names=xray),
        )

    def test_equal_names_belong_together_in_any_order(self) -> None:
        pairs = self.names(["a", "b", "c", "d"], ["d", "x", "b"])
        self.assertEqual(pairs.names, ("b", "d"))
        self.assertEqual((pairs.ct_indices, pairs.xray_indices), ((1, 3), (2, 0)))
        self.assertEqual((pairs.ct_alone, pairs.xray_alone), (("a", "c"), ("x",)))

    def test_without_equal_names_the_order_counts(self) -> None:
        pairs = self.names(["F-1", "F-2", "F-3"], ["P-1", "P-2"])
        self.assertEqual((pairs.ct_indices, pairs.xray_indices), ((0, 1), (0, 1)))
        self.assertEqual(pairs.ct_alone, ("F-3",))

    def test_a_name_given_twice_is_used_once(self) -> None:
        pairs = self.names(["a", "a", "b"], ["a", "b", "b"])
        self.assertEqual((pairs.ct_indices, pairs.xray_indices), ((0, 2), (0, 1)))
        self.assertEqual((pairs.ct_alone, pairs.xray_alone), (("a",), ("b",)))

    def test_no_lists_and_points_beside_the_picture(self) -> None:
        self.assertEqual(landmark_lists.pairs_of(None, None).entries(), [])
        ct = landmark_case.add_ct_list(np.eye(3))
        xray = landmark_case.add_xray_list(np.ones((3, 2)))
        xray.SetNthControlPointPosition(1, 5.0, 6.0, 40.0)
        pairs = landmark_lists.pairs_of(ct, xray)
        self.assertEqual((pairs.names, pairs.off_image, pairs.ct_alone), (("1", "3"), ("2",), ("2",)))
        xray.SetAndObserveTransformNodeID(None)
        self.assertEqual(len(landmark_lists.pairs_of(ct, xray).off_image), 3)

    def test_the_point_under_the_mouse_is_none_yet(self) -> None:
        ct = landmark_case.add_ct_list(np.eye(3))
        xray = landmark_case.add_xray_list(np.ones((3, 2)))
        xray.SetNthControlPointPosition(2, 1, 2, 0, slicer.vtkMRMLMarkupsNode.PositionPreview)
        self.assertEqual(landmark_lists.pairs_of(ct, xray).names, ("1", "2"))

    def test_a_point_picked_anew_gets_the_name_that_is_free(self) -> None:
        node = landmark_lists.new_list("list", in_xray=False)
        for _ in range(4):
            node.AddControlPoint([0.0, 0.0, 0.0])
            landmark_lists.name_new_point(node)
        node.RemoveNthControlPoint(1)
        node.AddControlPoint([0.0, 0.0, 0.0])
        landmark_lists.name_new_point(node)
        labels = [node.GetNthControlPointLabel(n) for n in range(4)]
        self.assertEqual(labels, ["1", "3", "4", "2"])
        node.AddControlPoint([0.0, 0.0, 0.0], "sacrum")
        landmark_lists.name_new_point(node)
        self.assertEqual(node.GetNthControlPointLabel(4), "sacrum")

    def test_the_ct_list_counts_as_it_is_shown(self) -> None:
        rng = np.random.default_rng(3)
        points = rng.uniform(-50, 50, (4, 3))
        ct, xray = landmark_case.add_ct_list(points), landmark_case.add_xray_list(rng.uniform(0, 9, (4, 2)))
        matrix = moved(rng)
        ct.SetAndObserveTransformNodeID(scenes.add_transform(matrix).GetID())
        ras = points * [-1, -1, 1] @ matrix[:3, :3].T + matrix[:3, 3]
        np.testing.assert_allclose(landmark_lists.pairs_of(ct, xray).points, ras * [-1, -1, 1], atol=1e-6)


class FitTest(SlicerTestCase):
    def pairs(
        self, rng: np.random.Generator, camera: Camera, count: int, mirrored: bool
    ) -> landmark_lists.Pairs:
        points = landmark_case.points_in_ct(rng, count)
        pixels = camera.project(points)
        if mirrored:
            pixels = pixels * [-1, 1] + [camera.width - 1, 0]
        order = rng.permutation(count)
        names = [str(n + 1) for n in range(count)]
        return landmark_lists.pairs_of(
            landmark_case.add_ct_list(points, names),
            landmark_case.add_xray_list(pixels[order], names=[names[n] for n in order]),
        )

    def test_the_true_camera_comes_back_from_the_scene(self) -> None:
        rng = np.random.default_rng(4)
        for trial in range(12):
            camera = landmark_case.random_camera(rng)
            mirrored = bool(trial % 2)
            pairs = self.pairs(rng, camera, int(rng.integers(5, 9)), mirrored)
            fit = landmark_fit.fit_landmarks(pairs, xray_of(camera, mirrored))
            self.assertEqual((fit.problem, fit.warnings), ("", ()))
            np.testing.assert_allclose(fit.solution.camera.extrinsic, camera.extrinsic, atol=1e-4)
            np.testing.assert_allclose(fit.projected, pairs.pixels, atol=1e-4)
            self.assertIn(
                f"{len(pairs.names)} of {len(pairs.names)} landmarks used, RMS error 0.0 mm",
                landmark_fit.fit_sentence(fit),
            )

    def test_a_wrong_pair_is_named_and_left_out(self) -> None:
        rng = np.random.default_rng(5)
        for _ in range(8):
            camera = landmark_case.random_camera(rng)
            pairs = self.pairs(rng, camera, 8, False)
            wrong = int(rng.integers(8))
            turned = rng.uniform(0, 2 * np.pi)
            pairs.pixels[wrong] += 25 * np.array([np.cos(turned), np.sin(turned)])
            fit = landmark_fit.fit_landmarks(pairs, xray_of(camera))
            self.assertEqual(np.flatnonzero(~fit.solution.inliers).tolist(), [wrong])
            self.assertGreater(fit.solution.errors_px[wrong], 10)
            np.testing.assert_allclose(fit.solution.camera.extrinsic, camera.extrinsic, atol=1e-3)

    def test_too_few_and_degenerate_sets_are_sentences(self) -> None:
        rng = np.random.default_rng(6)
        camera = landmark_case.random_camera(rng)
        fit = landmark_fit.fit_landmarks(self.pairs(rng, camera, 3, False), xray_of(camera))
        self.assertIn("3 of at least 4 pairs: pick 1 more", fit.problem)
        line = landmark_case.CENTER + np.outer(np.linspace(-30, 30, 5), [1.0, 0.3, 0.2])
        pairs = landmark_lists.pairs_of(
            landmark_case.add_ct_list(line), landmark_case.add_xray_list(camera.project(line))
        )
        fit = landmark_fit.fit_landmarks(pairs, xray_of(camera))
        self.assertIsNone(fit.solution)
        self.assertIn("on one line", landmark_fit.fit_sentence(fit))


class EntryTest(SlicerTestCase):
    """What each camera source writes into a study, and that the core reads it."""

    def setUp(self) -> None:
        super().setUp()
        rng = np.random.default_rng(7)
        self.camera = landmark_case.random_camera(rng)
        self.points = landmark_case.points_in_ct(rng, 6)
        self.source = XraySource(
            landmark_case.add_xray_of(self.camera),
            fields={
                **landmark_case.fields_of(self.camera),
                "standard_view": "PA",
                "extrinsic": np.eye(4).tolist(),
            },
            ct_landmarks=landmark_case.add_ct_list(self.points),
            xray_landmarks=landmark_case.add_xray_list(self.camera.project(self.points)),
        )

    def entry(self, camera_source: CameraSource, **changes) -> dict:
        source = replace(self.source, camera_source=camera_source, **changes)
        return json.loads(json.dumps(source.entry("x.nrrd", None)))

    def test_landmarks_of_the_scene_give_the_core_the_true_camera(self) -> None:
        from PolyPoseLib.geometry.pnp import camera_from_landmarks
        from PolyPoseLib.io.xray.landmarks import parse_landmarks

        entry = self.entry(CameraSource.LANDMARKS)
        self.assertFalse({"extrinsic", "standard_view", "camera"} & entry.keys())
        read = parse_landmarks(entry["landmarks"], "entry")
        detector = Camera(np.array(entry["intrinsics"]), np.eye(4), self.camera.height, self.camera.width)
        found = camera_from_landmarks(read.points, read.pixels, detector)
        np.testing.assert_allclose(found.camera.extrinsic, self.camera.extrinsic, atol=1e-3)

    def test_landmarks_of_a_study_come_into_the_scene_and_out_again(self) -> None:
        from PolyPoseSlicer.study import parameters
        from PolyPoseSlicer.study.reader import open_study
        from PolyPoseSlicer.study.writer import read_study, write_study

        ct = scenes.add_ct()
        bones = scenes.add_segmentation(ct)
        source = replace(self.source, camera_source=CameraSource.LANDMARKS)
        data = read_study(ct, bones, {"pelvis": ["pelvis"]}, [source], "pelvis")
        path = write_study(data, self.folder)
        wanted = json.loads(path.read_text())["xrays"][0]["landmarks"]
        slicer.mrmlScene.Clear()
        from PolyPose import PolyPoseLogic

        node = PolyPoseLogic().getParameterNode()
        open_study(path, node)
        opened = parameters.xray_sources(node)[0]
        self.assertIs(opened.camera_source, CameraSource.LANDMARKS)
        found = opened.entry("x.nrrd", None)["landmarks"]
        self.assertEqual([each["name"] for each in found], [each["name"] for each in wanted])
        for key in ("point", "pixel"):
            np.testing.assert_allclose([e[key] for e in found], [e[key] for e in wanted], atol=1e-6)

    def test_each_way_leaves_the_others_out(self) -> None:
        self.assertEqual(self.entry(CameraSource.AUTO)["extrinsic"], np.eye(4).tolist())
        self.assertNotIn("landmarks", self.entry(CameraSource.AUTO))
        searched = self.entry(CameraSource.SEARCH)
        self.assertEqual((searched["camera"], searched["standard_view"]), ("absent", "PA"))
        self.assertFalse({"extrinsic", "landmarks"} & searched.keys())
        self.assertFalse(
            {"extrinsic", "landmarks", "standard_view", "camera"} & self.entry(CameraSource.DICOM).keys()
        )

    def test_a_camera_by_hand_counts_by_hand_only(self) -> None:
        placed = scenes.add_transform(scenes.rotation((1, 2, 3), 40))
        self.assertNotEqual(
            self.entry(CameraSource.CARM, camera_transform=placed)["extrinsic"], np.eye(4).tolist()
        )
        self.assertNotIn("extrinsic", self.entry(CameraSource.SEARCH, camera_transform=placed))

    def test_a_calibrated_camera_is_read_with_its_pose(self) -> None:
        path = self.folder / "camera.csv"
        np.savetxt(path, self.camera.intrinsics @ self.camera.extrinsic[:3], delimiter=",")
        fields = {"source_to_detector_mm": 1000.0, "calibration": str(path)}
        source = replace(self.source, fields=fields, camera_source=CameraSource.CALIBRATION)
        self.assertEqual(source.entry("x.nrrd", None)["calibration_frame"], "ct")
        xray = read_source(source)
        np.testing.assert_allclose(xray.extrinsic, self.camera.extrinsic, atol=1e-6)
        np.testing.assert_allclose(xray.intrinsics, self.camera.intrinsics, atol=1e-6)
        other = read_source(replace(source, camera_source=CameraSource.SEARCH))
        self.assertIsNone(other.extrinsic)
        np.testing.assert_allclose(other.intrinsics, self.camera.intrinsics, atol=1e-6)


def _is_identity(node: slicer.vtkMRMLTransformNode) -> bool:
    import vtk

    matrix = vtk.vtkMatrix4x4()
    node.GetMatrixTransformToParent(matrix)
    return bool(matrix.IsIdentity())


if __name__ == "__main__":
    unittest.main()
