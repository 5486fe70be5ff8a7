"""Stands for the extensions TotalSegmentator and MONAIAuto3DSeg where they are not installed.

Looked at for this: TotalSegmentator.py of SlicerTotalSegmentator (7 May 2026) and MONAIAuto3DSeg.py, process.py,
dependency_handler.py and Models.json of SlicerMONAIAuto3DSeg (19 March 2026). The methods that the panel calls have the
same arguments, in the same order, do the same to the scene, wait in the same way and call back with the same events;
segments get the names that the extensions' own tables of terms give. What they compute is left out.
"""

from __future__ import annotations

import enum
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import slicer

# isort: split
import qt

NAMES = {
    "femur_left": "left femur", "hip_left": "left hip", "hip_right": "right hip", "sacrum": "Sacrum",
    "vertebrae_L5": "L5 vertebra", "rib_left_4": "left rib 4", "spleen": "spleen",
}  # fmt: skip
"""Of TotalSegmentator's labels, and the standard names that the extension gives their segments."""

_CHILD = (
    "import subprocess, sys, time\n"
    "print('Predicting part 1 of 5 ...', flush=True)\n"
    "if {seconds}:\n"
    "    child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep({seconds})'])\n"
    "    print('child', child.pid, flush=True)\n"
    "    time.sleep({seconds})\n"
    "sys.exit({code})\n"
)


class InstallError(Exception):
    """What the extension raises when its packages are not there."""


class TotalSegmentatorLogic:
    """Fills a segmentation after a child process has ended; waits for it line by line, without events."""

    seconds, code, names = 0, 0, dict(NAMES)
    refusal = ""
    made: list[TotalSegmentatorLogic] = []  # noqa: RUF012 - emptied by each test

    def __init__(self) -> None:
        self.logCallback = None
        self.useStandardSegmentNames = True
        self.called: dict[str, Any] = {}
        self.prepared = False
        self.folder = ""
        self.made.append(self)

    def log(self, text: str) -> None:
        if self.logCallback:
            self.logCallback(text)

    def setupPythonRequirements(self, upgrade: bool = False) -> None:
        self.log("TotalSegmentator Python package is required.")
        if self.refusal:
            raise InstallError(self.refusal)
        self.prepared = True

    def logProcessOutput(self, proc: Any, returnOutput: bool = False) -> str | None:
        output = ""
        while True:
            try:
                line = proc.stdout.readline()
                if not line:
                    break
                if returnOutput:
                    output += line
                self.log(line.rstrip())
            except UnicodeDecodeError:
                pass
        proc.wait()
        if proc.returncode != 0:
            raise subprocess.CalledProcessError(
                proc.returncode, proc.args, output=proc.stdout, stderr=proc.stderr
            )
        return output if returnOutput else None

    def process(
        self,
        inputVolume: Any,
        outputSegmentation: Any,
        quality: Any = None,
        cpu: bool = False,
        task: str | None = None,
        subset: Any = None,
        interactive: bool = False,
        sequenceBrowserNode: Any = None,
    ) -> None:
        self.called = {"quality": quality, "task": task, "interactive": interactive, "subset": subset}
        self.folder = slicer.util.tempDirectory()
        file = Path(self.folder) / "total-segmentator-input.nii"
        file.write_text("the patient's CT")
        program = _CHILD.format(seconds=self.seconds, code=self.code)
        command = [sys.executable, "-c", program, "-i", str(file), "-o", f"{self.folder}/segmentation"]
        self.logProcessOutput(slicer.util.launchConsoleProcess(command))
        for label, name in self.names.items():
            outputSegmentation.GetSegmentation().AddEmptySegment(
                label, name if self.useStandardSegmentNames else label
            )
        outputSegmentation.SetReferenceImageGeometryParameterFromVolumeNode(inputVolume)
        file.unlink()
        Path(self.folder).rmdir()


class EventCode(enum.Enum):
    """With what MONAIAuto3DSeg calls back."""

    TASK_PROCESSING_STARTED = 2
    TASK_PROCESSING_ENDED = 3
    TASK_IMPORTING_RESULTS_STARTED = 4
    TASK_IMPORTING_RESULTS_ENDED = 5
    TASKLIST_PROCESSING_ENDED = 6


class ExitCode(enum.Enum):
    """How a process of it ended, when not by itself."""

    USER_CANCELLED = 1001
    DID_NOT_RUN = 1002


