"""A panel with two X-rays that have no camera yet, and a child process that finds them as a test says."""

from __future__ import annotations

import json

import scenes
from panel_case import PanelCase
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.camera_source import CameraSource
from PolyPoseSlicer.study.xray_source import XraySource

SOURCES = [source.value for source in CameraSource]
ANSWER = """
arguments = arguments[2:]  # after -m PolyPoseLib
study = json.loads(Path(arguments[1]).read_text())
entries = {entries!r}
for number, entry in enumerate(entries):
    entry["number"] = number
tell(1, stage="camera AP", similarity=None)
Path("asked.json").write_text(json.dumps([arguments, study]))
shutil.copy("asked.json", {keep!r})
Path(arguments[arguments.index("--report") + 1]).write_text(json.dumps({{"version": 1, "cameras": entries}}))
sys.exit({status})
"""


def found(sure: bool = True, **changes) -> dict:
    """An entry of a report."""
    _intrinsics, extrinsic = scenes.camera_matrix()
    entry = {
        "name": "AP", "extrinsic": extrinsic.tolist(), "mirrored": False, "sure": sure, "within": [2.0, 10.0],
        "how": "searched around PA: similarity 0.71, the next best 0.42", "warnings": [], "similarity": 0.71,
        "runner_up": 0.42,
    }  # fmt: skip
    if not sure:
        entry |= {
            "how": "searched around PA: similarity 0.71, the next best 0.69",
            "runner_up": 0.69,
            "warnings": ['The camera of X-ray "AP" is uncertain: another view <explains> it.'],
        }
    return entry | changes


class CamerasCase(PanelCase):
    """Two X-rays that have no camera yet."""

    def setUp(self) -> None:
        super().setUp()
        self.fill()
        fields = {"source_to_detector_mm": 1000.0}
        parameters.store_xray_sources(
            self.panel.parameters, [XraySource(each, fields=fields) for each in self.xrays]
        )
        self.ui.xraysTable.selectRow(0)

    def choose(self, source: CameraSource, row: int = 0) -> None:
        self.ui.xraysTable.selectRow(row)
        self.ui.cameraSource.currentIndex = SOURCES.index(source.value)

    def source(self, row: int = 0) -> XraySource:
        return parameters.xray_sources(self.panel.parameters)[row]

    def answer(self, *entries: dict) -> None:
        """Let searches find this."""
        status = 0 if all(entry["sure"] for entry in entries) else 3
        keep = str(self.folder / "asked.json")
        self.child("import shutil\n" + ANSWER.format(entries=list(entries), status=status, keep=keep))

    def asked(self) -> tuple[list[str], dict]:
        """Arguments of the child, and the study that it was given."""
        return json.loads((self.folder / "asked.json").read_text())

    def find(self) -> None:
        self.ui.findCamera.click()
        self.assertEqual(self.ui.findCamera.text, "Cancel")
        self.wait(lambda: not self.panel.cameras.running)
