"""The DICOM files from which the CT in the scene was loaded."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

import slicer

INSTANCES = "DICOM.instanceUIDs"
"""Attribute in which Slicer's DICOM module keeps what a volume was loaded from."""


def dicom_files(ct: slicer.vtkMRMLScalarVolumeNode) -> list[str]:
    """Paths of the CT's slices in Slicer's DICOM database; empty where one is not there."""
    database = getattr(slicer, "dicomDatabase", None)
    uids = (ct.GetAttribute(INSTANCES) or "").split()
    if database is None or not uids:
        return []
    paths = [str(database.fileForInstance(uid) or "") for uid in uids]
    return paths if all(path and os.path.isfile(path) for path in paths) else []


def gather(paths: Sequence[str], folder: Path) -> Path:
    """Put files of any folders into a new one of their own, as links where the disk allows it."""
    folder.mkdir()
    for number, path in enumerate(paths):
        target = folder / f"{number:05d}.dcm"
        try:
            os.link(path, target)
        except OSError:
            shutil.copyfile(path, target)
    return folder
