"""What a run reports, in which stage, and when it makes a preview."""

from dataclasses import replace

import pytest
from phantom_study import phantom
from quiet_run import quiet_run

from PolyPoseLib.errors import CancelledError
from PolyPoseLib.registration.run import HELD
from PolyPoseLib.registration.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(*phantom(), "pelvis")


def test_steps_and_seconds_belong_to_the_stage(scene):
    steps = []
    run = quiet_run(scene, steps.append)
    with run.named("first").timed():
        run.named("first").step(1, 4, 0.5)
    run.named("second").step(0, 2)
    assert [(s.stage, s.iteration, s.of, s.similarity) for s in steps] == [
        ("first", 1, 4, 0.5),
        ("second", 0, 2, None),
    ]
    assert list(run.monitor.seconds) == ["first"]
    assert [entry["stage"] for entry in run.monitor.history] == ["first"]


def test_a_field_is_computed_only_when_somebody_wants_a_preview(scene):
    steps, asked, shown = [], [], []

    def field():
        asked.append(1)
        return "field"

    def preview(field):
        shown.append(field)
        return "preview.h5"

    quiet_run(scene, steps.append).step(0, 1, None, field)
    replace(quiet_run(scene), preview=preview).step(0, 1, None, field)
    assert not asked and steps[-1].preview is None
    replace(quiet_run(scene, steps.append), preview=preview).step(0, 1, None, field)
    assert (len(asked), shown, steps[-1].preview) == (1, ["field"], "preview.h5")


def test_a_cancelled_run_raises(scene):
    with pytest.raises(CancelledError):
        quiet_run(scene, cancel=lambda: True).step(0, 1)


@pytest.mark.parametrize(("share", "held"), [(0.1, 0), (0.3, 0), (0.5, 0.5), (0.7, 1), (1.0, 1)])
def test_joints_hold_what_metal_hides_and_no_other(scene, share, held):
    hidden = scene.moving[0]
    run = replace(quiet_run(scene), hidden={hidden: share})
    for before, after in zip(scene.articulations, run.articulations, strict=True):
        expected = 1 + HELD * held if hidden in (before.first, before.second) else 1
        assert after.weight == pytest.approx(expected)
        assert (after.first, after.second, after.slide_mm) == (before.first, before.second, before.slide_mm)
    assert all(joint.weight == 1 for joint in quiet_run(scene).articulations)
