"""The harness is strict where Slicer only prints, and its stand-ins keep what the module relies on."""

from __future__ import annotations

import enum
import unittest
from typing import Annotated

from slicer_case import INSIDE_SLICER, SlicerTestCase

# isort: split
import slicer
from slicer.parameterNodeWrapper import WithinRange, parameterNodeWrapper

_UI = """<?xml version="1.0" encoding="UTF-8"?>
<ui version="4.0"><class>Demo</class>
<widget class="qMRMLWidget" name="Demo"><layout class="QVBoxLayout" name="box">
<item><widget class="qMRMLNodeComboBox" name="ct">
<property name="nodeTypes"><stringlist><string>vtkMRMLScalarVolumeNode</string></stringlist></property>
<property name="noneEnabled"><bool>true</bool></property>
<property name="SlicerParameterName" stdset="0"><string>ct</string></property></widget></item>
<item><widget class="ctkSliderWidget" name="angle">
<property name="SlicerParameterName" stdset="0"><string>angle</string></property></widget></item>
<item><widget class="QComboBox" name="preset">
<property name="SlicerParameterName" stdset="0"><string>preset</string></property></widget></item>
<item><widget class="QPushButton" name="apply">
<property name="text"><string>Apply</string></property></widget></item></layout></widget>
<connections><connection><sender>Demo</sender><signal>mrmlSceneChanged(vtkMRMLScene*)</signal>
<receiver>ct</receiver><slot>setMRMLScene(vtkMRMLScene*)</slot></connection></connections></ui>
"""


class Preset(enum.Enum):
    """A choice with visible texts."""

    FAST = 1
    BEST = 2

    def label(self) -> str:
        """The visible text."""
        return "Quick" if self is Preset.FAST else "Best"


@parameterNodeWrapper
class DemoParameters:
    """One parameter of each kind that the module uses."""

    ct: slicer.vtkMRMLScalarVolumeNode
    angle: Annotated[float, WithinRange(-180, 180)] = 3.0
    preset: Preset = Preset.BEST
    images: list[slicer.vtkMRMLVolumeNode]
    texts: list[str]


@unittest.skipIf(INSIDE_SLICER, "tests the harness, which the application does not need")
class HarnessTest(SlicerTestCase):
    def load_ui(self, text: str = _UI):
        path = self.folder / "Demo.ui"
        path.write_text(text)
        return slicer.util.loadUI(str(path))

    def test_sample_data_refuse_an_argument_that_slicer_does_not_take(self) -> None:
        import SampleData

        with self.assertRaises(TypeError):
            SampleData.SampleDataLogic.registerCustomSampleDataSource(sampleDescription="a pelvis")

    def test_qt_properties_are_attributes_and_unknown_names_raise(self) -> None:
        import qt

        button = qt.QPushButton("Go")
        self.assertEqual(button.text, "Go")
        button.enabled = False
        self.assertFalse(button.enabled)
        with self.assertRaises(AttributeError):
            button.enable = True
        with self.assertRaises(AttributeError):
            button.clicked = print
        with self.assertRaisesRegex(RuntimeError, "no signal 'pressedTwice"):
            button.connect("pressedTwice()", print)

    def test_exceptions_in_slots_and_observers_are_collected(self) -> None:
        import qt
        import vtk
        from harness import errors

        def fail(*_arguments: object) -> None:
            raise ValueError("from a callback")

        button = qt.QPushButton()
        button.connect("clicked(bool)", fail)
        with errors.expected("from a callback"):
            button.click()
        observed = vtk.vtkObject()
        observed.AddObserver(vtk.vtkCommand.ModifiedEvent, fail)
        with errors.expected("from a callback"):
            observed.Modified()
        timer = qt.QTimer()
        timer.timeout.connect(fail)
        with errors.expected("from a callback"):
            timer.start(0)
            qt.QApplication.processEvents()
            timer.stop()

    def test_vtk_errors_are_collected(self) -> None:
        import vtk
        from harness import errors

        with errors.expected("not.there"):
            reader = vtk.vtkXMLPolyDataReader()
            reader.SetFileName("/not.there")
            reader.Update()

    def test_disconnect_ends_the_calls(self) -> None:
        import qt

        calls = []
        button = qt.QPushButton()
        button.connect("clicked()", calls.append)
        slot = lambda: calls.append(1)  # noqa: E731
        button.disconnect("clicked()")
        button.connect("clicked()", slot)
        button.click()
        self.assertTrue(button.disconnect("clicked()", slot))
        button.click()
        self.assertEqual(calls, [1])

    def test_single_shot_works_on_the_class_and_on_an_instance(self) -> None:
        import qt

        calls = []
        qt.QTimer.singleShot(0, lambda: calls.append(1))
        qt.QApplication.processEvents()
        self.assertEqual(calls, [1])
        timer = qt.QTimer()
        timer.singleShot = True
        self.assertTrue(timer.singleShot)

    def test_ui_file_with_an_unknown_class_or_property_is_refused(self) -> None:
        for wrong, message in (
            (_UI.replace("ctkSliderWidget", "ctkNoSuchWidget"), "ctkNoSuchWidget"),
            (_UI.replace('name="noneEnabled"', 'name="nonEnabled"'), "nonEnabled"),
            (_UI.replace("<receiver>ct<", "<receiver>pt<"), "pt"),
            (_UI.replace('<property name="text">', '<property name="txt">'), "txt"),
        ):
            with self.assertRaisesRegex(RuntimeError, message):
                self.load_ui(wrong)

    def test_parameters_and_widgets_follow_each_other(self) -> None:
        widget = self.load_ui()
        widget.setMRMLScene(slicer.mrmlScene)
        ui = slicer.util.childWidgetVariables(widget)
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScriptedModuleNode")
        parameters = DemoParameters(node)
        key = parameters.connectGui(ui)
        self.assertEqual((ui.angle.value, ui.angle.minimum), (3.0, -180.0))
        self.assertEqual([ui.preset.itemText(i) for i in range(ui.preset.count)], ["Quick", "Best"])
        ui.preset.currentIndex = 0
        self.assertEqual(parameters.preset, Preset.FAST)
        ct = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", "CT")
        ui.ct.setCurrentNode(ct)
        self.assertIs(parameters.ct, ct)
        parameters.angle = 20.0
        self.assertEqual(ui.angle.value, 20.0)
        parameters.images = [ct, ct]
        parameters.texts = ["a", "b", "c"]
        parameters.texts = ["a"]
        self.assertEqual([list(parameters.images), list(parameters.texts)], [[ct, ct], ["a"]])
        with self.assertRaises((ValueError, RuntimeError)):
            parameters.angle = 500.0
        parameters.disconnectGui(key)
        ui.angle.value = 7.0
        self.assertEqual(parameters.angle, 20.0)

    def test_slice_and_three_d_views_show_the_scene(self) -> None:
        import numpy as np
        from harness.views import SliceView, ThreeDView
        from vtk.util.numpy_support import vtk_to_numpy

        voxels = np.zeros((20, 20, 20), np.float32)
        voxels[5:15, 5:15, 5:15] = 100.0
        volume = slicer.util.addVolumeFromArray(voxels)
        volume.CreateDefaultDisplayNodes()
        view = SliceView(size=(120, 120))
        view.composite.SetBackgroundVolumeID(volume.GetID())
        view.fit()
        pixels = vtk_to_numpy(view.image().GetPointData().GetScalars())
        self.assertGreater(int(pixels.max()), 200)
        view.close()
        self.assertTrue(ThreeDView(size=(120, 120)).save(self.folder / "3d.png").is_file())


if __name__ == "__main__":
    unittest.main()
