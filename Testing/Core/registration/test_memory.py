"""Memory: the estimate grows with what needs it, and limits are met before anything ends the process."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import phantom_study
import pytest
from hypothesis import given
from hypothesis import strategies as st
from phantom_study import NAMES

import PolyPoseLib
from PolyPoseLib import pipeline
from PolyPoseLib.data.memory_need import MIB, MemoryNeed
from PolyPoseLib.data.options import Options
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import machine_memory
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.machine_memory import MemoryLeft, memory_left, require_memory, require_room
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.memory import needed_memory


def study_of(shape, spacing, count, pixels, views=2) -> Study:
    """A study of these sizes, whose large arrays take no memory."""
    labels = np.zeros(shape, np.int16)
    labels[0, 0, :count] = np.arange(1, count + 1)
    voxels = np.broadcast_to(np.float32(0), shape)
    intrinsics = np.array([[1000.0, 0, pixels / 2], [0, 1000.0, pixels / 2], [0, 0, 1]])
    image, mask = (np.broadcast_to(value, (pixels, pixels)) for value in (np.float32(0), np.True_))
    xrays = [Xray(image, mask, intrinsics, None, "absent", (1.0, 1.0), 1000.0, str(n)) for n in range(views)]
    names = tuple(f"s{n}" for n in range(count))
    return Study(Volume(voxels, np.diag([*spacing, 1.0])), Structures(names, labels), "s0", tuple(xrays))


MEASURED = [
    # CT (k, j, i), spacing mm, structures, pixels, resident and reserved MiB at the peak with two threads
    ((112, 101, 122), (3, 3, 3), 4, 400, 818, 1771),
    ((100, 128, 128), (3, 3, 4), 26, 500, 1168, 2268),
    ((200, 256, 256), (1.5, 1.5, 2), 26, 500, 2200, 3140),
    ((200, 256, 256), (1.5, 1.5, 2), 4, 500, 1390, 2330),
]


@pytest.mark.parametrize("case", MEASURED, ids=lambda case: f"{case[0]} x {case[2]}")
def test_the_estimate_is_a_little_more_than_what_was_measured(case, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0, 1}, raising=False)
    shape, spacing, count, pixels, resident, reserved = case
    need = needed_memory(study_of(shape, spacing, count, pixels), Options())
    assert resident < need.resident / MIB < 1.2 * resident
    assert reserved < need.address_space / MIB < 1.3 * reserved


@given(
    st.tuples(*[st.integers(8, 40)] * 3),
    st.floats(0.5, 4),
    st.integers(1, 8),
    st.integers(10, 50),
    st.sampled_from(["fast", "default", "paper"]),
    st.booleans(),
)
def test_more_of_anything_never_needs_less(shape, spacing, count, pixels, preset, composed):
    options = Options(preset=preset, composed=composed)
    need = needed_memory(study_of(shape, (spacing,) * 3, count, pixels), options)
    for larger in (
        study_of((2 * shape[0], *shape[1:]), (spacing,) * 3, count, pixels),
        study_of(shape, (spacing,) * 3, count, 2 * pixels),
        study_of(shape, (spacing,) * 3, count, pixels, views=3),
    ):
        assert needed_memory(larger, options).resident >= need.resident
    assert (
        needed_memory(study_of(shape, (spacing,) * 3, count, pixels), options, warps=False).resident
        <= need.resident
    )
    finer = replace(options, transform_spacing_mm=0.5)
    assert needed_memory(study_of(shape, (spacing,) * 3, count, pixels), finer).resident >= need.resident
    assert need.resident < need.address_space and need.loaded < need.resident
    assert need.resident > MemoryNeed.of_program().resident


def test_every_limit_is_named(monkeypatch):
    need = MemoryNeed(3 << 30, 5 << 30)
    for limit, more in (
        (MemoryLeft(2 << 30, 0, "here"), "3.0"),
        (MemoryLeft(4 << 30, 0, "here", True), "5.0"),
    ):
        monkeypatch.setattr(machine_memory, "memory_left", lambda limit=limit: [limit])
        with pytest.raises(
            InputError, match=rf"^It needs about {more} GiB of memory .* left here: crop the CT"
        ):
            require_memory(need, "It")
    monkeypatch.setattr(machine_memory, "memory_left", lambda: [MemoryLeft(3 << 30, 0, "here")])
    require_memory(need, "It")  # exactly enough
    with pytest.raises(InputError, match=r"^a\.nii: it takes 3\.5 GiB of memory, but 3\.0 GiB are left here"):
        require_room(3.5 * (1 << 30), "a.nii")


def test_what_is_loaded_already_is_not_counted_twice(monkeypatch):
    used = 2 << 30
    monkeypatch.setattr(machine_memory, "memory_left", lambda: [MemoryLeft(1 << 30, used, "here")])
    require_memory(MemoryNeed(2 << 30, 0, loaded=1 << 30), "It")
    with pytest.raises(InputError, match="GiB more than it has now"):
        require_memory(MemoryNeed(2 << 30, 0, loaded=0), "It")


def test_containers_limit_what_they_hold(tmp_path, monkeypatch):
    inner = tmp_path / "job" / "step"
    inner.mkdir(parents=True)
    for folder, limit, used in ((tmp_path / "job", "3000000", "1000000"), (inner, "max", "900000")):
        (folder / "memory.max").write_text(limit + "\n")
        (folder / "memory.current").write_text(used + "\n")
        (folder / "memory.stat").write_text("anon 5\ninactive_file 500000\n")
    lists = tmp_path / "cgroup"
    lists.write_text("0::/job/step\n")
    monkeypatch.setattr(machine_memory, "_CGROUPS", tmp_path)
    monkeypatch.setattr(machine_memory, "_OWN_CGROUPS", lists)
    assert [each.left for each in machine_memory._containers(7)] == [2_500_000]
    lists.write_text("3:cpu:/x\n5:memory:/job/step\n")
    (tmp_path / "memory" / "job" / "step").mkdir(parents=True)
    for place in (tmp_path / "memory" / "job" / "step", tmp_path / "memory"):
        (place / "memory.limit_in_bytes").write_text(
            "9223372036854771712\n" if place.name == "memory" else "4000\n"
        )
        (place / "memory.usage_in_bytes").write_text("1000\n")
    assert [each.left for each in machine_memory._containers(7)] == [3000]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says all of it")
def test_this_machine_says_what_is_left():
    limits = list(memory_left())
    assert any(each.limit == "on this machine" and each.left > 0 and each.used > 10 * MIB for each in limits)


@pytest.mark.parametrize(("compiles", "said"), [(False, r"0\.\d"), (True, r"1\.\d")])
def test_a_registration_that_cannot_fit_is_refused_before_it_begins(compiles, said, monkeypatch):
    steps = []
    monkeypatch.setattr(pipeline, "must_compile", lambda backend: compiles)
    monkeypatch.setattr(machine_memory, "memory_left", lambda: [MemoryLeft(300 * MIB, 0, "here")])
    with pytest.raises(InputError, match=rf"^The registration needs about {said} GiB"):
        register(study_of((10, 11, 12), (3, 3, 3), 2, 20), progress=steps.append)
    assert not steps


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[1]),) * 2)
from PolyPoseLib.__main__ import main
sys.exit(main(sys.argv[2:]))
"""


