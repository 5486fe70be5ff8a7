"""What counts as a silent failure and as a false alarm, on rows made by hand."""

import numpy as np
import pytest
from degraded_scores import (
    bones_right,
    coverage,
    false_alarm_percent,
    false_flags,
    is_broken,
    is_false_refusal,
    is_flagged,
    silent_failures,
)
from degraded_tables import coverage_table, describe, kinds_table, totals, write_degraded_tables


def bone(error, flagged=False, ratio=None):
    return {
        "tre_mean_mm": error,
        "tre_max_mm": 2 * error,
        "rest_mm": 8.0,
        "flagged": flagged,
        "interval_ratio": ratio,
        "along_mm": 1.0,
        "across_mm": 1.0,
        "covered": 0.0,
    }


def row(*bones, exit_status=0, recoverable=True, size_factor=1.0, kind="gamma", seed=0):
    made = {
        "kind": kind,
        "anatomy": "pelvis",
        "views": "2x60",
        "seed": seed,
        "pixels": 400,
        "exit_status": exit_status,
        "recoverable": recoverable,
        "size_factor": size_factor,
        "wall_seconds": 1.0,
        "measured_on": {"processor": "p", "cores": "2", "device": "cpu", "date": "2026-01-01"},
    }
    if bones:
        made["bones"] = {f"bone_{n}": each for n, each in enumerate(bones)}
    return made


@pytest.mark.parametrize(
    ("one", "silent"),
    [
        (row(bone(3.1, ratio=1.2)), True),
        (row(bone(3.1)), True),
        (row(bone(2.9, ratio=9.0)), False),
        (row(bone(3.1, ratio=0.9)), False),
        (row(bone(30.0, flagged=True, ratio=2.0)), False),
        (row(bone(30.0, ratio=2.0), exit_status=3), False),
        (row(exit_status=2), False),
        (row(bone(0.8, ratio=2.0), size_factor=0.25), True),
        (row(bone(0.7, ratio=2.0), size_factor=0.25), False),
    ],
)
def test_a_silent_failure_is_a_wrong_bone_that_nothing_speaks_of(one, silent):
    assert bool(silent_failures(one)) == silent


@pytest.mark.parametrize(
    ("one", "alarm"),
    [
        (row(bone(1.4, flagged=True)), True),
        (row(bone(1.6, flagged=True)), False),
        (row(bone(1.4, flagged=True), size_factor=0.25), False),
        (row(bone(1.4)), False),
        (row(bone(1.4, flagged=True), recoverable=False, exit_status=3), True),
    ],
)
def test_a_false_flag_is_a_right_bone_called_inconsistent(one, alarm):
    assert bool(false_flags(one)) == alarm


@pytest.mark.parametrize(
    ("one", "alarm"),
    [
        (row(exit_status=2), True),
        (row(exit_status=2, recoverable=False), False),
        (row(bone(1.0), bone(1.2), exit_status=3), True),
        (row(bone(1.0), bone(3.2), exit_status=3), False),
        (row(bone(1.0), exit_status=3, recoverable=False), False),
        (row(bone(1.0)), False),
    ],
)
def test_a_false_refusal_is_one_of_a_case_that_could_be_right(one, alarm):
    assert is_false_refusal(one) == alarm


def test_right_bones_are_right_on_average_and_none_failed():
    assert bones_right(row(bone(1.0), bone(1.9)))
    assert not bones_right(row(bone(1.6), bone(1.7)))
    assert not bones_right(row(bone(0.1), bone(0.1), bone(3.5)))
    assert not bones_right(row())


def test_crashes_and_time_limits_are_broken():
    assert [is_broken(row(exit_status=status)) for status in (0, 1, 2, 3, -9, 130)] == [
        False,
        True,
        False,
        False,
        True,
        True,
    ]


def test_the_share_of_false_alarms_is_of_right_bones_only():
    rows = [row(bone(1.0, flagged=True), bone(1.0), bone(9.0, flagged=True)), row(bone(0.5), bone(0.5))]
    assert false_alarm_percent(rows) == pytest.approx(25)
    assert np.isnan(false_alarm_percent([row(bone(9.0))]))


def test_coverage_grows_with_the_scale():
    rows = [row(bone(1, ratio=0.5), bone(1, ratio=1.5), bone(9, flagged=True, ratio=0.1), bone(1))]
    assert np.allclose(coverage(rows, np.array([0.2, 1.0, 2.0])), [100 / 3, 200 / 3, 100])
    assert np.allclose(coverage(rows, np.array([0.2, 1.0, 2.0]), flagged=False), [0, 50, 100])
    assert np.isnan(coverage([row()], np.array([1.0]))).all()


def test_the_program_s_own_words_count_as_a_flag():
    from types import SimpleNamespace

    from PolyPoseLib.registration.bones.rejection import inconsistency_warnings

    scene = SimpleNamespace(names=("femur_left", "femur"))
    (warning,) = inconsistency_warnings(scene, {0: ("its rendering does not match X-ray 1",)})
    assert is_flagged("femur_left", {"warnings": [warning]})
    assert not is_flagged("femur", {"warnings": [warning]})
    assert not is_flagged("femur", {"warnings": ['structure "femur" has 50 voxels']})


def test_tables_hold_every_row(tmp_path):
    rows = [
        row(bone(1.0, ratio=0.4), kind="clean"),
        row(bone(4.0, ratio=3.0)),
        row(exit_status=2, kind="mirrored", recoverable=False),
    ]
    assert "| 3 | 1 | 1 | 0 | 0.0 | 0 | 2 | 0 |" in totals(rows)
    assert "| gamma* | 4.00 / 4.00 | 4.0 | 0 | 0/1 | 0/1 | 1 | 0 |" in kinds_table(rows)
    assert "| mirrored | - | - | 2 | 0/0 | 0/0 | 0 | 0 |" in kinds_table(rows)
    assert "silent: bone_0" in describe(rows[1])
    assert coverage_table(rows).count("\n") == 10
    write_degraded_tables(rows, tmp_path / "degraded.md")
    assert "2026-01-01: 3 rows" in (tmp_path / "degraded.md").read_text()
