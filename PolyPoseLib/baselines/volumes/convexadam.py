"""Coupled convex optimisation and Adam on MIND descriptors, by convexadam.

References
----------
H. Siebert, L. Hansen, M. P. Heinrich, "Fast 3D registration with accurate optimisation and little learning for
Learn2Reg 2021", MICCAI workshops 2021; Apache-2.0.

"""

from __future__ import annotations

import importlib
import tempfile
from pathlib import Path
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
    """FDK, then convex_adam_pt with the package's own settings and the mask, the same for both volumes.

    With all of the CT as the moving mask, bones of a pelvis were about as far off, and more of the field folded.
    """

    name = "fdk-convexadam"
    needs = ("itk-rtk", "convexadam")
    modules = ("itk.RTKPython", "convexAdam")

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        module: Any = importlib.import_module("convexAdam.convex_adam_MIND")
        fixed, moving, seen = pair.padded_to(BLOCK)
        with quiet_package(setting), tempfile.TemporaryDirectory() as folder:
            kji = module.convex_adam_pt(
                fixed,
                moving,
                use_mask=True,
                path_fixed_mask=_mask_file(Path(folder) / "fixed.nii", seen),
                path_moving_mask=_mask_file(Path(folder) / "moving.nii", seen),
                dtype=torch.float32,
                device=torch.device(setting.device),
            )
        # Voxels along the array's own axes, to be added to a fixed index to get the moving one.
        if not np.isfinite(kji).all():
            raise NotFiniteError(f"{self.name} diverged: its displacements are not finite.")
        return pair.field_of_voxels(kji)


def _mask_file(path: Path, mask: np.ndarray) -> Path:
    """A mask (k, j, i) as a file, which the package asks for; it has the axes of the arrays that are registered."""
    nibabel: Any = importlib.import_module("nibabel")
    nibabel.save(nibabel.Nifti1Image(mask.astype(np.uint8), np.eye(4)), path)
    return path
