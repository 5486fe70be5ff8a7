"""Starts a child process so that it and all that it starts can be ended together, on every platform."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence

TERMINATE_SECONDS = 1.0
"""A process that was asked to end gets this long before it is killed."""


class ProcessTree:
    """A child process and its descendants."""

    def __init__(
        self, arguments: Sequence[str], environment: Mapping[str, str], folder: str, talks: bool = False
    ) -> None:
        """Start it; raises OSError when that fails. talks: it is written to (process.stdin)."""
        self._job: int | None = None
        self._killer: threading.Thread | None = None
        self.process = subprocess.Popen(
            list(arguments),
            env=dict(environment),
            cwd=folder,
            stdin=subprocess.PIPE if talks else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            **_platform_options(),
        )
        if sys.platform == "win32":
            self._job = _windows_job(self.process)

    @property
    def running(self) -> bool:
        """Whether the child itself has not ended."""
        return self.process.poll() is None

    def end(self) -> None:
        """Ask the tree to end and return at once; what still runs after a second is killed."""
        if self._killer is None:
            self._terminate()
            self._killer = threading.Thread(target=self._kill_when_late, daemon=True)
            self._killer.start()

    def _kill_when_late(self) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(TERMINATE_SECONDS)
        self.kill()

    def kill(self) -> None:
        """End the child and all its descendants at once; harmless when they have ended."""
        if sys.platform == "win32":
            _windows_kill(self.process.pid, self._job)
            self._job = None
        else:
            _signal_group(self.process.pid, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(TERMINATE_SECONDS)

    def _terminate(self) -> None:
        if sys.platform == "win32":
            with contextlib.suppress(OSError):
                self.process.send_signal(signal.CTRL_BREAK_EVENT)
        else:
            _signal_group(self.process.pid, signal.SIGTERM)


def _platform_options() -> dict:
    """On Windows no console window and a process group; elsewhere a session of its own."""
    if sys.platform != "win32":
        return {"start_new_session": True}
    startup = subprocess.STARTUPINFO()
    startup.dwFlags |= subprocess.STARTF_USESHOWWINDOW
    flags = subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW
    return {"startupinfo": startup, "creationflags": flags}


def _signal_group(group: int, number: int) -> None:
    """Signal every process of a group; the child leads it, and it lives on as long as one member does."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)


def _windows_job(process: subprocess.Popen) -> int | None:
    """A job object that kills its processes when its last handle closes, also when this process crashes."""
    import ctypes
    from ctypes import wintypes

    kill_on_close, extended_limits = 0x2000, 9

    class BasicLimits(ctypes.Structure):
        _fields_ = (
            ("PerProcessUserTimeLimit", ctypes.c_int64),
            ("PerJobUserTimeLimit", ctypes.c_int64),
            ("LimitFlags", wintypes.DWORD),
            ("MinimumWorkingSetSize", ctypes.c_size_t),
            ("MaximumWorkingSetSize", ctypes.c_size_t),
            ("ActiveProcessLimit", wintypes.DWORD),
            ("Affinity", ctypes.c_size_t),
            ("PriorityClass", wintypes.DWORD),
            ("SchedulingClass", wintypes.DWORD),
        )

    class ExtendedLimits(ctypes.Structure):
        _fields_ = (
            ("BasicLimitInformation", BasicLimits),
            ("IoInfo", ctypes.c_uint64 * 6),
            ("ProcessMemoryLimit", ctypes.c_size_t),
            ("JobMemoryLimit", ctypes.c_size_t),
            ("PeakProcessMemoryUsed", ctypes.c_size_t),
            ("PeakJobMemoryUsed", ctypes.c_size_t),
        )

    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    kernel.CreateJobObjectW.restype = wintypes.HANDLE
    kernel.CreateJobObjectW.argtypes = (ctypes.c_void_p, wintypes.LPCWSTR)
    kernel.SetInformationJobObject.argtypes = (
        wintypes.HANDLE,
        ctypes.c_int,
        ctypes.c_void_p,
        wintypes.DWORD,
    )
    kernel.AssignProcessToJobObject.argtypes = (wintypes.HANDLE, wintypes.HANDLE)
    kernel.CloseHandle.argtypes = (wintypes.HANDLE,)
    job = kernel.CreateJobObjectW(None, None)
    if not job:
        return None
    limits = ExtendedLimits()
    limits.BasicLimitInformation.LimitFlags = kill_on_close
    size = ctypes.sizeof(limits)
    made = kernel.SetInformationJobObject(job, extended_limits, ctypes.byref(limits), size)
    if not made or not kernel.AssignProcessToJobObject(job, int(process._handle)):
        kernel.CloseHandle(job)
        return None
    return job


def _windows_kill(pid: int, job: int | None) -> None:
    """Kill by the job object; taskkill catches what was started before the child joined the job."""
    if job is not None:
        import ctypes
        from ctypes import wintypes

        kernel = ctypes.WinDLL("kernel32")
        kernel.TerminateJobObject.argtypes = (wintypes.HANDLE, wintypes.UINT)
        kernel.CloseHandle.argtypes = (wintypes.HANDLE,)
        kernel.TerminateJobObject(job, 1)
        kernel.CloseHandle(job)
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        subprocess.run(
            ["taskkill", "/F", "/T", "/PID", str(pid)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=TERMINATE_SECONDS,
            check=False,
            creationflags=subprocess.CREATE_NO_WINDOW,
        )
