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

SETTINGS = {
    "Metric": METRICS,
    "Metric1Weight": "10",
    "NumberOfResolutions": "2",
    "GridSpacingSchedule": ("2", "1"),
    "FinalGridSpacingInPhysicalUnits": f"{GRID_MM:g}",
    "MaximumStepLength": "0.5",
}
"""What differs from the default map for B-splines, besides the mask.

With that map's four resolutions the optimiser does not fail: it finds what it is asked for. Smoothed over centimetres,
a reconstruction from few views is a slab that fills the field of view, and the body stretched by tens of millimetres
to fill it, too, correlates with it better (0.89) than the body in its place (0.33). The first of two resolutions is
smoothed by a voxel, and still sees motions of a bone's width. With its default weight of 1 the bending energy is of no
effect at nodes 16 mm apart (0.002 in the end, against a correlation of up to 1); with 100, a body that turned by 10
degrees was followed by a third of the way. A step is 0.5 mm at most, where the default is a voxel, 2 to 4 mm: 256 of
these go far along noise.
"""


class FdkElastix(FdkSystem):
    """FDK, then elastix's default map for B-splines with the settings above, and samples within the mask alone."""

    name = "fdk-elastix"
    needs = ("itk-rtk", "itk-elastix")
    modules = ("itk.RTKPython", "itk.ElastixPython")

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        itk: Any = importlib.import_module("itk")
        fixed, moving = (_itk_image(itk, pair, voxels) for voxels in (pair.fixed, pair.moving))
        seen = _itk_image(itk, pair, pair.seen.astype(np.uint8))
        parameters = itk.ParameterObject.New()
        chosen = parameters.GetDefaultParameterMap("bspline")
        for name, value in SETTINGS.items():
            chosen[name] = [value] if isinstance(value, str) else list(value)
        chosen["RandomSeed"] = [str(setting.seed % (1 << 31) or 1)]
        parameters.AddParameterMap(chosen)
        # transformix writes its field to a folder as well, the current one where it is given none.
        with tempfile.TemporaryDirectory() as folder, quiet_package(setting):
            elastix = itk.ElastixRegistrationMethod.New(fixed, moving)
            elastix.SetFixedMask(seen)
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
    """Voxels (k, j, i) of the pair's grid as an image of itk's own package."""
    image = itk.image_from_array(np.ascontiguousarray(voxels))
    image.SetSpacing([pair.spacing_mm] * 3)
    image.SetOrigin(pair.origin.tolist())
    return image
