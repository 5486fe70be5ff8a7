"""The module as Slicer loads it: its description, its parameter node, scripted use, and scenes saved as .mrb."""

from __future__ import annotations

import json
import os
import sys
import unittest
from unittest import mock

import children
import numpy as np
import scenes
import slicer
import vtk
from PolyPoseSlicer import calls
from PolyPoseSlicer.scene import frames
from PolyPoseSlicer.scene.motions import motions_of
from PolyPoseSlicer.scene.nodes import Grid, read_volume, resample
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.results import OutputNodes
from PolyPoseSlicer.study.xray_source import XraySource
from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase

from PolyPoseLib.errors import InputError


def module():
    """The module object, loaded once."""
    if not hasattr(slicer.modules, "polypose"):
        from harness import modules

        modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
    return slicer.modules.polypose


class ModuleTest(SlicerTestCase):
    def logic(self):
        module()
        import PolyPose

        return PolyPose.PolyPoseLogic()

    def test_description(self) -> None:
        parent = module() if INSIDE_SLICER else module().parent
        self.assertEqual((parent.title, list(parent.categories)), ("PolyPose", ["Registration"]))
        self.assertIn("Research software", parent.helpText)
        self.assertTrue(parent.acknowledgementText)

    def test_there_is_one_parameter_node(self) -> None:
        first, second = self.logic().getParameterNode(), self.logic().getParameterNode()
        first.anchor = "pelvis"
        self.assertEqual(second.anchor, "pelvis")
        nodes = slicer.util.getNodesByClass("vtkMRMLScriptedModuleNode")
        self.assertEqual([each.GetAttribute("ModuleName") for each in nodes].count("PolyPose"), 1)

    def test_what_is_missing_is_said_until_nothing_is(self) -> None:
        logic = self.logic()
        node = logic.getParameterNode()
        ct = scenes.add_ct()
        segmentation = scenes.add_segmentation(ct)
        first, second = segmentation.GetSegmentation().GetSegmentIDs()[:2]
        steps = (
            ("CT", lambda: setattr(node, "ct", ct)),
            ("segmentation", lambda: setattr(node, "segmentation", segmentation)),
            ("structure", lambda: setattr(node, "structures", f'{{"{first}": "hip", "{second}": "leg"}}')),
            ("anchor", lambda: setattr(node, "anchor", "hip")),
            ("X-ray", lambda: parameters.store_xray_sources(node, [XraySource(scenes.add_xray())])),
        )
        for missing, supply in steps:
            self.assertIn(missing, logic.missingInput(node))
            with self.assertRaises(InputError):
                logic.startParameters(node)
            supply()
        self.assertEqual(logic.missingInput(node), "")
        self.assertEqual(parameters.structures_of(node), {"hip": [first], "leg": [second]})

    def test_xrays_are_remembered(self) -> None:
        node = self.logic().getParameterNode()
        camera = scenes.add_transform(np.eye(4))
        given = [
            XraySource(scenes.add_xray(), fields={"source_to_detector_mm": 1020.0}, camera_transform=camera),
            XraySource(path="/somewhere/image.dcm", frame=3),
        ]
        parameters.store_xray_sources(node, given)
        self.assertEqual(parameters.xray_sources(node), given)
        parameters.store_xray_sources(node, given[1:])
        self.assertEqual(parameters.xray_sources(node), given[1:])

    def test_a_scene_saved_as_mrb_reopens_with_everything_in_place(self) -> None:
        logic = self.logic()
        ct = scenes.add_ct(scenes.affine(True, 10.0))
        segmentation = scenes.add_segmentation(ct)
        folder = scenes.save_result(self.folder / "given", ct_affine=scenes.affine(True, 10.0))
        nodes = logic.loadResult(folder, ct, segmentation)
        ct.SetAndObserveTransformNodeID(nodes.transform.GetID())
        node = logic.getParameterNode()
        node.ct, node.segmentation, node.preset = ct, segmentation, parameters.Preset.FAST
        parameters.store_xray_sources(node, [XraySource(scenes.add_xray(), fields={"camera": "initial"})])
        parameters.store_outputs(node, nodes)
        before = self.mapped(nodes.transform)
        camera = slicer.util.arrayFromTransformMatrix(nodes.cameras[1])
        del node, nodes
        path = str(self.folder / "scene.mrb")
        self.assertTrue(slicer.util.saveScene(path))
        slicer.mrmlScene.Clear()
        slicer.util.loadScene(path)
        again = logic.getParameterNode()
        outputs = parameters.outputs_of(again)
        np.testing.assert_allclose(self.mapped(outputs.transform), before, atol=1e-3)
        self.assertIs(again.ct.GetParentTransformNode(), outputs.transform)
        self.assertIs(again.preset, parameters.Preset.FAST)
        self.assertEqual(parameters.xray_sources(again)[0].fields, {"camera": "initial"})
        # Slicer turns a left-handed volume round when it reads it; the voxels stay where they were.
        grid = Grid(scenes.affine(True, 10.0), scenes.SHAPE)
        found = resample(read_volume(outputs.volume), grid, labels=True)
        np.testing.assert_array_equal(found.values, scenes.voxels())
        names = [outputs.segmentation.GetSegmentation().GetNthSegment(n).GetName() for n in range(3)]
        self.assertEqual(names, ["pelvis", "femur", "plate"])
        self.assertEqual(
            outputs.segmentation.GetSegmentation().GetNthSegment(0).GetTerminology(), scenes.TERMINOLOGY
        )
        self.assertEqual(set(motions_of(outputs.motions)), {"pelvis", "femur"})
        self.assertEqual(outputs.similarity.GetTable().GetNumberOfRows(), 9)
        self.assertIs(outputs.plot.GetNthPlotSeriesNode(0), outputs.series)
        self.assertIs(outputs.series.GetTableNode(), outputs.similarity)
        np.testing.assert_allclose(slicer.util.arrayFromTransformMatrix(outputs.cameras[1]), camera)
        self.assertEqual((len(outputs.renderings), outputs.warnings), (2, scenes.WARNINGS))

    def mapped(self, node: slicer.vtkMRMLTransformNode) -> list:
        """Where a transform takes some points."""
        general = vtk.vtkGeneralTransform()
        node.GetTransformFromWorld(general)
        points = np.random.default_rng(2).uniform(-20, 20, (20, 3))
        return [
            general.TransformPoint(*frames.flip_vectors(point + np.array([10, -20, 30]))) for point in points
        ]

    @unittest.skipIf(sys.platform == "win32", "the program is a script of POSIX")
    def test_a_parameter_node_is_registered_by_python_slicer_and_keeps_the_outputs(self) -> None:
        logic = self.logic()
        node = logic.getParameterNode()
        ct = scenes.add_ct()
        node.ct, node.segmentation, node.anchor = ct, scenes.add_segmentation(ct), "hip"
        first, second = node.segmentation.GetSegmentation().GetSegmentIDs()[:2]
        node.structures = json.dumps({first: "hip", second: "leg"})
        parameters.store_xray_sources(node, [XraySource(scenes.add_xray())])
        folder = scenes.save_result(self.folder / "given")
        body = "import shutil\nassert sys.argv[1:4] == ['-m', 'PolyPoseLib', 'register']\ntell(1)\n"
        children.python_slicer(self.folder, body + f"shutil.copytree({str(folder)!r}, output)\n")
        path = os.pathsep.join([str(self.folder), os.environ["PATH"]])
        with mock.patch.dict(os.environ, {"PATH": path}):
            steps = []
            nodes = logic.registerParameters(node, steps.append)
            self.assertEqual([step.iteration for step in steps], [1])
            self.assertIs(node.outputVolume, nodes.volume)
            self.assertEqual(list(node.outputCameras), nodes.cameras)
            count = slicer.mrmlScene.GetNumberOfNodes()
            again = logic.registerParameters(node)
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), count)
        self.assertIs(again.transform, nodes.transform)

    def test_load_result_without_inputs(self) -> None:
        nodes = self.logic().loadResult(scenes.save_result(self.folder / "given"))
        names = [nodes.segmentation.GetSegmentation().GetNthSegment(n).GetName() for n in range(3)]
        self.assertEqual(names, ["Label 1", "Label 2", "Label 3"])
        self.assertEqual(nodes.xrays, [])

    def test_load_result_is_all_or_nothing(self) -> None:
        folder = scenes.save_result(self.folder / "given")
        (folder / "xray_1_drr.nii.gz").write_bytes(b"cut short")
        before = slicer.mrmlScene.GetNumberOfNodes()
        with self.assertRaisesRegex(InputError, "xray_1_drr"):
            self.logic().loadResult(folder)
        with self.assertRaisesRegex(InputError, "no such folder"):
            self.logic().loadResult(self.folder / "nowhere")
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), before)

    def test_a_damaged_result_is_refused_in_a_sentence(self) -> None:
        folder = scenes.save_result(self.folder / "given")
        fields = json.loads((folder / "result.json").read_text())
        first = next(iter(fields["structures"].values()))
        for wrong in ("x", "", [], [1, None, 3]):
            first["motion"]["centroid_mm"] = wrong
            (folder / "result.json").write_text(json.dumps(fields))
            with self.assertRaisesRegex(InputError, r'result\.json: .*"centroid_mm"'):
                self.logic().loadResult(folder)
        del first["motion"]["centroid_mm"]
        (folder / "result.json").write_text(json.dumps(fields))
        transform = bytearray((folder / "transform.h5").read_bytes())
        transform[transform.index(b"GCOL") + 24] = 255  # which keeps the HDF5 library busy for ever
        (folder / "transform.h5").write_bytes(transform)
        with self.assertRaisesRegex(InputError, r"transform\.h5"):
            self.logic().loadResult(folder)

    def test_loading_into_nodes_that_exist_fills_them(self) -> None:
        folder = scenes.save_result(self.folder / "given")
        nodes = calls.load(folder)
        count = slicer.mrmlScene.GetNumberOfNodes()
        again = calls.load(
            folder,
            nodes=OutputNodes(
                **{
                    name: getattr(nodes, name)
                    for name in (
                        "transform",
                        "volume",
                        "segmentation",
                        "motions",
                        "similarity",
                        "series",
                        "plot",
                    )
                },
                cameras=list(nodes.cameras),
                renderings=list(nodes.renderings),
            ),
        )
        self.assertEqual(slicer.mrmlScene.GetNumberOfNodes(), count)
        self.assertIs(again.volume, nodes.volume)


if __name__ == "__main__":
    unittest.main()
