"""Which Python runs the core, where it finds it, and what an old Slicer says."""

from __future__ import annotations

import os
import sys
import unittest
from pathlib import Path
from unittest import mock

import slicer
from PolyPoseSlicer.process import environment
from slicer_case import INSIDE_SLICER, REPOSITORY, SlicerTestCase


class EnvironmentTest(SlicerTestCase):
    def test_python_slicer_is_preferred_to_this_interpreter(self) -> None:
        name = "PythonSlicer.exe" if sys.platform == "win32" else "PythonSlicer"
        program = self.folder / name
        program.write_text("#!/bin/sh\n")
        program.chmod(0o755)
        with mock.patch.dict(os.environ, {"PATH": str(self.folder)}):
            self.assertEqual(Path(environment.python_executable()), program)
        with mock.patch.dict(os.environ, {"PATH": str(self.folder / "nowhere")}):
            self.assertEqual(environment.python_executable(), sys.executable)

    def test_the_child_finds_the_core_first_and_keeps_the_rest(self) -> None:
        with mock.patch.dict(os.environ, {"PYTHONPATH": "/of/slicer", "PYTHONHOME": "/home/of/slicer"}):
            variables = environment.child_environment()
        first, *rest = variables["PYTHONPATH"].split(os.pathsep)
        self.assertTrue((Path(first) / "PolyPoseLib" / "__init__.py").is_file())
        self.assertEqual(rest, ["/of/slicer"])
        self.assertEqual(variables["PYTHONHOME"], "/home/of/slicer")

    def test_this_slicer_is_new_enough(self) -> None:
        self.assertEqual(environment.version_problem(), "")

    def test_versions_are_compared_as_numbers(self) -> None:
        for version, old in (
            ((5, 8), True),
            ((5, 11), True),
            ((5, 12), False),
            ((6, 0), False),
            ((4, 13), True),
        ):
            with mock.patch.object(environment, "slicer_version", return_value=version):
                self.assertEqual(bool(environment.version_problem()), old, version)

    @unittest.skipIf(INSIDE_SLICER, "the application has set up the panel already")
    def test_the_panel_of_an_old_slicer_says_so_and_nothing_else(self) -> None:
        import qt
        from harness import modules

        module = modules.load(REPOSITORY / "PolyPose" / "PolyPose.py")
        with mock.patch.object(environment, "slicer_version", return_value=(5, 10)):
            module.enter()
            label = module.widgetRepresentation().findChild(qt.QLabel)
            self.assertIn("needs 3D Slicer 5.12 or newer, and this is 5.10", label.text)
            module.exit()
        module.close()
        self.assertFalse(hasattr(slicer.modules, "PolyPoseWidget"))


if __name__ == "__main__":
    unittest.main()
