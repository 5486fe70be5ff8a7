"""Runs that report to nobody, or to what a test hands in."""

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.run import Run
from PolyPoseLib.rendering.select import select_backend


def quiet_run(scene, progress=None, cancel=None, **soft_tissue) -> Run:
    """A run on the fastest backend; soft_tissue: what SoftTissue takes besides the scene."""
    return Run(SoftTissue(scene, **soft_tissue), select_backend(), Monitor(progress, cancel), "test")
