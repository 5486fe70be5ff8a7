"""Export as DICOM: the scene's result by the core's own command in a child process, and Slicer's DICOM database."""

from __future__ import annotations

import importlib.util
import sys
import types
import unittest
from pathlib import Path
from typing import Any
from unittest import mock

import children
import numpy as np
import scenes
import slicer
from panel_case import PanelCase
from PolyPoseSlicer.panel import export
from PolyPoseSlicer.process import dicom_export
from PolyPoseSlicer.study.ct_files import INSTANCES

HAS_HIGHDICOM = importlib.util.find_spec("highdicom") is not None
PATIENT = "PATIENT-7"


def write_slices(folder: Path) -> dict[str, str]:
    """The CT of scenes.add_ct as DICOM slices; {instance UID: path}."""
    from pydicom.dataset import FileDataset, FileMetaDataset
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

    matrix, voxels = scenes.affine(), scenes.voxels()
    series, study, frame = generate_uid(), generate_uid(), generate_uid()
    folder.mkdir()
    paths = {}
    for number, section in enumerate(voxels):
        meta = FileMetaDataset()
        meta.MediaStorageSOPClassUID = CTImageStorage
        meta.MediaStorageSOPInstanceUID = generate_uid()
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        path = folder / f"slice{number}.dcm"
        data = FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
        data.SOPClassUID, data.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
        data.PatientName, data.PatientID = "Someone^Else", PATIENT
        data.PatientBirthDate = data.PatientSex = data.StudyDate = data.StudyTime = ""
        data.AccessionNumber = data.ReferringPhysicianName = data.StudyID = ""
        data.Modality, data.Manufacturer = "CT", "test"
        data.StudyInstanceUID, data.SeriesInstanceUID, data.FrameOfReferenceUID = study, series, frame
        data.SeriesNumber, data.InstanceNumber = 1, number + 1
        axes = matrix[:3, :3] / np.array(scenes.SPACING)
        data.ImageOrientationPatient = [*axes[:, 0].tolist(), *axes[:, 1].tolist()]
        data.ImagePositionPatient = (matrix[:3, 3] + number * matrix[:3, 2]).tolist()
        data.PixelSpacing = [scenes.SPACING[1], scenes.SPACING[0]]
        data.SliceThickness = scenes.SPACING[2]
        data.Rows, data.Columns = section.shape
        data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
        data.BitsAllocated = data.BitsStored = 16
        data.HighBit, data.PixelRepresentation = 15, 1
        data.RescaleSlope, data.RescaleIntercept = 1, 0
        data.PixelData = np.ascontiguousarray(section, "<i2").tobytes()
        data.save_as(path, enforce_file_format=True)
        paths[str(data.SOPInstanceUID)] = str(path)
    return paths


class Database:
    """Stands for ctkDICOMDatabase."""

    def __init__(self, paths: dict[str, str]) -> None:
        self.paths = paths

    def fileForInstance(self, uid: str) -> str:
        return self.paths.get(uid, "")

    def isOpen(self) -> bool:
        return True


class ExportCase(PanelCase):
    def setUp(self) -> None:
        super().setUp()
        self.fill()
        self.export = self.panel.export
        self.answers: list[str] = []
        self.consent = True
        patch = mock.patch.object(slicer.util, "confirmYesNoDisplay", self.answer, create=True)
        patch.start()
        self.addCleanup(patch.stop)
        installed = mock.patch.object(export, "ensure_dependencies", lambda _path: None)
        installed.start()
        self.addCleanup(installed.stop)
        self.database(None)

    def answer(self, text: str, **_more: Any) -> bool:
        self.answers.append(text)
        return self.consent

    def database(self, database: Any) -> None:
        """Let Slicer have this DICOM database."""
        patch = mock.patch.object(slicer, "dicomDatabase", database, create=True)
        patch.start()
        self.addCleanup(patch.stop)

    def load(self, **changes: Any) -> None:
        self.panel.review.load_result(str(scenes.save_result(self.folder / "given", **changes)))
        # As a registration of this segmentation gives it.
        copy = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", "warped")
        copy.CopyContent(self.segmentation)
        self.panel.parameters.outputSegmentation = copy

    def program(self, body: str) -> None:
        """Let exports run a program of our own."""
        program = children.command(self.folder, body)
        original = dicom_export.DicomExport

        def make(*arguments: Any) -> Any:
            return original(*arguments, command=program)

        patch = mock.patch.object(export, "DicomExport", make)
        patch.start()
        self.addCleanup(patch.stop)

    def write(self, folder: Path) -> Path:
        self.export.start(str(folder))
        self.wait(lambda: not self.export.running, 120)
        return folder