def model(title: str, names: list[str], **changes: Any) -> dict[str, Any]:
    """One model as its logic lists it."""
    given = {"id": f"{title}-v2.0.0", "title": title, "segmentNames": names, "deprecated": False}
    return {**given, "imagingModality": "CT", "inputs": [{"title": "Input volume"}], **changes}


_BONES = ["Left Femur", "Left Hip", "Sacrum", "L5 vertebra", "Left Fourth rib", "Left Fifth rib", "Spleen"]
MODELS = [
    model("abdominal-organs", ["Spleen", "Liver"]),
    model("whole-body", _BONES),
    model("whole-body-3mm", _BONES),
    model("older", [*_BONES, "Skull"], deprecated=True),
    model("prostate", [*_BONES, "Skull"], imagingModality="MR"),
    model("two", [*_BONES, "Skull"], inputs=[{"title": "T2"}, {"title": "ADC"}]),
    model("unlisted", [], segmentNames=None),
]


class MONAIAuto3DSegLogic:
    """Fills a segmentation some time after `process` has returned."""

    DEPENDENCY_HANDLER = types.SimpleNamespace(dependenciesInstalled=False)
    code: Any = 0
    fails_to_import = False
    seconds = 0.02
    made: list[MONAIAuto3DSegLogic] = []  # noqa: RUF012 - emptied by each test

    def __init__(self) -> None:
        self.logCallback = None
        self.useStandardSegmentNames = True
        self.models = MODELS
        self.downloaded: list[str] = []
        self.setups = 0
        self.imported = False
        self.made.append(self)

    def setupPythonRequirements(self, upgrade: bool = False) -> bool:
        self.setups += 1
        self.DEPENDENCY_HANDLER.dependenciesInstalled = True
        return True

    def modelPath(self, modelName: str) -> Path:
        self.downloaded.append(modelName)
        return Path(modelName)

    def process(
        self,
        inputNodes: list[Any],
        outputSegmentation: Any,
        model: str | None = None,
        cpu: bool = False,
        waitForCompletion: bool = True,
        sequenceBrowserNode: Any = None,
        eventCallback: Any = None,
        customEventCallbackData: Any = None,
    ) -> Any:
        process = types.SimpleNamespace(procReturnCode=ExitCode.DID_NOT_RUN)
        info = types.SimpleNamespace(
            inputNodes=inputNodes, outputSegmentation=outputSegmentation, model=model, segmentationTasks=[],
            eventCallback=eventCallback, waitForCompletion=waitForCompletion,
        )  # fmt: skip
        eventCallback(EventCode.TASK_PROCESSING_STARTED, info)
        info.segmentationTasks.append(types.SimpleNamespace(backgroundProcess=process))
        timer = qt.QTimer()
        timer.setSingleShot(True)
        timer.interval = int(1000 * self.seconds)
        timer.connect("timeout()", lambda: self._completed(info))
        timer.start()
        info.timer = timer
        return info

    def cancelProcessing(self, segmentationTaskListInfo: Any) -> None:
        for task in segmentationTaskListInfo.segmentationTasks:
            task.backgroundProcess.procReturnCode = ExitCode.USER_CANCELLED

    def _completed(self, info: Any) -> None:
        process = info.segmentationTasks[0].backgroundProcess
        if process.procReturnCode is ExitCode.DID_NOT_RUN:
            process.procReturnCode = self.code
        info.eventCallback(EventCode.TASK_PROCESSING_ENDED, info)
        if process.procReturnCode == 0:
            info.eventCallback(EventCode.TASK_IMPORTING_RESULTS_STARTED, info)
            self.imported = True
            try:
                if self.fails_to_import:
                    return  # an exception in a slot, which Slicer prints
                for label, name in NAMES.items():
                    info.outputSegmentation.GetSegmentation().AddEmptySegment(label, name)
            finally:
                info.eventCallback(EventCode.TASK_IMPORTING_RESULTS_ENDED, info)
        info.eventCallback(EventCode.TASKLIST_PROCESSING_ENDED, info)


def modules() -> dict[str, types.ModuleType]:
    """The two modules, by the names they are imported with."""
    total, monai = types.ModuleType("TotalSegmentator"), types.ModuleType("MONAIAuto3DSeg")
    total.TotalSegmentatorLogic, total.InstallError = TotalSegmentatorLogic, InstallError
    monai.MONAIAuto3DSegLogic = MONAIAuto3DSegLogic
    return {"TotalSegmentator": total, "MONAIAuto3DSeg": monai}
