"""A simulated case for benchmarks, and systems of a user's own that succeed, fail and cheat in every way."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tiny_case import tiny_case

from PolyPoseLib.io.cases import write_case
from PolyPoseLib.simulation.simulate import SimulatedCase

ROOT = Path(__file__).resolve().parents[3]

MY_SYSTEMS = '''
"""Systems of a user's own."""

import os
import signal
import sys
import time

import numpy as np

from PolyPoseLib.benchmark.own_systems import Rest
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError, memory_ran_out


class Mine(Rest):
    name = "mine"

    def fit(self, study, setting):
        with open("runs", "a") as stream:
            stream.write("run\\n")
        return super().fit(study, setting)


class Crashes(Mine):
    def fit(self, study, setting):
        os.kill(os.getpid(), signal.SIGSEGV)


class Raises(Mine):
    def fit(self, study, setting):
        raise ZeroDivisionError(f"of {os.getcwd()}\\nand more")


class Leaves(Mine):
    def fit(self, study, setting):
        sys.exit(0)


class Sleeps(Mine):
    def fit(self, study, setting):
        open("sleeps", "w").close()
        time.sleep(600)


class NeedsMore(Mine):
    needs = ("numpy>=1", "no-such-package-4711[extra]>=2")


class Refuses(Mine):
    def fit(self, study, setting):
        raise InputError(f"It takes one view, not {len(study.xrays)}: give --views 1x0.")


class Diverges(Mine):
    def fit(self, study, setting):
        field = super().fit(study, setting).field
        return Motion(DisplacementField(field.vectors * np.nan, field.affine))


class Swells(Mine):
    def fit(self, study, setting):
        try:
            raise MemoryError
        except MemoryError as error:
            raise memory_ran_out("weights.pt") from error


class Weighs(Mine):
    def fit(self, study, setting):
        return Motion(super().fit(study, setting).field, notes=(setting.weights[self.name].read_text(),))


class Names(Mine):
    def fit(self, study, setting):
        return Motion(super().fit(study, setting).field, notes=(setting.case,))


class Fits(Weighs):
    def fit(self, study, setting):
        if setting.weights[self.name].read_text() != "good":
            raise InputError("the weights were trained for other X-rays: train them for these.")
        return super().fit(study, setting)


class Changes(Mine):
    def fit(self, study, setting):
        study.ct.voxels[0, 0, 0] += 1
        return super().fit(study, setting)


class Coarse(Mine):
    def fit(self, study, setting):
        affine = study.ct.affine @ np.diag([2, 2, 2, 1])
        return Motion(DisplacementField(np.zeros((*study.ct.shape, 3)), affine))


class NoFit:
    name = "nofit"
    needs = ()


class Unconstructed(Mine):
    def __init__(self, what):
        pass
'''


def write_benchmark_data(folder: Path, simulated: SimulatedCase | None = None) -> Path:
    """A folder of one simulated case, case-1: the tiny one by default, too coarse to be registered well."""
    folder.mkdir()
    write_case(simulated or tiny_case(), folder / "case-1")
    return folder


def started_benchmark(home: Path, *arguments: object, **pipes: object) -> subprocess.Popen:
    """The command as a process whose group is its own as a terminal's foreground is, in a folder with MY_SYSTEMS."""
    (home / "my_systems.py").write_text(MY_SYSTEMS)
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return subprocess.Popen(
        [sys.executable, "-m", "PolyPoseLib", "benchmark", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=home,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        start_new_session=True,
    )