def run_limited(limit: float, arguments: list[str]) -> subprocess.CompletedProcess:
    root = str(Path(PolyPoseLib.__file__).parents[1])
    return subprocess.run(
        [sys.executable, "-c", LIMITED, str(int(limit)), *arguments],
        capture_output=True, text=True, timeout=900, env={**os.environ, "PYTHONPATH": root},
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="limits of address space are not kept elsewhere")
def test_a_study_runs_under_a_limit_a_little_above_its_estimate_and_not_far_below(tmp_path):
    write_case(
        phantom_study.case(), tmp_path / "case", label_ids={name: [n] for n, name in enumerate(NAMES, 1)}
    )
    study = tmp_path / "case" / "study.json"
    need = needed_memory(Study.load(study), Options()).address_space
    arguments = [
        "register",
        str(study),
        "--output",
        str(tmp_path / "out"),
        "--progress",
        "none",
        "--preset",
        "fast",
    ]
    for share in (0.3, 0.5):
        done = run_limited(share * need, arguments)
        assert done.returncode == 2, done.stderr
        assert re.search(r"needs about \d\.\d GiB of memory .* \(ulimit -v\): crop the CT", done.stderr)
        assert not (tmp_path / "out").exists()
    done = run_limited(1.3 * need, arguments)
    assert done.returncode in (0, 3), done.stderr
    assert (tmp_path / "out" / "result.json").is_file()


PEAK = """
import resource, sys
from PolyPoseLib.__main__ import main
status = main(sys.argv[1:])
print("PEAK", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
sys.exit(status)
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the peak is in other units")
def test_the_first_run_compiles_within_its_estimate_and_the_second_within_less(tmp_path):
    pytest.importorskip("numba")
    write_case(
        phantom_study.case(), tmp_path / "case", label_ids={name: [n] for n, name in enumerate(NAMES, 1)}
    )
    study = tmp_path / "case" / "study.json"
    command = [sys.executable, "-c", PEAK, "register", str(study), "--progress", "none", "--preset", "fast"]
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(PolyPoseLib.__file__).parents[1]),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }
    report = 150 * MIB
    for number, compiles in enumerate((True, False)):
        done = subprocess.run(
            [*command, "--output", str(tmp_path / f"out{number}")],
            capture_output=True, text=True, timeout=900, env=environment,
        )  # fmt: skip
        assert done.returncode in (0, 3), done.stderr
        peak = 1024 * int(re.search(r"PEAK (\d+)", done.stdout)[1])
        need = needed_memory(Study.load(study), Options(preset="fast"), compiles=compiles).resident
        assert 0.5 * need < peak < need + report
