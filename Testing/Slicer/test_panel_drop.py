"""X-rays dropped on the table: addresses as Slicer's tree gives them, and files as a file manager gives them.

Looked at for this: qMRMLSubjectHierarchyModel.cxx (mimeData, supportedDropActions) and qMRMLUtils.cxx of Slicer, the
DICOM widgets of CTK, and the events that PythonQt gives to an eventFilter.
"""

from __future__ import annotations

import unittest
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.panel import xray_drop
from PolyPoseSlicer.study import parameters

# isort: split
import qt

_BUTTON, _NO_KEY = qt.Qt.LeftButton, qt.Qt.NoModifier


class DropTest(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        # Events that a test makes have no source, as those of another application.
        self.from_here = mock.patch.object(xray_drop, "is_from_here", lambda _event: True)
        self.from_here.start()
        self.addCleanup(mock.patch.stopall)
        self.hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(slicer.mrmlScene)
        self.top = self.hierarchy.GetSceneItemID()
        # What the table refuses goes on to the main window, which takes every address.
        window = self.ui.xraysTable.window()
        self.addCleanup(window.setAcceptDrops, window.acceptDrops)
        window.setAcceptDrops(False)

    def item(self, node: Any, parent: int | None = None) -> int:
        """The node's item, which the application has made already."""
        item = self.hierarchy.GetItemByDataNode(node)
        if not item:
            return self.hierarchy.CreateItem(self.top if parent is None else parent, node)
        if parent is not None:
            self.hierarchy.SetItemParent(item, parent)
        return item

    def data(self, *dropped: int | str | Path) -> Any:
        urls = [
            qt.QUrl(f"mrml://scene/subjecthierarchy/item?id={each}")
            if isinstance(each, int)
            else qt.QUrl.fromLocalFile(str(each))
            for each in dropped
        ]
        data = qt.QMimeData()
        data.setUrls(urls)
        return data

    def send(self, kind: Any, data: Any, actions: Any, place: Any) -> Any:
        event = kind(place, actions, data, _BUTTON, _NO_KEY)
        qt.QApplication.sendEvent(self.ui.xraysTable.viewport(), event)
        return event

    def enter(self, data: Any, actions: Any = qt.Qt.MoveAction) -> Any:
        return self.send(qt.QDragEnterEvent, data, actions, qt.QPoint(5, 5))

    def drop(self, *dropped: int | str | Path, actions: Any = qt.Qt.MoveAction) -> Any:
        """Drag over the table, drop, and let it be taken; as Slicer's tree, which only moves."""
        data = self.data(*dropped)
        self.assertTrue(self.enter(data, actions).isAccepted(), "the drag was refused")
        self.assertTrue(self.send(qt.QDragMoveEvent, data, actions, qt.QPoint(6, 6)).isAccepted())
        event = self.send(qt.QDropEvent, data, actions, qt.QPointF(6, 6))
        slicer.app.processEvents()
        return event

    def sources(self) -> list:
        return parameters.xray_sources(self.panel.parameters)

    @property
    def said(self) -> str:
        return self.ui.xrayState.text

    def test_a_volume_of_the_tree_is_added(self) -> None:
        image = scenes.add_xray("AP")
        event = self.drop(self.item(image))
        self.assertEqual([each.image for each in self.sources()], [image])
        self.assertEqual(self.ui.xraysTable.item(0, 0).text(), "AP")
        self.assertTrue(event.isAccepted())
        self.assertEqual(event.dropAction(), qt.Qt.IgnoreAction, "the tree would take its row away")

    def test_several_items_are_added_in_their_order_and_known_ones_once(self) -> None:
        items = [self.item(scenes.add_xray(name)) for name in ("AP", "lateral", "oblique")]
        self.drop(items[1], items[0])
        self.assertEqual([each.name for each in self.sources()], ["lateral", "AP"])
        self.drop(*items)
        self.assertEqual([each.name for each in self.sources()], ["lateral", "AP", "oblique"])
        self.drop(items[0])
        self.assertEqual(len(self.sources()), 3)
        self.assertIn("already", self.said)

    def test_a_colour_image_is_added(self) -> None:
        image = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLVectorVolumeNode", "photograph")
        slicer.util.updateVolumeFromArray(image, np.zeros((1, 6, 5, 3), np.uint8))
        self.drop(self.item(image))
        self.assertEqual([each.name for each in self.sources()], ["photograph"])

    def test_a_folder_gives_the_images_below_it_but_no_ct(self) -> None:
        patient = self.hierarchy.CreateFolderItem(self.top, "patient")
        study = self.hierarchy.CreateFolderItem(patient, "study")
        self.item(scenes.add_ct(), study)
        ct = slicer.mrmlScene.GetFirstNodeByName("CT")
        self.item(scenes.add_segmentation(ct), study)
        self.item(scenes.add_xray("AP"), study)
        self.item(scenes.add_xray("lateral"), patient)
        self.drop(patient)
        self.assertEqual(sorted(each.name for each in self.sources()), ["AP", "lateral"])

    def test_what_a_sequence_browser_shows_gives_its_sequence(self) -> None:
        sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", "run")
        for number in range(3):
            image = scenes.add_xray(f"frame {number}")
            sequence.SetDataNodeAtValue(image, str(number))
            slicer.mrmlScene.RemoveNode(image)
        browser = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode")
        browser.SetAndObserveMasterSequenceNodeID(sequence.GetID())
        slicer.modules.sequences.logic().UpdateProxyNodesFromSequences(browser)
        browser.SetSelectedItemNumber(2)
        self.drop(self.item(browser.GetProxyNode(sequence)))
        self.assertEqual([(each.image, each.frame) for each in self.sources()], [(sequence, 2)])
        self.drop(self.item(sequence))
        self.assertEqual([each.frame for each in self.sources()], [2, 0])

    def test_items_that_are_no_images_are_refused_in_one_sentence(self) -> None:
        ct = scenes.add_ct()
        bones = self.item(scenes.add_segmentation(ct))
        empty = self.hierarchy.CreateFolderItem(self.top, "nothing")
        event = self.enter(self.data(bones, empty))
        self.assertFalse(event.isAccepted())
        self.assertEqual(self.ui.xraysTable.styleSheet, "")
        self.assertIn("'Bones', 'nothing'", self.said)
        self.assertIn("image files", self.said)
        image = self.item(scenes.add_xray())
        self.drop(image, bones)
        self.assertEqual(len(self.sources()), 1)
        self.assertIn("'Bones'", self.said)

    def test_label_maps_are_refused(self) -> None:
        labels = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLabelMapVolumeNode", "labels")
        self.assertFalse(self.enter(self.data(self.item(labels))).isAccepted())

    def test_files_are_added_as_copies(self) -> None:
        paths = [self.folder / name for name in ("AP.DCM", "lateral.png", "IM0001", "notes.txt", "raw")]
        for path in paths:
            path.write_bytes(b"\0" * 128 + (b"DICM" if path.name == "IM0001" else b"none"))
        actions = qt.Qt.MoveAction | qt.Qt.CopyAction
        event = self.drop(*paths, self.folder, actions=actions)
        self.assertEqual([Path(each.path) for each in self.sources()], paths[:3])
        self.assertTrue(all(each.image is None for each in self.sources()))
        self.assertEqual(event.dropAction(), qt.Qt.CopyAction, "a file manager that moves would delete")
        for name in ("notes.txt", "raw"):
            self.assertIn(name, self.said)
        self.assertFalse(self.enter(self.data(paths[3], self.folder / "missing.dcm")).isAccepted())

    def test_the_table_is_marked_while_something_usable_is_over_it(self) -> None:
        data = self.data(self.item(scenes.add_xray()))
        self.enter(data)
        self.assertIn("highlight", self.ui.xraysTable.styleSheet)
        qt.QApplication.sendEvent(self.ui.xraysTable.viewport(), qt.QDragLeaveEvent())
        self.assertEqual(self.ui.xraysTable.styleSheet, "")
        self.assertEqual(self.sources(), [])

    def test_text_and_unknown_items_are_refused(self) -> None:
        text = qt.QMimeData()
        text.setText("AP")
        self.assertFalse(self.enter(text).isAccepted())
        self.assertIn("Nothing here is an X-ray", self.said)
        web = qt.QMimeData()
        web.setUrls([qt.QUrl("https://example.org/AP.dcm")])
        self.assertFalse(self.enter(web).isAccepted())

    def test_items_of_another_slicer_are_refused(self) -> None:
        self.from_here.stop()
        item = self.item(scenes.add_xray())
        self.assertFalse(self.enter(self.data(item)).isAccepted())

    def test_a_drop_when_the_scene_is_closed_at_once_adds_nothing(self) -> None:
        data = self.data(self.item(scenes.add_xray()))
        self.enter(data)
        self.send(qt.QDropEvent, data, qt.Qt.MoveAction, qt.QPointF(6, 6))
        slicer.mrmlScene.Clear()
        slicer.app.processEvents()
        self.assertEqual(self.sources(), [])


if __name__ == "__main__":
    unittest.main()
