"""Coupled convex optimisation and Adam on MIND descriptors, by convexadam.

References
----------
H. Siebert, L. Hansen, M. P. Heinrich, "Fast 3D registration with accurate optimisation and little learning for
Learn2Reg 2021", MICCAI workshops 2021; Apache-2.0.

"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import torch

from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, quiet_package
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import NotFiniteError

BLOCK = 6
"""Voxels along a side of the blocks of the package's search; those of its second stage have 2."""


class FdkConvexAdam(FdkSystem):
    """FDK, then convex_adam_pt with the package's own settings."""

    name = "fdk-convexadam"
    needs = ("itk-rtk", "convexadam")
    modules = ("itk.RTKPython", "convexAdam")

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        module: Any = importlib.import_module("convexAdam.convex_adam_MIND")
        fixed, moving = pair.padded_to(BLOCK)
        with quiet_package(setting):
            kji = module.convex_adam_pt(
                fixed,
                moving,
                dtype=torch.float32,
                device=torch.device(setting.device),
            )
        # Voxels along the array's own axes, to be added to a fixed index to get the moving one.
        if not np.isfinite(kji).all():
            raise NotFiniteError(f"{self.name} diverged: its displacements are not finite.")
        return pair.field_of_voxels(kji)
