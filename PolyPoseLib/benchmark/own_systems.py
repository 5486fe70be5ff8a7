"""PolyPose itself as systems of a benchmark, and doing nothing, which every system must beat."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.options import Options, Weighting
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.geometry.rigid import perturbation_between
from PolyPoseLib.simulation.simulate import perturbed_camera

ROTATION_DEG, TRANSLATION_MM = 4.0, 15.0
"""By which ``polypose-found`` has its initial cameras off, as ``polypose simulate`` has them."""

_FIELD_MM = 4.0
"""Grid of a field that is zero everywhere."""


class Rest:
    """Nothing moves."""

    name = "rest"
    needs: tuple[str, ...] = ()

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """The identity, of every structure as well."""
        affine, shape = covering_grid(study.ct.affine, study.ct.shape, _FIELD_MM, keep_coarser=False)
        field = DisplacementField(np.zeros((*shape, 3), np.float32), affine)
        return Motion(field, {name: np.eye(4) for name in study.structures.names})


class PolyPose:
    """The default method; cameras that the study does not call known are found."""

    name = "polypose"
    needs: tuple[str, ...] = ()
    options: Mapping[str, Any] = {}
    """Beside the study's own."""

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """Register as the command does, without the intervals, which no other system computes."""
        return self._motion(study, self._registered(study, setting))

    def _registered(self, study: Study, setting: SystemSetting) -> Result:
        from PolyPoseLib.pipeline import register

        own = {
            "threads": setting.threads,
            "device": setting.device,
            "seed": setting.seed,
            "uncertainty": False,
        }
        asked = dataclasses.replace(study, options={**study.options, **own, **self.options})

        def tell(step: Progress) -> None:
            setting.progress(step.iteration, step.of, step.similarity)

        return register(asked, progress=tell, cancel=setting.cancelled)

    def _motion(self, study: Study, result: Result, *notes: str) -> Motion:
        doubts = [f"Not to be trusted: {result.distrust_clauses}."] if result.distrust else []
        versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
        poses = {name: each.fixed_to_moving for name, each in result.structures.items()}
        return Motion(result.transform, poses, (versions, *notes, *doubts), self.weighting(study))

    def weighting(self, study: Study) -> Weighting:
        """How the fit of a study weights its structures' motions."""
        from PolyPoseLib.registration.presets import weighting_of

        return weighting_of(Options.from_dict({**study.options, **self.options}))


class Paper(PolyPose):
    """The published method: the preset "paper"."""

    name = "paper"
    options: Mapping[str, Any] = {"preset": "paper"}


class PolyPoseFound(PolyPose):
    """The default method from wrong cameras, which it has to find: what clinics give instead of true ones."""

    name = "polypose-found"

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """Register with every known camera turned about the anchor's centre and shifted, and called initial."""
        known = [number for number, xray in enumerate(study.xrays) if xray.camera == "known"]
        if not known:
            raise InputError(
                "No camera of this case is known, so that polypose itself finds all of them: compare polypose instead."
            )
        centre = study.structures.centroids(study.ct.affine)[study.structures.index(study.anchor)]
        rng = _case_rng(setting)
        xrays = [_misplaced(xray, centre, rng) if xray.camera == "known" else xray for xray in study.xrays]
        result = self._registered(dataclasses.replace(study, xrays=tuple(xrays)), setting)
        errors = [_error(study.xrays[number], result.cameras[number].camera, centre) for number in known]
        degrees, millimetres = np.max(errors, axis=0)
        return self._motion(
            study,
            result,
            f"Cameras started {ROTATION_DEG:g} degrees and {TRANSLATION_MM:g} mm off and ended within {degrees:.2f} "
            f"degrees and {millimetres:.2f} mm of the true ones, about the anchor's centre.",
        )


def _case_rng(setting: SystemSetting) -> np.random.Generator:
    """Random numbers of a seed and a case: with one error for all, a lucky draw would be so in every subject.

    Python's own hash of a text is another one in every process.
    """
    digest = hashlib.sha256(setting.case.encode("utf-8", "surrogateescape")).digest()
    return np.random.default_rng([setting.seed, *np.frombuffer(digest, dtype="<u4").tolist()])


def _misplaced(xray: Xray, centre: np.ndarray, rng: np.random.Generator) -> Xray:
    camera = perturbed_camera(_camera_of(xray), centre, rng, ROTATION_DEG, TRANSLATION_MM)
    return dataclasses.replace(xray, extrinsic=camera.extrinsic, camera="initial", initial_radius=None)


def _error(xray: Xray, found: Camera, centre: np.ndarray) -> tuple[float, float]:
    """Degrees, and mm at a point (3,), between a known camera and the one that was found."""
    true = _camera_of(xray).extrinsic
    difference = perturbation_between(true, found.extrinsic, true[:3, :3] @ centre + true[:3, 3])
    return float(np.degrees(np.linalg.norm(difference[:3]))), float(np.linalg.norm(difference[3:]))


def _camera_of(xray: Xray) -> Camera:
    assert xray.extrinsic is not None  # of every camera that is known
    return Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
