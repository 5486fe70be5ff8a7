"""A digest stays while everything stays, and changes with anything."""

import copy
import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_case import tiny_case

from PolyPoseLib.benchmark.digests import digest_of, file_digest, run_digest
from PolyPoseLib.data.benchmark.case import BenchmarkCase, CaseTruth
from PolyPoseLib.data.benchmark.job import RunSettings
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.case_study import case_to_study

plain = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats(-2, 2) | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=40, deadline=None)
@given(plain, plain)
def test_equal_values_and_only_these_have_one_digest(first, second):
    assert digest_of(first) == digest_of(copy.deepcopy(first))
    assert (digest_of(first) == digest_of(second)) == (repr(_ordered(first)) == repr(_ordered(second)))


def _ordered(value):
    if isinstance(value, dict):
        return ("mapping", [(key, _ordered(value[key])) for key in sorted(value, key=repr)])
    return [_ordered(each) for each in value] if isinstance(value, list) else value


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (["ab", "c"], ["a", "bc"]),
        ([[1], 2], [[1, 2]]),
        (np.zeros(4), np.zeros((2, 2))),
        (np.zeros(2, np.float32), np.zeros(1, np.float64)),
        (np.array([1], "<i4"), np.array([1], ">i4")),
        (1, True),
        (1, 1.0),
        ("1", 1),
        ("a", Path("a")),
        (0.0, -0.0),
        ({"a": 1, "b": 2}, {"a": 2, "b": 1}),
        (np.zeros((3, 4)), np.zeros((3, 4)).T),
    ],
)
def test_what_looks_alike_is_told_apart(first, second):
    assert digest_of(first) != digest_of(second)


def test_layout_in_memory_and_order_of_keys_do_not_matter():
    values = np.arange(12.0).reshape(3, 4)
    assert (
        digest_of(values) == digest_of(np.asfortranarray(values)) == digest_of(np.repeat(values, 2, 0)[::2])
    )
    assert digest_of({"a": 1, "b": 2}) == digest_of({"b": 2, "a": 1})
    assert digest_of(np.float64(1)) == digest_of(np.float64(1)) != digest_of(1.0)
    assert digest_of(np.zeros((0, 3))) != digest_of(np.zeros((3, 0)))


@pytest.mark.parametrize("value", [object(), {1, 2}, np.array([object()]), len, 1j])
def test_what_cannot_be_compared_is_refused(value):
    with pytest.raises(TypeError):
        digest_of(value)


def test_every_part_of_a_case_counts():
    simulated = tiny_case()
    study = case_to_study(simulated, camera="known")
    labels = Volume(simulated.structures.labels, simulated.ct.affine)
    case = BenchmarkCase(
        "a-2x60", "simulated", "a", "2x60", study, {"pelvis": (1,)}, {"bones": ("pelvis",)},
        CaseTruth(tuple(simulated.cameras), labels, poses={"pelvis": np.eye(4)}),
    )  # fmt: skip
    voxels = study.ct.voxels.copy()
    voxels[3, 4, 5] += 1
    xray = study.xrays[1]
    image = xray.image.copy()
    image[7, 8] += 1e-3
    camera = simulated.cameras[0].with_extrinsic(
        simulated.cameras[0].extrinsic @ np.diag([-1.0, -1.0, 1.0, 1.0])
    )
    changed = [
        dataclasses.replace(case, name="b-2x60"),
        dataclasses.replace(case, labels={"pelvis": (2,)}),
        dataclasses.replace(case, groups={"bone": ("pelvis",)}),
        *(
            dataclasses.replace(case, study=dataclasses.replace(study, **change))
            for change in (
                {"ct": study.ct.with_voxels(voxels)},
                {"anchor": study.structures.names[1]},
                {"xrays": (study.xrays[0], dataclasses.replace(xray, image=image))},
                {"xrays": (study.xrays[0], dataclasses.replace(xray, camera="initial"))},
                {"xrays": study.xrays[::-1]},
                {"options": {"preset": "fast"}},
                {"source_segmentation": labels},
            )
        ),
        *(
            dataclasses.replace(case, truth=dataclasses.replace(case.truth, **change))
            for change in (
                {"labels": None},
                {"ct": study.ct},
                {"poses": {}},
                {"poses": {"pelvis": np.diag([1.0, -1.0, -1.0, 1.0])}},
                {"cameras": (camera, simulated.cameras[1])},
            )
        ),
    ]
    digests = [digest_of(each) for each in (case, *changed)]
    assert len(set(digests)) == len(digests)
    again = case_to_study(tiny_case(), camera="known")
    assert digest_of(again) == digest_of(study)


def test_a_run_is_known_by_all_that_its_row_depends_on(tmp_path):
    settings = RunSettings(1, "cpu", 0)
    digests = [
        run_digest("case", "code", settings, ""),
        run_digest("case2", "code", settings, ""),
        run_digest("case", "code2", settings, ""),
        run_digest("case", "code", RunSettings(2, "cpu", 0), ""),
        run_digest("case", "code", RunSettings(1, "cuda", 0), ""),
        run_digest("case", "code", RunSettings(1, "cpu", 1), ""),
        run_digest("case", "code", settings, "weights"),
    ]
    assert len(set(digests)) == len(digests) and digests[0] == run_digest("case", "code", settings, "")
    (tmp_path / "file").write_bytes(b"abc")
    assert file_digest(tmp_path / "file").startswith("ba7816bf8f01cfea414140de5dae2223")
