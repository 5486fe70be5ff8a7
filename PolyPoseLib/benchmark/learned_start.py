"""The rigid system as a benchmark runs it: from a camera model too, which is read from a file."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.baselines.rigid import Rigid
from PolyPoseLib.data.study import Study
from PolyPoseLib.registration.cameras.initial import Regressor


class RigidWithStart(Rigid):
    """One rigid body, also from the cameras of the model that --weights gives."""

    def __init__(self) -> None:
        super().__init__(_camera_model)


def _camera_model(study: Study, path: Path) -> Regressor:
    """A model of the study's CT; raises InputError when it is damaged or of another."""
    from PolyPoseLib.io.camera_models import load_regressor

    return load_regressor(path, study.ct, study.structures, study.anchor)
