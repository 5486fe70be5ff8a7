"""Scripts for shells name every subcommand and option and are valid; without shtab a sentence says what to do."""

import shutil
import subprocess
import sys

import pytest

from PolyPoseLib.__main__ import main
from PolyPoseLib.cli import commands

NAMES = [command.__name__.rpartition(".")[2] for command in commands()]


def printed(shell, capsys):
    pytest.importorskip("shtab")
    with pytest.raises(SystemExit) as stop:
        main(["--print-completion", shell])
    assert stop.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_a_script_names_what_can_be_completed(shell, capsys):
    script = printed(shell, capsys)
    assert "polypose" in script and all(name in script for name in NAMES)
    assert "--allow-outside" in script or shell == "tcsh"
    assert "--keep-doubtful" not in script


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_shell_understands_it(shell, capsys):
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    done = subprocess.run(
        [shell, "-n"], input=printed(shell, capsys), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and not done.stderr


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes_subcommands_and_options(capsys):
    script = printed("bash", capsys)
    ask = (
        "\nCOMP_WORDS=(polypose {words}); COMP_CWORD={last}; COMPREPLY=(); $(complete -p polypose | "
        'sed "s/.*-F \\([^ ]*\\).*/\\1/") polypose; printf "%s\\n" "${{COMPREPLY[@]}}"'
    )
    for words, last, wanted in (("re", 1, "register"), ("cameras --keep", 2, "--keep-uncertain")):
        done = subprocess.run(
            ["bash"],
            input=script + ask.format(words=words, last=last),
            capture_output=True,
            text=True,
            check=False,
        )
        assert wanted in done.stdout.split(), done.stderr


def test_without_shtab_one_sentence_names_the_package(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    with pytest.raises(SystemExit) as stop:
        main(["--print-completion", "bash"])
    assert stop.value.code == 2
    assert capsys.readouterr().err.splitlines() == [
        "polypose: shell completion is made by shtab, which is not installed: pip install shtab"
    ]
