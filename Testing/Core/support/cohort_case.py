"""A cohort whose registrations take no time: small studies, and a stand-in for the command that registers.

The stand-in does what the study's comment says, and adds a line to the file "runs" beside the studies' folders.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from result_case import make_result
from small_study import write_small_study

from PolyPoseLib.io.results import save_summary

STAND_IN = """
import json, os, shutil, signal, sys, time
from pathlib import Path
from PolyPoseLib.cohort.guarded import watch_stdin

watch_stdin()
study, output = Path(sys.argv[2]), Path(sys.argv[4])
home = study.parent.parent
deed = json.loads(study.read_text())["comment"]
with (home / "runs").open("a") as stream:
    stream.write(f"{study.parent.name} {os.getpid()} {os.getppid()}\\n")
once = home / f"{study.parent.name}.once"
first = not once.exists()
once.touch()
print("INFO: it began")
if deed == "slow":
    time.sleep(60)
if deed == "brief":
    began = time.time()
    time.sleep(0.7)
    (home / f"{study.parent.name}.times").write_text(json.dumps([began, time.time()]))
if deed == "kill worker" and first:
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(60)
if deed == "crash" or (deed == "crash once" and first):
    os.kill(os.getpid(), signal.SIGSEGV)
if deed == "broken":
    print(f'polypose: {study}: the field "anchor" is missing: add it.', flush=True)
    sys.exit(2)
shutil.rmtree(output, ignore_errors=True)
shutil.copytree(home / "template", output)
if deed == "untrusted":
    fields = json.loads((output / "result.json").read_text())
    fields |= {"trusted": False, "distrust": ["no X-ray shows <b>the pelvis</b>"]}
    (output / "result.json").write_text(json.dumps(fields))
    sys.exit(3)
"""


def write_cohort(home: Path, deeds: dict[str, str]) -> Path:
    """Studies by name, each with what its registration does; the list of them. The stand-in lies beside it."""
    home.mkdir(exist_ok=True)
    save_summary(make_result(), home / "template", picture=False)
    (home / "template" / "report.html").write_text("a page")
    (home / "stand_in.py").write_text(STAND_IN)
    for name, deed in deeds.items():
        write_small_study(home / name, comment=deed)
    lines = ["id,site,study", *(f"{name},=1+1,{name}/study.json" for name in deeds)]
    path = home / "list.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def program(home: Path) -> tuple[str, ...]:
    """The command that stands in for the registration."""
    return (sys.executable, str(home / "stand_in.py"))


def runs(home: Path) -> list[tuple[str, int, int]]:
    """Study, process and worker of every registration that was started, in their order."""
    path = home / "runs"
    lines = path.read_text().splitlines() if path.exists() else []
    return [(name, int(own), int(parent)) for name, own, parent in (line.split() for line in lines)]


def is_alive(process: int) -> bool:
    """Whether a process runs; one that has ended and was not waited for does not."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state not in ("Z", "X")


RUN = """
import json, sys
from pathlib import Path
from PolyPoseLib.cohort.packages import require_packages
from PolyPoseLib.cohort.run import Cohort, run_cohort
from PolyPoseLib.data.cohort.settings import ClusterSettings, StudySettings
from PolyPoseLib.io.cohort.cohort_folder import opened_cohort
from PolyPoseLib.io.cohort.entries import read_entries

if __name__ == "__main__":
    require_packages()
    home, output, given = Path(sys.argv[1]), Path(sys.argv[2]), json.loads(sys.argv[3])
    program = (sys.executable, str(home / "stand_in.py"))
    study = StudySettings(program=program, cache="usual")
    with opened_cohort(output, home) as folder:
        cohort = Cohort(read_entries(home / "list.csv", False), folder, study, ClusterSettings(**given))
        try:
            run_cohort(cohort, lambda step: print(step.to_json(), flush=True))
        except KeyboardInterrupt as interrupt:
            sys.exit(str(interrupt))
"""


def started_run(home: Path, output: Path, **cluster: object) -> subprocess.Popen:
    """A run of the cohort as a process of its own, whose group is its own as a terminal's foreground is."""
    script = home / "run.py"
    script.write_text(RUN)
    root = str(Path(__file__).resolve().parents[3])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
    return subprocess.Popen(
        [sys.executable, str(script), str(home), str(output), json.dumps(cluster)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    )
