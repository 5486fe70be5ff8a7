"""Runs of a benchmark in the folder that the fixture "home" makes."""

import SimpleITK as sitk

from PolyPoseLib.benchmark.run import Benchmark, run_benchmark
from PolyPoseLib.benchmark.systems import named_systems
from PolyPoseLib.data.benchmark.job import CaseSource, RunSettings
from PolyPoseLib.io.benchmark.benchmark_folder import opened_benchmark


def run(home, *methods, views=("own",), subject="case-1", progress=lambda step: None, **more):
    """The rows of a run of these systems."""
    data = home / "data"
    more = {"settings": RunSettings(), **more}
    with opened_benchmark(home / "out", "simulated", data, True) as folder:
        sources = tuple(CaseSource("simulated", str(data), subject, each) for each in views)
        return run_benchmark(Benchmark(sources, named_systems(methods), folder, **more), progress)


def change_one_voxel(home):
    """Of the CT, by 1 HU."""
    path = str(home / "data/case-1/ct.nii.gz")
    image = sitk.ReadImage(path)
    image[3, 4, 5] += 1
    sitk.WriteImage(image, path)
