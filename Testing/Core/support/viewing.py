"""A `polypose view` that runs, as a process of its own."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

START_SECONDS = 120


@dataclass
class Viewing:
    """process: of the command; address: that it printed, with the token; port: on which it listens."""

    process: subprocess.Popen
    address: str
    port: int

    def end(self) -> tuple[int, str]:
        """Press Ctrl+C; exit status and what it said on stderr."""
        self.process.send_signal(signal.SIGINT)
        _, said = self.process.communicate(timeout=30)
        return self.process.returncode, said


@contextmanager
def viewing(*arguments: object, **variables: str) -> Iterator[Viewing]:
    """Run the command until the block ends; variables are added to its environment."""
    environment = {
        key: value for key, value in os.environ.items() if key not in ("DISPLAY", "SSH_CONNECTION")
    }
    command = [sys.executable, "-m", "PolyPoseLib", "view", *map(str, arguments), "--no-browser"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**environment, **variables}
    )
    watchdog = threading.Timer(START_SECONDS, process.kill)
    watchdog.start()
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        watchdog.cancel()
        found = re.fullmatch(r"(http://127\.0\.0\.1:(\d+)/\?token=[\w-]{40,})\n", line)
        assert found, (line, process.communicate(timeout=30))
        yield Viewing(process, found.group(1), int(found.group(2)))
    finally:
        watchdog.cancel()
        if process.poll() is None:
            process.kill()
            process.communicate()
