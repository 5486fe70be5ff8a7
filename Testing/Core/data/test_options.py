"""Options: every wrong name and value is one sentence."""

import json

import pytest

from PolyPoseLib.data.options import CHOICES, Options
from PolyPoseLib.data.paper_options import PaperOptions
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import InputError, nearest, unknown_name


def test_defaults_and_round_trip():
    assert Options.from_dict(None) == Options() == Options.from_dict({})
    options = Options(preset="fast", threads=2, seed=7, weights="mass", transform_spacing_mm=2.5)
    assert Options.from_dict(json.loads(json.dumps(options.to_dict()))) == options
    assert Options.from_dict(options) is options
    assert Options().to_dict() == {}
    for name, values in CHOICES.items():
        for value in values:
            assert getattr(Options.from_dict({name: value}), name) == value


def test_the_options_of_the_preset_paper_are_an_object_of_their_own():
    options = Options.from_dict({"preset": "paper", "paper": {"anchor": "held", "bone_multiplier": 1}})
    assert options.paper == PaperOptions(anchor="held", bone_multiplier=1)
    assert options.to_dict() == {"preset": "paper", "paper": {"anchor": "held", "bone_multiplier": 1}}
    assert Options.from_dict(json.loads(json.dumps(options.to_dict()))) == options
    assert options.updated(seed=4).paper == options.paper
    with pytest.raises(InputError, match='preset "fast"'):
        options.updated(preset="fast")


def test_changes_replace_only_what_is_given():
    options = Options(preset="fast", seed=3)
    assert options.updated(seed=None, threads=4) == Options(preset="fast", seed=3, threads=4)
    with pytest.raises(InputError, match="preset"):
        options.updated(preset="slow")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"presett": "fast"}, 'did you mean "preset"'),
        ({"zzz": 1}, "give one of preset, device"),
        ({"preset": "quick"}, '"default", "fast", "paper"'),
        ({"device": 3}, "device"),
        ({"threads": 0}, "from 1 to"),
        ({"threads": 10**30}, "from 1 to"),
        ({"threads": 10**5000}, "thousands of digits"),
        ({"threads": 1.5}, "whole number"),
        ({"threads": True}, "whole number"),
        ({"seed": -1}, "from 0 to"),
        ({"seed": 10**30}, "from 0 to"),
        ({"seed": None}, "seed"),
        ({"epsilon": 0}, "from 1e-06 to"),
        ({"epsilon": float("nan")}, "from 1e-06 to"),
        ({"epsilon": "big"}, "from 1e-06 to"),
        ({"epsilon": 10**400}, r"0000\.\.\.: give a number from 1e-06 to"),
        ({"epsilon": 1e300}, "to 1e\\+06"),
        ({"rotation_reach_mm": 10**400}, "from 0.1 to"),
        ({"rotation_reach_mm": 1e300}, "from 0.1 to"),
        ({"rotation_reach_mm": 1e-300}, "from 0.1 to"),
        ({"transform_spacing_mm": 10**400}, "from 0.1 to 4"),
        ({"transform_spacing_mm": 1e-3}, "from 0.1 to 4"),
        ({"preset": "x" * 10**6}, "xxx\\.\\.\\.: give one of"),
        ({"refine_cameras": 1}, "true or false"),
        ({"preview": ""}, "not empty"),
        ({"transform_spacing_mm": 5}, "from 0.1 to 4"),
        ([1], "must be an object"),
        ({"paper": {}}, 'does not go with the preset "default"'),
        ({"preset": "fast", "paper": {"anchor": "held"}}, 'the preset "paper"'),
        ({"preset": "paper", "paper": ["held"]}, "must be an object"),
        ({"preset": "paper", "paper": {"ancor": "held"}}, '"paper".*did you mean "anchor"'),
        ({"preset": "paper", "paper": {"anchor": "fixed"}}, 'paper.anchor.*"free", "held"'),
        ({"preset": "paper", "paper": {"anchor": [1]}}, "paper.anchor"),
        ({"preset": "paper", "paper": {"restart_adam": 1}}, "paper.restart_adam.*true or false"),
        ({"preset": "paper", "paper": {"camera_plateaus": None}}, "paper.camera_plateaus"),
        ({"preset": "paper", "paper": {"bone_multiplier": 0.5}}, "paper.bone_multiplier.*from 1 to 10"),
        ({"preset": "paper", "paper": {"bone_multiplier": True}}, "paper.bone_multiplier"),
        ({"preset": "paper", "paper": {"gradient_blur_px": float("nan")}}, "gradient_blur_px.*from 0 to 50"),
        ({"preset": "paper", "paper": {"gradient_blur_px": 10**400}}, "gradient_blur_px"),
    ],
)
def test_wrong_options_are_refused(options, words):
    with pytest.raises(InputError, match=words) as caught:
        Options.from_dict(options)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_progress_is_one_line_of_json():
    line = Progress("joint", 3, 10, 0.5, 1.23456).to_json()
    assert json.loads(line) == {
        "stage": "joint",
        "iteration": 3,
        "of": 10,
        "similarity": 0.5,
        "seconds": 1.235,
    }
    assert "\n" not in line
    assert json.loads(Progress("a", 0, 1, float("nan"), 0, "p.h5").to_json())["similarity"] is None
    assert json.loads(Progress("a", 0, 1, None, 0, "p.h5").to_json())["preview"] == "p.h5"


def test_the_nearest_name_is_found_whatever_its_case():
    assert nearest("PELVS", ["pelvis", "femur"]) == "pelvis"
    assert nearest("qqqq", ["pelvis", "femur"]) is None
    assert unknown_name("field", "qqqq", ["ct", "anchor"]).endswith("give one of ct, anchor.")
