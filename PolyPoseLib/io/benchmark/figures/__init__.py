"""Figures of a benchmark: scores against the number of views, and pictures of one case."""

from PolyPoseLib.io.benchmark.figures.case_pictures import draw_case
from PolyPoseLib.io.benchmark.figures.curves import write_figures

__all__ = ["draw_case", "write_figures"]
