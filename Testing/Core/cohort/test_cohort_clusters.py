"""The machines of a cohort: job scripts of batch systems, running schedulers, and who may reach a worker."""

import os
import socket
import ssl
import subprocess
import sys

import pytest

from PolyPoseLib.cohort.batch_systems import BATCH_SYSTEMS, job_script
from PolyPoseLib.cohort.clusters import local_workers, machines, require_scheduler
from PolyPoseLib.data.cohort.settings import MEMORY, THREADS, ClusterSettings
from PolyPoseLib.errors import InputError

pytest.importorskip("dask_jobqueue")
pytest.importorskip("cryptography")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "logs/workers").mkdir(parents=True)
    return tmp_path


def test_the_job_script_of_slurm(folder):
    settings = ClusterSettings(
        "slurm", 40, 16, 32768, "12:00:00", "long", "bones", ("--constraint=ib",), ("module load apptainer",)
    )
    lines = job_script(settings, folder).splitlines()
    head = [line.removeprefix("#SBATCH ") for line in lines if line.startswith("#SBATCH")]
    assert {
        "-J polypose",
        "-p long",
        "-A bones",
        "-n 1",
        "--cpus-per-task=16",
        "-t 12:00:00",
        "--constraint=ib",
    } <= set(head)
    assert [line for line in head if line.startswith("--mem=")] == ["--mem=32G"]
    assert any(f"-o {folder}/logs/workers/" in line for line in head)
    command = lines[-1]
    assert lines.index("module load apptainer") < lines.index(command)
    assert f"--resources {THREADS}=16,{MEMORY}=32768" in command and "--nthreads 16" in command
    assert "tls://" in command and "--tls-key" in command and f"{folder}/.dask-jobqueue.worker" in command


@pytest.mark.parametrize("name", [name for name in BATCH_SYSTEMS if name != "slurm"])
def test_every_batch_system_has_a_job_script(folder, name):
    text = job_script(ClusterSettings(name, cores=4, memory_mib=8192, walltime="04:00"), folder)
    assert f"{THREADS}=4,{MEMORY}=8192" in text


def test_the_keys_of_a_run_are_gone_when_it_is_over(folder):
    job_script(ClusterSettings("slurm"), folder)
    assert not list(folder.glob(".dask-jobqueue*"))


@pytest.mark.parametrize("walltime", ["", "soon", "24:00:00; rm -rf ~", "-1:00"])
def test_a_walltime_that_is_none_is_refused(folder, walltime):
    with pytest.raises(InputError, match="--walltime"):
        job_script(ClusterSettings("slurm", walltime=walltime), folder)


def test_ctrl_c_stays_an_interrupt_when_the_packages_are_loaded():
    script = "import signal; from PolyPoseLib.cohort.packages import require_packages; require_packages()\n"
    script += "from PolyPoseLib.cohort.batch_systems import batch_cluster; signal.raise_signal(signal.SIGINT)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert ended.returncode != 0 and "KeyboardInterrupt" in ended.stderr


def test_schedulers_are_known_by_name_or_address():
    for name in ("local", "slurm", "tcp://node:8786", "tls://10.0.0.1:8786"):
        require_scheduler(name)
    with pytest.raises(InputError, match='did you mean "slurm"'):
        require_scheduler("slurn")
    with pytest.raises(InputError, match="--scheduler"):
        require_scheduler("node:8786")


def test_this_machine_is_divided_among_its_workers():
    count, resources = local_workers(ClusterSettings(workers=4))
    one, whole = local_workers(ClusterSettings(workers=1))
    assert (count, one) == (4, 1)
    assert resources[THREADS] >= 1 and 4 * resources[MEMORY] < 1.2 * whole[MEMORY]
    assert local_workers(ClusterSettings(cores=3, memory_mib=500))[1] == {THREADS: 3, MEMORY: 500}


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:9", "no Dask scheduler to be reached"),
        ("tcp://", "no Dask scheduler to be reached .missing port"),
        ("tls://127.0.0.1:9", r"name no certificate: distributed\.comm\.tls\.ca-file"),
    ],
)
def test_nobody_is_at_the_address(folder, monkeypatch, address, said):
    monkeypatch.setattr("PolyPoseLib.cohort.clusters._CONNECT_SECONDS", 0.3)
    with (
        pytest.raises(InputError, match=said),
        machines(ClusterSettings(address), folder),
    ):
        pass


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="reads the sockets of Linux")
def test_workers_here_listen_on_the_loopback_alone_and_to_those_with_the_key(folder):
    psutil = pytest.importorskip("psutil")
    with machines(ClusterSettings(workers=1, cores=2, memory_mib=1000), folder) as at:
        own = psutil.Process()
        listening = [
            each.laddr.ip
            for process in (own, *own.children(recursive=True))
            for each in process.net_connections("inet")
            if each.status == psutil.CONN_LISTEN
        ]
        assert listening and set(listening) <= {"127.0.0.1", "::1"}
        assert at.dashboard.startswith("http://127.0.0.1:")
        assert at.resources == {THREADS: 2, MEMORY: 1000}
        address = at.client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        assert answer_without_the_key(int(address.rsplit(":", 1)[1])) == b""
    assert (folder / "logs/workers/workers.log").is_file()
    assert not list((folder / "logs").glob("*.log")), "a study may be called workers, or cluster"


def answer_without_the_key(port: int) -> bytes:
    """What a scheduler says to a stranger."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with socket.create_connection(("127.0.0.1", port), timeout=20) as plain:
        try:
            with context.wrap_socket(plain) as stranger:
                return stranger.recv(100)
        except ssl.SSLError as error:
            assert "CERTIFICATE_REQUIRED" in str(error)
            return b""
