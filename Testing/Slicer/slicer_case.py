"""What the Slicer tests share: inside the application they run on it, elsewhere on the harness."""

from __future__ import annotations

import atexit
import gc
import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
SLICER_PYTHON_VARIABLE = "POLYPOSE_SLICER_PYTHON"


def _inside_slicer() -> bool:
    try:
        from slicer import app  # noqa: F401
    except ImportError:
        return False
    return True


INSIDE_SLICER = _inside_slicer()
for _folder in ("", "PolyPose", "Testing"):
    sys.path.insert(0, str(REPOSITORY / _folder))
if INSIDE_SLICER:
    import slicer
    import vtk
    from harness import errors

    # The application's own window hands VTK's errors to its log and tells no observer of them.
    vtk.vtkOutputWindow.SetInstance(vtk.vtkOutputWindow())
    errors.install()
    # A folder of its own: tests look for what was left in it, and all applications of a user share the usual one.
    slicer.app.temporaryPath = tempfile.mkdtemp(prefix="polypose-temporary-")
    atexit.register(shutil.rmtree, slicer.app.temporaryPath, ignore_errors=True)
else:
    import harness

    # The folder Base/Python of Slicer's source: the module then runs on Slicer's own classes.
    harness.install(os.environ.get(SLICER_PYTHON_VARIABLE) or None)


class SlicerTestCase(unittest.TestCase):
    """An empty scene and an empty folder before each test; no error may have been swallowed after it."""

    def setUp(self) -> None:
        import slicer

        slicer.mrmlScene.Clear()
        self.folder = Path(tempfile.mkdtemp(prefix="polypose-test-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self._take_errors()

    def tearDown(self) -> None:
        gc.collect()
        errors = self._take_errors()
        self.assertEqual(errors, [], "raised in a slot or an observer, or reported by VTK")

    @staticmethod
    def _take_errors() -> list[str]:
        """What slots and observers raised, and what VTK reported, since the last call."""
        from harness import errors

        return errors.take()
