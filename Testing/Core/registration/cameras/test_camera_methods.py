"""Which method finds an initial camera, and when a search is made as well."""

from dataclasses import replace

import numpy as np
import pytest
from quiet_run import quiet_run

from PolyPoseLib.data.found_camera import FoundCamera
from PolyPoseLib.data.landmarks import Landmarks
from PolyPoseLib.errors import UntrustedResultError
from PolyPoseLib.registration.cameras import initial
from PolyPoseLib.registration.cameras.initial import CAMERA_METHODS, METHODS, initial_camera
from PolyPoseLib.simulation.case_study import case_to_study


class Model:
    how = "learned"

    def __init__(self, covers=True):
        self.covered = covers

    def covers(self, xray):
        return self.covered

    def starts(self, xray):
        return []


def found(how, similarity=0.5, sure=True):
    return FoundCamera(np.eye(4), sure, (2.0, 10.0), how, (), similarity)


@pytest.fixture
def answers(monkeypatch):
    """What each method finds, at no cost; None finds nothing."""
    cameras = {name: found(name) for name in ("landmarks", "dicom", "learned", "search")}

    def answer(name):
        def find(*_):
            if cameras[name] is None:
                raise UntrustedResultError(name)
            return cameras[name]

        return find

    monkeypatch.setattr(initial, "landmark_camera", answer("landmarks"))
    monkeypatch.setattr(initial, "_searched_around", answer("dicom"))
    monkeypatch.setattr(initial, "learned_camera", answer("learned"))
    monkeypatch.setattr(initial, "searched_camera", answer("search"))
    return cameras


@pytest.fixture
def xray(simulated):
    """An X-ray of whose camera everything is known that a method may need."""
    given = case_to_study(simulated).xrays[0]
    landmarks = Landmarks(np.random.default_rng(0).normal(size=(6, 3)) * 50, np.full((6, 2), 10.0))
    return replace(given, landmarks=landmarks, initial_radius=(10.0, 50.0))


def find(scene, xray, method="auto", model=None):
    return initial_camera(quiet_run(scene), xray, method, model).how


def test_the_table_holds_every_method():
    names = [method.name for method in CAMERA_METHODS]
    assert set(METHODS) - {"auto"} == set(names) - {"given"}
    assert CAMERA_METHODS[-1].applies(None, None)  # a search always does


def test_auto_takes_the_first_that_applies(scene, xray, answers):
    model = Model()
    assert "given" in find(scene, replace(xray, initial_radius=None), model=model)
    assert find(scene, xray, model=model) == "landmarks"
    bare = replace(xray, landmarks=None)
    assert find(scene, bare, model=model) == "dicom"
    absent = replace(bare, extrinsic=None, camera="absent")
    assert find(scene, absent, model=model) == "learned"
    assert find(scene, absent, model=Model(covers=False)) == "search"
    assert find(scene, absent) == "search"


@pytest.mark.parametrize("method", ["dicom", "landmarks", "learned", "search"])
def test_a_method_that_is_named_is_the_one_that_is_used(scene, xray, answers, method):
    assert find(scene, xray, method, Model()) == method
    answers[method] = found(method, 0.1, sure=False)
    assert find(scene, xray, method, Model()) == method


@pytest.mark.parametrize("method", ["dicom", "learned"])
def test_auto_searches_as_well_when_a_camera_is_uncertain(scene, xray, answers, method):
    bare = replace(xray, landmarks=None)
    if method == "learned":
        bare = replace(bare, extrinsic=None, camera="absent")
    assert find(scene, bare, model=Model()) == method
    answers[method] = found(method, 0.3, sure=False)
    assert find(scene, bare, model=Model()) == "search"
    answers["search"] = found("search", 0.2, sure=False)
    assert find(scene, bare, model=Model()) == method
    answers[method] = None
    assert find(scene, bare, model=Model()) == "search"
