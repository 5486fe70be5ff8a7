"""Whole fits, from X-rays to a field: every system beats doing nothing with nine views, and says what it lacks."""

import dataclasses
import importlib
import logging
import re
import warnings

import numpy as np
import pytest
import torch
from fdk_case import FdkCase

from PolyPoseLib.baselines import packages
from PolyPoseLib.baselines.volumes.anatomix import FdkAnatomix
from PolyPoseLib.baselines.volumes.convexadam import FdkConvexAdam
from PolyPoseLib.baselines.volumes.elastix import FdkElastix
from PolyPoseLib.baselines.volumes.fdk_system import finite_field
from PolyPoseLib.baselines.volumes.fireants import FdkFireAnts
from PolyPoseLib.baselines.volumes.greedy import FdkGreedy
from PolyPoseLib.baselines.volumes.unigradicon import (
    FdkMultiGradIcon,
    FdkMultiGradIconIo,
    FdkUniGradIcon,
    FdkUniGradIconIo,
)
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.errors import InputError, NotFiniteError

WITHOUT_WEIGHTS = (FdkGreedy, FdkConvexAdam, FdkFireAnts, FdkElastix)
WITH_WEIGHTS = (FdkUniGradIcon, FdkUniGradIconIo, FdkMultiGradIcon, FdkMultiGradIconIo, FdkAnatomix)


@pytest.fixture(scope="module")
def case():
    if not packages.is_installed("itk.RTKPython"):
        pytest.skip("itk-rtk is not installed")
    return FdkCase()


def fit(system, study):
    for module, package in zip(system.modules, system.needs, strict=True):
        if not packages.is_installed(module if module.startswith("itk.") else module.split(".")[0]):
            pytest.skip(f"{package} is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return system().fit(study, SystemSetting())


@pytest.mark.parametrize(
    "system",
    [FdkGreedy, *(pytest.param(each, marks=pytest.mark.long) for each in WITHOUT_WEIGHTS[1:])],
)
def test_nine_views_beat_doing_nothing(system, case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    motion = fit(system, case.study)
    assert not list(tmp_path.iterdir())  # nothing is written where the user stands
    found, at_rest = case.errors(motion.field)
    assert found < 0.9 * at_rest
    # The grid: at most 4 mm, over the whole CT.
    assert motion.field.spacing.max() <= 4
    inverse = np.linalg.inv(motion.field.affine)
    index = case.study.ct.corners() @ inverse[:3, :3].T + inverse[:3, 3]
    assert index.min() >= 0 and (index <= np.array(motion.field.shape[::-1]) - 1).all()
    # Versions that ran.
    for package in system.needs:
        assert any(re.fullmatch(rf"{package} \d[\w.]*", line) for line in motion.notes)


def test_initial_cameras_are_used_and_told(case):
    views = tuple(dataclasses.replace(each, camera="initial") for each in case.study.xrays)
    motion = fit(FdkGreedy, dataclasses.replace(case.study, xrays=views))
    assert "reconstructed with initial cameras" in motion.notes


@pytest.mark.parametrize("system", [*WITHOUT_WEIGHTS, *WITH_WEIGHTS], ids=lambda each: each.name)
def test_a_missing_package_is_one_sentence_with_its_fix(system, monkeypatch):
    monkeypatch.setattr(packages, "is_installed", lambda module: module != system.modules[-1])
    monkeypatch.setattr(importlib, "import_module", lambda name: None)
    with pytest.raises(InputError, match=r"^fdk-[a-z-]+ needs the package .*: pip install") as error:
        system().fit(None, SystemSetting())
    assert system.needs[-1] in str(error.value)
    if system.needs[-1] not in system.fixes:
        assert 'pip install "polypose[baselines]"' in str(error.value)


@pytest.mark.parametrize("system", WITH_WEIGHTS, ids=lambda each: each.name)
def test_missing_weights_are_one_sentence_with_their_source(system, monkeypatch, tmp_path):
    monkeypatch.setattr(packages, "is_installed", lambda module: True)
    monkeypatch.setattr(importlib, "import_module", lambda name: None)
    with pytest.raises(InputError, match=r"https://github\.com/.* --weights fdk-[a-z]+=FILE"):
        system().fit(None, SystemSetting())
    missing = tmp_path / "none.pth"
    with pytest.raises(InputError, match="there is no such file of weights"):
        system().fit(None, SystemSetting(weights={system.name: missing}))


def test_what_a_package_prints_and_logs_when_it_is_imported_is_not_shown(
    tmp_path, monkeypatch, capsys, caplog
):
    (tmp_path / "a_loud_package.py").write_text(
        "import logging\nprint('hello')\nlogging.getLogger('x').warning('hello')\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    packages.require_package("a_loud_package", "a-loud-package", "a system")
    assert capsys.readouterr().out == "" and not caplog.records
    logging.getLogger("x").warning("heard")
    assert caplog.records


def test_a_package_that_does_not_load_is_one_sentence(tmp_path, monkeypatch):
    (tmp_path / "half_installed.py").write_text("import a_module_that_nobody_has\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"does not load \(No module named 'a_module_that_nobody_has'\)"):
        packages.require_package("half_installed", "half-installed", "a system")


def test_no_cuda_is_one_sentence(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(packages, "is_installed", lambda module: True)
    monkeypatch.setattr(importlib, "import_module", lambda name: None)
    with pytest.raises(InputError, match='no device "cuda"'):
        FdkGreedy().fit(None, SystemSetting(device="cuda"))


def test_a_field_that_diverged_is_the_systems_own_failure():
    """Told apart from what a system cannot run on, of which nobody would say that it failed."""
    vectors = np.zeros((2, 2, 2, 3), np.float32)
    vectors[1, 1, 1, 1] = np.nan
    with pytest.raises(NotFiniteError, match="fdk-x diverged: its displacements are not finite"):
        finite_field(None, vectors, "fdk-x")
