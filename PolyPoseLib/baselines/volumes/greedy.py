"""Greedy diffeomorphic registration of the CT to the reconstruction, by picsl-greedy.

References
----------
P. A. Yushkevich et al., "Fast automatic segmentation of hippocampal subfields and medial temporal lobe subregions in 3
Tesla and 7 Tesla T2-weighted MRI", Alzheimer's & Dementia 2016; the program is that of ITK-SNAP's authors, Apache-2.0.

"""

from __future__ import annotations

import importlib
import io
from typing import Any

import numpy as np
import SimpleITK as sitk

from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, finite_field
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField

ITERATIONS = "100x50x10"
"""At a quarter, half and the whole resolution: the documentation's example."""

PATCH_RADIUS = "4x4x4"
"""Of the normalised cross-correlation, voxels.

It is the program's weighted one, WNCC, which leaves what is not in the mask out of every patch. With NCC the mask only
chooses patches, of which those along its edge are half of what nobody measured: from two views of a pelvis bones
ended 21 mm from the truth instead of 9.
"""


class FdkGreedy(FdkSystem):
    """FDK, then greedy with masked patch-wise normalised cross-correlation and its default smoothing; no affine stage.

    The world's axes are those of the CT, and an affine motion of the whole body would only undo the anchor's.
    """

    name = "fdk-greedy"
    needs = ("itk-rtk", "picsl-greedy")
    modules = ("itk.RTKPython", "picsl_greedy")

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        greedy: Any = importlib.import_module("picsl_greedy").Greedy3D()
        fixed, moving = pair.images()
        quiet = io.StringIO()
        greedy.execute(
            f"-V 0 -threads {setting.threads} -i fixed moving -gm seen -m WNCC {PATCH_RADIUS} -n {ITERATIONS} -o warp",
            out=quiet,
            err=quiet,
            fixed=fixed,
            moving=moving,
            seen=pair.seen_image(),
            warp=None,
        )
        # The warp is ITK's: mm along LPS, from the fixed to the moving image.
        vectors = sitk.GetArrayFromImage(greedy["warp"])
        return finite_field(pair, np.asarray(vectors, dtype=np.float32), self.name)
