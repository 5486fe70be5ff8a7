"""B-spline registration of the CT to the reconstruction, by elastix.

References
----------
S. Klein et al., "elastix: a toolbox for intensity-based medical image registration", IEEE TMI 2010; Apache-2.0.

"""

from __future__ import annotations

import importlib
import tempfile
from typing import Any

import numpy as np

from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, finite_field, quiet_package
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField

GRID_MM = 16.0
"""Distance of the B-spline's nodes: the manual's; with the default map's 10 mm small volumes folded."""

METRICS = ("AdvancedNormalizedCorrelation", "TransformBendingEnergyPenalty")
"""Both volumes are in HU. With mutual information, the default map's first metric, the optimiser diverged on known
motions: it ended 4 and 26 mm from the truth (grids of 16 and 10 mm), correlation 0.4 mm."""


class FdkElastix(FdkSystem):
    """FDK, then elastix's default map for B-splines (4 resolutions) with another metric and grid, see above."""

    name = "fdk-elastix"
    needs = ("itk-rtk", "itk-elastix")
    modules = ("itk.RTKPython", "itk.ElastixPython")

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        itk: Any = importlib.import_module("itk")
        fixed, moving = (_itk_image(itk, pair, voxels) for voxels in (pair.fixed, pair.moving))
        parameters = itk.ParameterObject.New()
        chosen = parameters.GetDefaultParameterMap("bspline")
        chosen["Metric"] = METRICS
        chosen["FinalGridSpacingInPhysicalUnits"] = [f"{GRID_MM:g}"]
        chosen["RandomSeed"] = [str(setting.seed % (1 << 31) or 1)]
        parameters.AddParameterMap(chosen)
        # transformix writes its field to a folder as well, the current one where it is given none.
        with tempfile.TemporaryDirectory() as folder, quiet_package(setting):
            elastix = itk.ElastixRegistrationMethod.New(fixed, moving)
            elastix.SetParameterObject(parameters)
            elastix.SetLogToConsole(False)
            elastix.SetNumberOfThreads(setting.threads)
            elastix.UpdateLargestPossibleRegion()
            transformix = itk.TransformixFilter.New(moving)
            transformix.SetTransformParameterObject(elastix.GetTransformParameterObject())
            transformix.SetComputeDeformationField(True)
            transformix.SetOutputDirectory(folder)
            transformix.SetLogToConsole(False)
            transformix.UpdateLargestPossibleRegion()
            vectors = itk.array_from_image(transformix.GetOutputDeformationField())
        return finite_field(pair, np.asarray(vectors, dtype=np.float32), self.name)


def _itk_image(itk: Any, pair: VolumePair, voxels: np.ndarray) -> Any:
    """One of the pair's volumes as an image of itk's own package."""
    image = itk.image_from_array(np.ascontiguousarray(voxels))
    image.SetSpacing([pair.spacing_mm] * 3)
    image.SetOrigin(pair.origin.tolist())
    return image
