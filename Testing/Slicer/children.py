"""Small programs that stand for PolyPoseLib in a real child process; they take the same arguments."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

PROLOGUE = """
import json, os, signal, subprocess, sys, time
from pathlib import Path
arguments = sys.argv[1:]
output = Path(arguments[arguments.index("--output") + 1]) if "--output" in arguments else None
preview = arguments[arguments.index("--preview") + 1] if "--preview" in arguments else None
def tell(iteration, of=10, similarity=0.5, stage="joint 4 mm", **more):
    print(json.dumps(dict(stage=stage, iteration=iteration, of=of, similarity=similarity, seconds=0.1, **more)),
          flush=True)
"""

SLEEP_FOREVER = "tell(1)\nwhile True:\n    time.sleep(0.05)\n"
IGNORE_TERMINATION = (
    "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    "grandchild = subprocess.Popen([sys.executable, '-c', "
    '"import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(60)"])\n'
    "Path('grandchild.pid').write_text(str(grandchild.pid))\n" + SLEEP_FOREVER
)
RUBBISH = """
sys.stdout.buffer.write(b"\\xff\\xfe\\x00 not text\\n" + b"x" * 300000 + b"\\n{}\\n[1]\\nnull\\n")
sys.stdout.buffer.write(b'{"stage": "a", "iteration": "many", "of": 3}\\n{"stage": 1e999}\\n')
sys.stdout.buffer.write(b"[" * 100000 + b"\\n")
sys.stdout.buffer.flush()
tell(3, similarity=float("nan"))
tell(4)
"""


def python_slicer(folder: Path, body: str) -> Path:
    """A program named PythonSlicer in a folder, to be put on the PATH; POSIX only."""
    program = folder / "PythonSlicer"
    program.write_text(f"#!{sys.executable}\n" + PROLOGUE + textwrap.dedent(body))
    program.chmod(0o755)
    return program


def command(folder: Path, body: str) -> list[str]:
    """A command line that runs a program with this body."""
    script = folder / "child.py"
    script.write_text(PROLOGUE + textwrap.dedent(body))
    return [sys.executable, str(script)]
