"""Where PolyPoseLib is, which Python runs it, and whether this Slicer is new enough."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import slicer
from slicer.i18n import tr as _

OLDEST_SLICER = (5, 12)


def core_folder() -> Path:
    """The folder that holds PolyPoseLib: beside the module when installed, above it in the source tree.

    Raises RuntimeError when it is in neither.
    """
    module_folder = Path(__file__).resolve().parents[2]
    for folder in (module_folder, module_folder.parent):
        if (folder / "PolyPoseLib" / "__init__.py").is_file():
            return folder
    raise RuntimeError(
        f"PolyPoseLib is not beside {module_folder}: install the PolyPose extension again, all of it."
    )


def make_core_importable() -> None:
    """Let this process import PolyPoseLib, from wherever the module was loaded."""
    folder = str(core_folder())
    if folder not in sys.path:
        sys.path.insert(0, folder)


def slicer_version() -> tuple[int, int]:
    """The application's major and minor version."""
    return int(slicer.app.majorVersion), int(slicer.app.minorVersion)


def version_problem() -> str:
    """One sentence when this Slicer is too old, otherwise an empty text."""
    version = slicer_version()
    if version >= OLDEST_SLICER:
        return ""
    return _(
        "PolyPose needs 3D Slicer {needed} or newer, and this is {found}: install the current stable version."
    ).format(needed=".".join(map(str, OLDEST_SLICER)), found=".".join(map(str, version)))


def python_executable() -> str:
    """PythonSlicer, which Slicer puts on its PATH; outside of the application this interpreter."""
    return shutil.which("PythonSlicer") or sys.executable


def child_environment() -> dict[str, str]:
    """The variables for PythonSlicer: those of this process, and PolyPoseLib's folder first on PYTHONPATH.

    PythonSlicer expects the environment that Slicer's launcher made, as Slicer itself passes it to pip; the
    one from before Slicer started (slicer.util.startupEnvironment) is for programs that are not Slicer's.
    """
    variables = dict(os.environ)
    inherited = variables.get("PYTHONPATH")
    variables["PYTHONPATH"] = os.pathsep.join([str(core_folder()), *([inherited] if inherited else [])])
    variables["PYTHONUNBUFFERED"] = "1"
    variables["PYTHONIOENCODING"] = "utf-8"
    variables["MPLBACKEND"] = "Agg"
    return variables
