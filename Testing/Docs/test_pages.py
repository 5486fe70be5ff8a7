"""Links lead somewhere, the README keeps its promises, commands and code on the pages work."""

from __future__ import annotations

import argparse
import ast
import functools
import importlib
import importlib.util
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from pages import DOCS, NOTEBOOKS, PAGES, ROOT, anchors, code_blocks, commands, links, name_of

from PolyPoseLib.__main__ import build_parser

EVERYTHING = [*PAGES, *NOTEBOOKS]

_OTHER_WORDS = ("SUBCOMMAND", "--version", "--print-completion", "...")
"""What may follow the command's name in place of a subcommand."""


@pytest.mark.parametrize("page", EVERYTHING, ids=name_of)
def test_links_lead_to_files_and_headings(page) -> None:
    for link in links(page):
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{name_of(page)}: {link}"
        assert target.is_relative_to(ROOT), f"{name_of(page)}: {link} leaves the repository"
        if anchor:
            assert anchor in anchors(target), f"{name_of(page)}: {link}"


def test_every_screenshot_is_shown() -> None:
    shown = {link.rsplit("/", 1)[-1] for page in PAGES for link in links(page)}
    unused = {picture.name for picture in (ROOT / "Resources/Screenshots").glob("*.png")} - shown
    assert not unused


def test_the_readme_is_short_and_holds_one_test_command() -> None:
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) < 200
    assert len([line for line in lines if re.search(r'pip install "\.\[test\]"', line)]) == 1


def test_the_cpu_build_of_torch_comes_before_the_demo() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.index("download.pytorch.org/whl/cpu") < text.index("PolyPoseLib demo")


def test_every_page_is_in_the_navigation() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    for page in (*DOCS.rglob("*.md"), *NOTEBOOKS):
        assert page.relative_to(DOCS).as_posix() in navigation


@pytest.mark.parametrize("page", EVERYTHING, ids=name_of)
def test_commands_are_understood(page) -> None:
    for command in commands(page):
        words = shlex.split(command)
        parser = parser_of_all()
        if len(words) == 1 or words[0].isupper() or words[0].startswith("-"):
            assert words[0] in _subcommands(parser) or words[0] in _OTHER_WORDS
            continue
        try:
            parser.parse_args(words)
        except SystemExit as exit_:
            pytest.fail(f"{name_of(page)}: python -m PolyPoseLib {command}: exit status {exit_.code}")


def test_the_commands_page_names_every_subcommand() -> None:
    page = (DOCS / "command-line.md").read_text(encoding="utf-8")
    for name in _subcommands(build_parser()):
        assert f"\n## {name}\n" in page
        assert f"<!-- arguments: {name} -->" in page


@pytest.mark.parametrize("page", EVERYTHING, ids=name_of)
def test_python_code_compiles_and_its_imports_resolve(page) -> None:
    for code in code_blocks(page, "python"):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    _require_module(alias.name)
            elif isinstance(node, ast.ImportFrom):
                _require_names(node.module, [alias.name for alias in node.names])


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_what_mkdocstrings_documents_exists(page) -> None:
    for dotted in re.findall(r"^::: ([\w.]+)$", page.read_text(encoding="utf-8"), re.M):
        module, _, name = dotted.rpartition(".")
        _require_names(module, [name])


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_files_of_the_repository_that_pages_name_exist(page) -> None:
    text = page.read_text(encoding="utf-8")
    for path in re.findall(r"`((?:PolyPoseLib|PolyPose|Testing|Resources|docs)/[\w./-]*)`", text):
        assert (ROOT / path).exists(), f"{name_of(page)}: {path}"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_notebooks_carry_no_outputs(notebook) -> None:
    text = notebook.read_text(encoding="utf-8")
    assert '"outputs": [' not in text or set(re.findall(r'"outputs": \[(.?)', text)) == {"]"}
    assert len(text) < 100_000


@pytest.mark.slow
def test_the_site_builds_in_strict_mode(tmp_path) -> None:
    for needed in ("mkdocs", "material", "mkdocstrings", "mkdocs_jupyter"):
        pytest.importorskip(needed)
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr[-4000:]
    assert (tmp_path / "site/Resources/Screenshots/report.png").is_file()
    assert "--allow-outside" in (tmp_path / "site/command-line/index.html").read_text(encoding="utf-8")


@functools.cache
def parser_of_all() -> argparse.ArgumentParser:
    """Made once: the pages name hundreds of commands."""
    return build_parser()


def _subcommands(parser: argparse.ArgumentParser) -> list[str]:
    return [
        name
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for name in action.choices
    ]


def _require_module(name: str) -> None:
    """The modules of Slicer and its extensions are not there outside it."""
    if name.split(".")[0] == "PolyPoseSlicer":
        assert _slicer_file(name).is_file(), name
    elif name.split(".")[0] not in ("slicer", "PolyPose"):
        assert importlib.util.find_spec(name), name


def _slicer_file(module: str) -> Path:
    """The file of a module of the extension, which is not importable outside Slicer."""
    return ROOT / "PolyPose" / Path(*module.split(".")).with_suffix(".py")


def _require_names(module: str, names: list[str]) -> None:
    if module == "PolyPose":
        tree = ast.parse((ROOT / "PolyPose/PolyPose.py").read_text(encoding="utf-8"))
        assert set(names) <= {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
        return
    _require_module(module)
    if module.split(".")[0] == "PolyPoseSlicer":
        tree = ast.parse(_slicer_file(module).read_text(encoding="utf-8"))
        defined = {node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        imported = (node.names for node in tree.body if isinstance(node, ast.ImportFrom))
        assert set(names) <= defined | {each.name for found in imported for each in found}, module
    if module.split(".")[0] == "PolyPoseLib":
        found = importlib.import_module(module)
        for name in names:
            assert hasattr(found, name) or importlib.util.find_spec(f"{module}.{name}"), f"{module}.{name}"
