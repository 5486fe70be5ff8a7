"""The subcommand simulate refuses numbers that no machine and no X-ray stand can serve, before anything is read."""

import numpy as np
import pytest

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.simulate import SimulationOptions, arc_angles, view_cameras
from PolyPoseLib.simulation.simulation_limits import MOST_PIXELS, OPTIONS, PIXELS, VIEWS, require_few_pixels

CT = Volume(np.zeros((4, 5, 6)), np.eye(4))


@pytest.mark.parametrize("command", ["simulate", "demo"])
@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--views", 0),
        ("--views", -3),
        ("--views", 10**6),
        ("--views", 10**30),
        ("--pixels", 0),
        ("--pixels", 32),
        ("--pixels", 5000),
        ("--pixels", 10**30),
        ("--seed", -1),
        ("--seed", 10**30),
        ("--arc", "nan"),
        ("--arc", 1e300),
        ("--rotation-error", "inf"),
        ("--rotation-error", -1.0),
        ("--translation-error", 1e300),
        ("--motion-scale", "nan"),
        ("--motion-scale", 1e6),
        ("--source-to-detector", 1e300),
        ("--source-to-detector", "nan"),
        ("--source-to-detector", 1.0),
        ("--source-to-isocenter", 1e300),
        ("--source-to-isocenter", "nan"),
        ("--source-to-isocenter", 0.0),
    ],
)
def test_numbers_of_no_use_are_refused_before_anything_is_made(tmp_path, capsys, command, option, value):
    absent = tmp_path / "absent"
    files = (
        ["--ct", absent, "--segmentation", absent, "--structures", absent] if command == "simulate" else []
    )
    argv = [command, *files, "--output", tmp_path / "case", option, value]
    assert main([str(each) for each in argv]) == 2
    message = capsys.readouterr().err
    assert f"{option} is {value}: give a" in message and message.count("\n") == 1
    assert not (tmp_path / "case").exists()


def test_many_large_views_are_refused_together(tmp_path, capsys):
    argv = ["demo", "--output", str(tmp_path / "case"), "--views", "100", "--pixels", "4096"]
    assert main(argv) == 2
    assert (
        "--views is 100 and --pixels 4096, together more than 134 million pixels" in capsys.readouterr().err
    )
    require_few_pixels(MOST_PIXELS // 4096**2, 4096)
    require_few_pixels(VIEWS[1], 400)


@pytest.mark.parametrize("name", OPTIONS)
def test_options_of_a_simulation_have_ends(name):
    least, largest = OPTIONS[name]
    for value in (least, largest):
        assert getattr(SimulationOptions(**{name: value}), name) == value
    for value in (least - 1e-3, largest * 1.01, 1e300, float("nan"), float("inf")):
        with pytest.raises(InputError, match=f"The simulation's {name} is .* give a number from"):
            SimulationOptions(**{name: value})


def test_views_that_cannot_be_made_are_refused():
    for views in (0, -1, VIEWS[1] + 1, 10**9):
        with pytest.raises(InputError, match="views is"):
            arc_angles(views, 30.0)
    for pixels in (0, PIXELS[1] + 1, 10**9):
        with pytest.raises(InputError, match="pixels is"):
            view_cameras(CT, (0.0,), pixels)
    with pytest.raises(InputError, match="together"):
        view_cameras(CT, [0.0] * 400, 4000)
    for distance in (1e300, 0.0, float("nan")):
        with pytest.raises(InputError, match="source_to_detector_mm is"):
            view_cameras(CT, source_to_detector_mm=distance)
    with pytest.raises(InputError, match="source_to_isocenter_mm is"):
        view_cameras(CT, source_to_isocenter_mm=2000.0)


def test_degradations_are_listed_without_any_other_argument(capsys):
    from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS

    with pytest.raises(SystemExit) as left:
        main(["simulate", "--list-degradations"])
    assert left.value.code == 0
    shown = capsys.readouterr().out
    assert all(f"\n{name} " in shown for name in DEGRADATIONS)


@pytest.mark.parametrize("command", ["simulate", "demo"])
@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--amplitude", "20"], "--amplitude is that of a named motion: give --motion as well"),
        (["--motion", "breathing", "--amplitude", "-1"], "--amplitude is -1"),
        (["--motion", "breathing", "--amplitude", "nan"], "give a number of mm from 0 to 60"),
        (["--motion", "jaw", "--amplitude", "1e300"], "give a number of degrees from 0 to 40"),
        (["--motion", "gait", "--motion-scale", "2"], "give --amplitude with --motion"),
    ],
)
def test_motions_are_checked_before_anything_is_read(tmp_path, capsys, command, more, words):
    assert main([command, "--sample", "pelvis", "--output", str(tmp_path / "case"), *more]) == 2
    message = capsys.readouterr().err
    assert words in message and message.count("\n") == 1
    assert not (tmp_path / "case").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [(["--degrade", "k_wire"], "k_wires"), (["--degrade", "gamma", "--format", "nifti"], "format")],
)
def test_degradations_are_checked_before_anything_is_read(tmp_path, capsys, more, words):
    assert main(["simulate", "--sample", "pelvis", "--output", str(tmp_path / "case"), *more]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "case").exists()
