"""What all 3D/3D systems share: reconstruct, register, and say which versions ran."""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np
import torch

from PolyPoseLib.baselines.packages import package_versions, quiet, require_package
from PolyPoseLib.baselines.volumes.pair import VolumePair, pair_of
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import CancelledError, InputError, NotFiniteError
from PolyPoseLib.similarity.torch_threads import torch_threads


class FdkSystem(ABC):
    """A 3D/3D registration of the CT to a cone-beam reconstruction of the X-rays.

    Attributes
    ----------
    name
        As --methods and the tables have it.
    needs
        Packages by their names for pip.
    modules
        The same packages as they are imported.
    fixes
        {package: how to install it} where the extra `baselines` does not bring it.

    """

    name: str
    needs: tuple[str, ...]
    modules: tuple[str, ...]
    fixes: dict[str, str] = {}  # noqa: RUF012 (never changed)

    def fit(self, study: Study, setting: SystemSetting) -> Motion:
        """Reconstruct the X-rays and register the CT to them; see :class:`PolyPoseLib.data.benchmark.system.System`."""
        self.require(setting)
        stop_if_cancelled(setting)
        pair = pair_of(study, setting.threads)
        stop_if_cancelled(setting)
        field = self.register(pair, setting)
        stop_if_cancelled(setting)
        return Motion(field, notes=(*package_versions(*self.needs), *self.notes(study)))

    def require(self, setting: SystemSetting) -> None:
        """Raise InputError when a package or a file of weights is missing, or the device is."""
        for module, package in zip(self.modules, self.needs, strict=True):
            require_package(module, package, self.name, self.fixes.get(package))
        if setting.device != "cpu" and not torch.cuda.is_available():
            raise InputError(f'{self.name}: there is no device "{setting.device}" here: give "cpu".')

    @abstractmethod
    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """The field from fixed to moving points, on the pair's grid; `require` was called before."""

    def notes(self, study: Study) -> tuple[str, ...]:
        """What the tables should say besides the versions, one line each."""
        unknown = [xray.name for xray in study.xrays if xray.camera != "known"]
        return ("reconstructed with initial cameras",) if unknown else ()


def stop_if_cancelled(setting: SystemSetting) -> None:
    """Raise CancelledError when the setting says so; packages that cannot be stopped are asked before and after."""
    if setting.cancelled():
        raise CancelledError("The registration was cancelled.")


@contextlib.contextmanager
def quiet_package(setting: SystemSetting) -> Iterator[None]:
    """Inside, a package is quiet, torch has the setting's threads and seed, and both are restored afterwards."""
    with (
        quiet(),
        torch_threads(setting.threads),
        torch.random.fork_rng(devices=[]),
    ):
        torch.manual_seed(setting.seed)
        yield


def finite_field(pair: VolumePair, vectors: np.ndarray, name: str) -> DisplacementField:
    """The field of vectors (k, j, i, 3) mm; raises NotFiniteError with the system's name where it diverged."""
    if not np.isfinite(vectors).all():
        raise NotFiniteError(f"{name} diverged: its displacements are not finite.")
    return pair.field(vectors)
