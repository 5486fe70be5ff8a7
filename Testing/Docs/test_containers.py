"""The container recipes: linted, not root, without a network at run time, and of one mind with each other.

No builder of images is needed here; CI builds and runs the CPU variant.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pages import DOCS, ROOT

FOLDER = ROOT / "Resources/containers"
DOCKERFILE = FOLDER / "Dockerfile"
APPTAINER = FOLDER / "polypose.def"

SECTIONS = {"arguments", "labels", "help", "files", "post", "environment", "runscript", "test"}


def instructions() -> list[tuple[str, str]]:
    """Instruction and argument of every line of the Dockerfile, continued lines joined."""
    text = re.sub(r"^#.*\n", "", DOCKERFILE.read_text(encoding="utf-8"), flags=re.M)
    lines = text.replace("\\\n", " ").splitlines()
    return [(line.split(None, 1)[0], line.split(None, 1)[1]) for line in lines if line.strip()]


def sections() -> dict[str, str]:
    """The sections of the Apptainer definition; its head under ""."""
    text = re.sub(r"^#.*\n", "", APPTAINER.read_text(encoding="utf-8"), flags=re.M)
    head, *rest = re.split(r"^%(\w+)\n", text, flags=re.M)
    return {"": head, **dict(zip(rest[::2], rest[1::2], strict=True))}


def stages() -> list[list[tuple[str, str]]]:
    """The instructions of every stage, from its FROM on."""
    found: list[list[tuple[str, str]]] = []
    for name, argument in instructions():
        if name == "FROM":
            found.append([])
        if found:
            found[-1].append((name, argument))
    return found


def test_hadolint_finds_nothing() -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    hadolint = shutil.which("hadolint", path=path)
    if hadolint is None:
        pytest.skip("needs hadolint")
    done = subprocess.run(
        [hadolint, "--no-color", str(DOCKERFILE)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_image_runs_the_command_as_somebody_who_is_not_root() -> None:
    final = dict(stages()[-1])
    assert final["USER"] == "10001" and "--uid 10001" in final["RUN"]
    assert final["ENTRYPOINT"] == '["polypose"]'
    names = [name for name, _ in stages()[-1]]
    assert "RUN" not in names[names.index("USER") :] and "EXPOSE" not in names


def test_nothing_is_fetched_at_run_time() -> None:
    environment = " ".join(argument for name, argument in stages()[-1] if name == "ENV")
    assert "PIP_NO_INDEX=1" in environment and "export PIP_NO_INDEX=1" in sections()["environment"]
    for text in (environment, sections()["runscript"], sections()["environment"]):
        assert not re.search(r"https?://|pip install|curl|wget", text)


def test_what_is_copied_is_there_and_is_all_that_is_sent() -> None:
    copied = [
        source
        for name, argument in instructions()
        if name == "COPY" and "--from" not in argument
        for source in argument.split()[:-1]
    ]
    in_apptainer = [line.split()[0] for line in sections()["files"].splitlines() if line.strip()]
    assert copied == in_apptainer and all((ROOT / source).exists() for source in copied)
    sent = (FOLDER / "Dockerfile.dockerignore").read_text().split()
    assert [each[1:] for each in sent if each.startswith("!")] == copied


def test_both_recipes_install_the_same() -> None:
    docker, apptainer = DOCKERFILE.read_text(encoding="utf-8"), APPTAINER.read_text(encoding="utf-8")
    for pattern in (
        r'"\.\[([\w,]+)\]"',
        r"^(?:ARG |\s+)(TORCH_INDEX=\S+)$",
        r"^(?:ARG |\s+)(PYTHON=\S+)$",
        r"(?<=--no-install-recommends) ([\w\- ]+?)\s*\\?$",
        r"--build-arg (TORCH_INDEX=\S+)",
    ):
        first, second = (re.findall(pattern, text, re.M) for text in (docker, apptainer))
        assert first == second and len(first) == 1, pattern
    extras = re.search(r'"\.\[([\w,]+)\]"', docker)[1].split(",")
    given = re.findall(r"^(\w+) = \[", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)
    assert set(extras) <= set(given)


def test_the_definition_has_the_sections_that_apptainer_knows() -> None:
    found = sections()
    assert set(found) - {""} == SECTIONS
    head = dict(line.split(": ", 1) for line in found[""].splitlines() if line.strip())
    assert head["Bootstrap"] == "docker" and head["From"] == "python:{{ PYTHON }}-slim-bookworm"
    used = set(re.findall(r"\{\{ (\w+) \}\}", APPTAINER.read_text(encoding="utf-8")))
    assert used == set(re.findall(r"^\s+(\w+)=", found["arguments"], re.M))


@pytest.mark.parametrize("section", ["post", "runscript", "test", "environment"])
def test_the_scripts_of_the_definition_are_sound(section, tmp_path) -> None:
    shell = shutil.which("sh")
    if shell is None:
        pytest.skip("needs a shell")
    done = subprocess.run(
        [shell, "-n"], input=sections()[section], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_page_names_the_recipes() -> None:
    page = (DOCS / "cohorts.md").read_text(encoding="utf-8")
    assert "`Resources/containers/Dockerfile`" in page and "`Resources/containers/polypose.def`" in page
