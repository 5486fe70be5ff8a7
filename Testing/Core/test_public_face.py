"""``import PolyPoseLib`` is cheap, and every public name is what it says."""

import ast
import inspect
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import PolyPoseLib

HEAVY = ("torch", "numpy", "scipy", "SimpleITK", "pydicom", "numba", "matplotlib", "monai")


def test_importing_it_loads_nothing_heavy():
    code = f"import PolyPoseLib, sys; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_volumes_studies_and_results_are_read_without_torch():
    code = "import PolyPoseLib as pp, sys; pp.load_study, pp.load_result, pp.read_ct; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize("name", PolyPoseLib.__all__)
def test_every_public_name_is_there_and_documented(name):
    value = getattr(PolyPoseLib, name)
    assert name in dir(PolyPoseLib)
    assert name == "__version__" or inspect.getdoc(value)


def test_type_checkers_are_told_what_python_does():
    """The imports under TYPE_CHECKING name the objects that the lazy lookup gives."""
    tree = ast.parse(Path(PolyPoseLib.__file__).read_text(encoding="utf-8"))
    block = next(each for each in tree.body if isinstance(each, ast.If))
    declared = {}
    for each in block.body:
        assert isinstance(each, ast.ImportFrom)
        for alias in each.names:
            module = import_module(each.module)
            declared[alias.asname or alias.name] = getattr(module, alias.name)
    assert declared == {
        name: getattr(PolyPoseLib, name) for name in PolyPoseLib.__all__ if name != "__version__"
    }


def test_the_page_of_the_api_lists_every_public_name():
    page = (Path(__file__).parents[2] / "docs/python-api.md").read_text(encoding="utf-8")
    assert not [name for name in PolyPoseLib.__all__ if name != "__version__" and f"`{name}`" not in page]


def test_unknown_names_are_refused_as_python_does_it():
    with pytest.raises(AttributeError, match="no attribute 'registr'"):
        PolyPoseLib.registr  # noqa: B018