@unittest.skipUnless(HAS_HIGHDICOM, "needs highdicom")
class RealExportTest(ExportCase):
    def test_a_ct_that_is_not_dicom_is_written_for_a_placeholder(self) -> None:
        import pydicom

        self.load()
        folder = self.write(self.folder / "out")
        self.assertIn("Written to", self.ui.exportState.text)
        self.assertIn("placeholder patient POLYPOSE", self.ui.exportState.text)
        self.assertEqual(len(list((folder / "ct").iterdir())), scenes.SHAPE[0])
        self.assertEqual(len(list((folder / "original_ct").iterdir())), scenes.SHAPE[0])
        seen = {pydicom.dcmread(path).PatientID for path in folder.rglob("*.dcm")}
        self.assertEqual(seen, {"POLYPOSE"})
        labels = pydicom.dcmread(folder / "segmentation.dcm")
        self.assertTrue({"pelvis", "femur"} <= {str(each.SegmentLabel) for each in labels.SegmentSequence})
        self.assertEqual(self.answers, [])

    def test_bones_of_a_loaded_result_get_their_names_from_the_segmentation(self) -> None:
        import pydicom

        self.panel.review.load_result(str(scenes.save_result(self.folder / "given")))
        identifiers = set(self.panel.parameters.outputSegmentation.GetSegmentation().GetSegmentIDs())
        self.assertTrue(identifiers.isdisjoint(self.segmentation.GetSegmentation().GetSegmentIDs()))
        folder = self.write(self.folder / "out")
        labels = pydicom.dcmread(folder / "segmentation.dcm")
        self.assertTrue({"pelvis", "femur"} <= {str(each.SegmentLabel) for each in labels.SegmentSequence})

    def test_a_ct_of_the_dicom_database_keeps_its_patient_and_the_objects_are_offered_to_it(self) -> None:
        import pydicom

        paths = write_slices(self.folder / "slices")
        self.ct.SetAttribute(INSTANCES, " ".join(paths))
        self.database(Database(paths))
        added: list[str] = []
        module = types.ModuleType("DICOMLib")
        module.DICOMUtils = types.SimpleNamespace(  # type: ignore[attr-defined]
            importDicom=lambda folder, _database, copyFiles: added.append(folder)
        )
        self.load(distrust=("nothing fits",))
        with mock.patch.dict(sys.modules, {"DICOMLib": module}):
            folder = self.write(self.folder / "out")
        self.assertIn("nothing fits", self.ui.exportState.text)
        self.assertIn("Added to", self.ui.exportState.text)
        self.assertEqual(added, [str(folder)])
        self.assertEqual(len(self.answers), 1)
        self.assertFalse((folder / "original_ct").exists())
        objects = [pydicom.dcmread(path) for path in folder.rglob("*.dcm")]
        self.assertEqual({each.PatientID for each in objects}, {PATIENT})
        motions = [pydicom.dcmread(path) for path in sorted((folder / "bones").iterdir())]
        self.assertEqual(len(motions), 2)
        stored = [
            np.array(matrix.FrameOfReferenceTransformationMatrix, float).reshape(4, 4)
            for item in motions[1].RegistrationSequence
            for registration in item.MatrixRegistrationSequence
            for matrix in registration.MatrixSequence
        ]
        pose = scenes.result().structures["femur"].fixed_to_moving
        wanted = (pose, np.linalg.inv(pose))
        self.assertTrue(
            any(np.allclose(each, one, atol=1e-5) for each in stored for one in wanted),
            "the bone's own motion is in its object",
        )
        self.assertTrue(all(Path(path).is_file() for path in paths.values()))  # the originals are left


