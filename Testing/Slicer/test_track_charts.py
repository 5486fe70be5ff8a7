"""Plots of a track: numbers of its tables, intervals, marks, the cursor, and clicks that go to a frame."""

from __future__ import annotations

import unittest

import numpy as np
import slicer
import track_scene_case as case
from panel_case import views
from PolyPoseSlicer.scene.track_charts import frame_of_point
from PolyPoseSlicer.scene.track_layout import PLOT_VIEWS
from slicer_case import INSIDE_SLICER
from vtkmodules.util.numpy_support import vtk_to_numpy

from PolyPoseLib.io.tracking.joint_curves import load_joint_curves


class TrackChartsTest(case.TrackCase):
    def setUp(self) -> None:
        super().setUp()
        self.shown = self.show()
        self.joint = load_joint_curves(self.saved)[0]

    def series(self, chart: int, name: str) -> slicer.vtkMRMLPlotSeriesNode:
        """A series of a chart."""
        node = self.shown.charts[chart]
        found = [node.GetNthPlotSeriesNode(number) for number in range(node.GetNumberOfPlotSeriesNodes())]
        return next(each for each in found if each.GetName() == name)

    def points(self, series: slicer.vtkMRMLPlotSeriesNode) -> np.ndarray:
        """(N, 2) x and y of a series."""
        table = series.GetTableNode().GetTable()
        columns = (series.GetXColumnName(), series.GetYColumnName())
        return np.stack([vtk_to_numpy(table.GetColumnByName(name)) for name in columns], axis=1)

    def test_curves_are_those_of_the_folder(self) -> None:
        self.assertEqual([each.GetName() for each in self.shown.charts], ["hip angles", "hip translations"])
        for chart, curves in enumerate((self.joint.angles, self.joint.translations)):
            for curve in curves:
                found = self.points(self.series(chart, f"hip {curve.name.replace('_', ' ')}"))
                np.testing.assert_allclose(found[:, 0], self.joint.seconds)
                np.testing.assert_allclose(found[:, 1], curve.values, atol=1e-6)
        lost = case.LOST - case.FIRST
        self.assertTrue(np.isnan(found[lost, 1]))
        self.assertEqual(np.isnan(found[:, 1]).sum(), 1)

    def test_intervals_reach_half_a_width_to_either_side(self) -> None:
        found = self.points(self.series(0, "hip about z, 95 %")).reshape(-1, 3, 2)
        curve = self.joint.angles[0]
        known = np.isfinite(curve.values)
        np.testing.assert_allclose(found[known, :2, 1].mean(axis=1), curve.values[known], atol=1e-5)
        np.testing.assert_allclose(
            np.diff(found[known, :2, 1])[:, 0], 2 * curve.half_widths_95[known], atol=1e-5
        )
        self.assertTrue((np.diff(found[known, :2, 1]) > 0).all())
        self.assertTrue(np.isnan(found[:, 2, 1]).all())  # a gap before the next

    def test_doubtful_frames_are_marked_on_every_curve(self) -> None:
        series = self.series(1, "hip translations, doubtful")
        found = self.points(series)
        self.assertEqual(series.GetLineStyle(), series.LineStyleNone)
        self.assertEqual(series.GetMarkerStyle(), series.MarkerStyleCross)
        row = case.DOUBTFUL - case.FIRST
        self.assertEqual(set(found[:, 0].round(6)), {round(case.DOUBTFUL / 50, 6)})
        np.testing.assert_allclose(
            found[:, 1], [each.values[row] for each in self.joint.translations], atol=1e-6
        )

    def test_the_cursor_stands_at_the_frame_that_is_shown(self) -> None:
        for frame in (3, 9, 4):
            self.shown.go_to(frame)
            for chart, name in enumerate(("angles", "translations")):
                found = self.points(self.series(chart, f"hip {name}, this frame"))
                np.testing.assert_allclose(found[:, 0], frame / 50)
        curves = np.stack([each.values for each in self.joint.translations])
        self.assertLess(found[0, 1], np.nanmin(curves))
        self.assertGreater(found[1, 1], np.nanmax(curves))

    def test_the_chart_is_drawn_anew_when_the_cursor_moves(self) -> None:
        """The application's plot view follows the chart node's changes, and no others."""
        changes = []
        chart = self.shown.charts[0]
        tag = chart.AddObserver("ModifiedEvent", lambda *_: changes.append(1))
        self.shown.go_to(8)
        chart.RemoveObserver(tag)
        self.assertTrue(changes)

    def test_points_know_their_frames(self) -> None:
        value, band = self.series(0, "hip about x"), self.series(0, "hip about x, 95 %")
        self.assertEqual([frame_of_point(value, number) for number in (0, 7)], [3, 10])
        self.assertEqual([frame_of_point(band, number) for number in (0, 4, 23)], [3, 4, 10])
        self.assertEqual(frame_of_point(self.series(0, "hip angles, doubtful"), 2), case.DOUBTFUL)
        self.assertIsNone(frame_of_point(self.series(0, "hip angles, this frame"), 0))
        self.assertIsNone(frame_of_point(value, 99))
        self.assertIsNone(frame_of_point(None, 0))

    @unittest.skipIf(INSIDE_SLICER, "clicks need the harness's own plot views")
    def test_a_click_on_a_point_goes_to_its_frame(self) -> None:
        """Also on another curve, and on the same point again; beside all points nothing happens."""
        manager = views()
        self.shown.show_layout()
        view = manager.plots[PLOT_VIEWS[0]].plotView()
        self.shown.charts[0].SetLegendVisibility(False)  # it may lie over points of a small view
        for name, row in (("hip about z", 6), ("hip about y", 2), ("hip about y", 2), ("hip about z", 3)):
            self.shown.go_to(3)
            place = self.points(self.series(0, name))[row]
            view.click(*place)
            self.assertEqual(self.shown.frame, case.FIRST + row)
        view.click(0.14, -20.0)
        self.assertEqual(self.shown.frame, case.FIRST + 3)
        self.shown.release()
        self.assertEqual(view.count("dataSelected(vtkStringArray*,vtkCollection*)"), 0)

    def test_a_track_of_one_bone_has_no_plots(self) -> None:
        (self.saved / "joints.json").unlink()
        again = self.show(replaced=self.shown)
        self.assertEqual(again.charts, [])
        self.assertEqual(slicer.util.getNodesByClass("vtkMRMLPlotSeriesNode"), [])


if __name__ == "__main__":
    unittest.main()
