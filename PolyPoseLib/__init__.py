"""PolyPose: polyrigid deformable 2D/3D registration of one CT to two or more X-rays.

    import PolyPoseLib as pp

    study = pp.load_study("case/study.json")
    result = pp.register(study)
    pp.save_result(result, "case/result")

The names below are the public face; everything else may move. They are imported when they are first used, so that
``import PolyPoseLib`` itself loads neither torch nor SimpleITK.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from PolyPoseLib.data.options import Options
    from PolyPoseLib.data.progress import Progress
    from PolyPoseLib.data.result import Result
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.study import Study
    from PolyPoseLib.data.tracking.correction import Correction
    from PolyPoseLib.data.truth import Truth
    from PolyPoseLib.data.volume import Volume
    from PolyPoseLib.data.xray import Xray
    from PolyPoseLib.errors import CancelledError, InputError, PolyPoseError, UntrustedResultError
    from PolyPoseLib.evaluation.score import score_result as evaluate
    from PolyPoseLib.geometry import se3
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.io.dicom_export.export import export_dicom
    from PolyPoseLib.io.results import load_result, save_result
    from PolyPoseLib.io.studies import load_study
    from PolyPoseLib.io.tracking.sequences import load_sequence
    from PolyPoseLib.io.tracking.tracks import load_track, save_track
    from PolyPoseLib.io.truths import load_truth
    from PolyPoseLib.io.volumes import read_ct
    from PolyPoseLib.pipeline import register
    from PolyPoseLib.rendering.projector import render
    from PolyPoseLib.similarity.ncc import gmncc, ncc
    from PolyPoseLib.simulation.simulate import simulate_case as simulate
    from PolyPoseLib.tracking.follow import track
    from PolyPoseLib.warp.polyrigid import PolyrigidWarp

__all__ = [
    "Camera",
    "CancelledError",
    "Correction",
    "InputError",
    "Options",
    "PolyPoseError",
    "PolyrigidWarp",
    "Progress",
    "Result",
    "Structures",
    "Study",
    "Truth",
    "UntrustedResultError",
    "Volume",
    "Xray",
    "__version__",
    "evaluate",
    "export_dicom",
    "gmncc",
    "load_result",
    "load_sequence",
    "load_study",
    "load_track",
    "load_truth",
    "ncc",
    "read_ct",
    "register",
    "render",
    "save_result",
    "save_track",
    "se3",
    "simulate",
    "track",
]

_HOMES = {
    "Camera": "geometry.camera",
    "CancelledError": "errors",
    "Correction": "data.tracking.correction",
    "InputError": "errors",
    "Options": "data.options",
    "PolyPoseError": "errors",
    "PolyrigidWarp": "warp.polyrigid",
    "Progress": "data.progress",
    "Result": "data.result",
    "Structures": "data.structures",
    "Study": "data.study",
    "Truth": "data.truth",
    "UntrustedResultError": "errors",
    "Volume": "data.volume",
    "Xray": "data.xray",
    "evaluate": "evaluation.score:score_result",
    "export_dicom": "io.dicom_export.export",
    "gmncc": "similarity.ncc",
    "load_result": "io.results",
    "load_sequence": "io.tracking.sequences",
    "load_study": "io.studies",
    "load_track": "io.tracking.tracks",
    "load_truth": "io.truths",
    "ncc": "similarity.ncc",
    "read_ct": "io.volumes",
    "register": "pipeline",
    "render": "rendering.projector",
    "save_result": "io.results",
    "save_track": "io.tracking.tracks",
    "se3": "geometry.se3:",
    "simulate": "simulation.simulate:simulate_case",
    "track": "tracking.follow",
}
"""Module of each public name, then its name there if that is another; nothing after the colon means the module itself.
The imports above say the same to type checkers."""


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, renamed, original = _HOMES[name].partition(":")
    value = import_module(f"{__name__}.{module}")
    if not renamed or original:
        value = getattr(value, original or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