class ExportTest(ExportCase):
    def test_it_is_written_beside_what_a_folder_holds(self) -> None:
        self.load()
        self.program("output.mkdir()\n(output / 'README.txt').write_text(' '.join(arguments))\n")
        given = self.folder / "chosen"
        given.mkdir()
        (given / "mine.txt").write_text("mine")
        self.write(given)
        said = (given / "PolyPose-DICOM" / "README.txt").read_text()
        self.assertTrue(said.startswith("dicom "), said)
        self.assertIn("--new-patient POLYPOSE", said)
        self.write(given)
        self.assertTrue((given / "PolyPose-DICOM_1").is_dir())
        self.assertEqual((given / "mine.txt").read_text(), "mine")

    def test_it_can_be_cancelled(self) -> None:
        self.load()
        self.program("while True:\n    time.sleep(0.05)\n")
        self.export.start(str(self.folder / "out"))
        self.wait(lambda: self.export._run.state.name == "RUNNING")
        self.assertEqual(self.ui.exportDicom.text, "Cancel")
        self.ui.exportDicom.click()
        self.wait(lambda: not self.export.running)
        self.assertIn("Cancelled", self.ui.exportState.text)
        self.assertEqual(self.ui.exportDicom.text, "Export as DICOM...")
        self.assertFalse((self.folder / "out").exists())

    def test_what_the_child_says_is_shown(self) -> None:
        self.load()
        self.program("print('polypose: this CT is odd: mend it.', file=sys.stderr)\nsys.exit(2)\n")
        self.write(self.folder / "out")
        self.assertEqual(self.ui.exportState.text, "this CT is odd: mend it.")

    def test_an_unloaded_panel_ends_it(self) -> None:
        self.load()
        self.program("while True:\n    time.sleep(0.05)\n")
        self.export.start(str(self.folder / "out"))
        run = self.export._run
        self.wait(lambda: run.state.name == "RUNNING")
        self.renew()
        self.wait(lambda: run.state.ended)
        self.assertFalse((self.folder / "out").exists())

    def test_the_database_is_asked_only_with_consent_and_its_failure_is_one_sentence(self) -> None:
        self.load()
        self.database(Database({}))
        self.program("output.mkdir()\n(output / 'README.txt').write_text('')\n")
        module = types.ModuleType("DICOMLib")
        importer = mock.Mock(side_effect=RuntimeError("it is locked"))
        module.DICOMUtils = types.SimpleNamespace(importDicom=importer)  # type: ignore[attr-defined]
        self.consent = False
        with mock.patch.dict(sys.modules, {"DICOMLib": module}):
            self.write(self.folder / "out")
            self.assertEqual((len(self.answers), importer.call_count), (1, 0))
            self.consent = True
            self.write(self.folder / "again")
        self.assertEqual(importer.call_count, 1)
        self.assertIn("could not add them (it is locked)", self.ui.exportState.text)
        self.assertTrue((self.folder / "again" / "README.txt").is_file())

    def test_a_missing_slice_of_the_database_makes_a_placeholder(self) -> None:
        self.ct.SetAttribute(INSTANCES, "1.2.3 1.2.4")
        self.database(Database({"1.2.3": __file__}))
        self.load()
        self.program("output.mkdir()\n(output / 'README.txt').write_text(' '.join(arguments))\n")
        self.write(self.folder / "out")
        self.assertIn("--new-patient", (self.folder / "out" / "README.txt").read_text())
        self.assertIn("placeholder", self.ui.exportState.text)


if __name__ == "__main__":
    unittest.main()
