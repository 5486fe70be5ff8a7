"""The table of systems, and how a user names one of their own."""

import re
import sys
from importlib import metadata
from types import SimpleNamespace

import pytest
from benchmark_case import MY_SYSTEMS

from PolyPoseLib.benchmark.systems import (
    SYSTEMS,
    NamedSystem,
    file_part,
    installing,
    load_system,
    missing_packages,
    named_systems,
    require_packages,
)
from PolyPoseLib.cli.benchmark import system_line
from PolyPoseLib.errors import InputError


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """The folder of a user's own systems, in which the command runs."""
    (tmp_path / "my_systems.py").write_text(MY_SYSTEMS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "my_systems", raising=False)
    yield tmp_path
    sys.modules.pop("my_systems", None)


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_system_of_the_table_imports_without_its_packages_and_fulfils_the_protocol(name, monkeypatch):
    for package in ("itk", "picsl_greedy", "fireants", "unigradicon", "icon_registration", "convexadam"):
        monkeypatch.setitem(sys.modules, package, None)
    system = load_system(SYSTEMS[name])
    assert system.name == name
    assert all(need.strip() == need and need for need in system.needs)
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) and file_part(name) == name


def test_a_users_own_systems_are_named_by_their_class(mine):
    assert named_systems(["rest", "my_systems:Mine", "short=my_systems:Mine", "rest"]) == (
        NamedSystem("rest", SYSTEMS["rest"]),
        NamedSystem("my_systems:Mine", "my_systems:Mine", own=True),
        NamedSystem("short", "my_systems:Mine", own=True),
    )
    assert load_system("my_systems:Mine").name == "mine"
    assert [each.name for each in named_systems(["all"])] == list(SYSTEMS)


def test_naming_a_system_runs_none_of_its_code(mine):
    (mine / "my_systems.py").write_text("raise SystemExit('it was run')")
    (mine / "kit").mkdir()
    (mine / "kit/__init__.py").write_text("raise SystemExit('it was run')")
    (mine / "kit/inner.py").write_text("")
    assert len(named_systems(["my_systems:Mine", "kit.inner:Mine"])) == 2


def test_a_changed_file_makes_another_system(mine):
    (system,) = named_systems(["my_systems:Mine"])
    before = system.code
    assert before == system.code
    (mine / "my_systems.py").write_text(MY_SYSTEMS + "# changed\n")
    assert before != system.code
    assert NamedSystem("rest", SYSTEMS["rest"]).code == SYSTEMS["rest"]


def test_another_version_of_a_package_makes_another_system(monkeypatch):
    """Its rows would stand in one line with those of the version before."""
    versions = {"itk-rtk": "2.7.0", "picsl-greedy": "1.4"}

    def version(name):
        if name not in versions:
            raise metadata.PackageNotFoundError(name)
        return versions[name]

    monkeypatch.setattr(metadata, "version", version)
    (system,) = named_systems(["fdk-greedy"])
    codes = [system.code]
    for change in ({"picsl-greedy": "1.5"}, {"itk-rtk": "2.8.0"}, {"unrelated": "1"}):
        versions |= change
        codes.append(system.code)
    del versions["picsl-greedy"]
    codes.append(system.code)
    assert len(set(codes)) == 4 and codes[2] == codes[3]
    assert missing_packages(load_system(system.path)) == ["picsl-greedy"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["polypos"], 'did you mean "polypose"'),
        (["absent_module:Mine"], 'there is no module "absent_module"'),
        (["my_systems.inner:Mine"], 'there is no module "my_systems.inner"'),
        (["my_systems:"], "names no class"),
        (["../my_systems:Mine"], "names no class"),
        (["my systems:Mine"], "names no class"),
        (["a/b=my_systems:Mine"], "cannot be a name"),
        (["=my_systems:Mine"], "cannot be a name"),
        (["rest=my_systems:Mine"], "is a system of the table"),
        (["all=my_systems:Mine"], "is a system of the table"),
        (["a=my_systems:Mine", "a=my_systems:Crashes"], 'two systems are called "a"'),
        (["my_systems.Mine=my_systems:Mine", "my_systems:Mine"], "two systems are called"),
        (["x\n\x1b[2Jy:"], "names no class"),
    ],
)
def test_wrong_names_are_refused_in_one_sentence(mine, words, said):
    with pytest.raises(InputError) as refused:
        named_systems(words)
    assert said in str(refused.value) and str(refused.value).isprintable()


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("my_systems:Absent", "no class of that name"),
        ("my_systems:np", "no class of that name"),
        ("my_systems:NoFit", 'a method "fit(study, setting)"'),
        ("PolyPoseLib.errors:InputError", 'a text "name"'),
        ("builtins:frozenset", 'a text "name"'),
    ],
)
def test_a_class_that_is_no_system_is_refused(mine, path, said):
    with pytest.raises(InputError, match=re.escape(said)):
        load_system(path)


def test_packages_are_looked_up_by_their_names_for_pip(mine):
    system = load_system("my_systems:NeedsMore")
    assert missing_packages(system) == ["no-such-package-4711[extra]>=2"]
    with pytest.raises(InputError, match=r"pip install no-such-package-4711\[extra\]>=2"):
        require_packages(system)
    require_packages(load_system("my_systems:Mine"))


def test_a_system_says_itself_how_to_get_what_pip_alone_would_get_wrongly(monkeypatch):
    def absent(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", absent)
    for name in ("fdk-fireants", "fdk-unigradicon"):
        system = load_system(SYSTEMS[name])
        (fix,) = set(system.fixes.values())
        assert "--no-deps" in fix and installing(system, list(system.fixes)) == fix
        assert system_line(name, SYSTEMS[name])[-1] == f"no: pip install itk-rtk, and {fix}"
    greedy = load_system(SYSTEMS["fdk-greedy"])
    assert installing(greedy, missing_packages(greedy)) == "pip install itk-rtk picsl-greedy"


def test_the_rigid_system_reads_a_camera_model_of_the_benchmark(tmp_path):
    (tmp_path / "model.pt").write_bytes(b"none")
    study = SimpleNamespace(ct=None, structures=None, anchor="pelvis")
    with pytest.raises(InputError, match=r"model\.pt"):
        load_system(SYSTEMS["rigid"]).load_model(study, tmp_path / "model.pt")
