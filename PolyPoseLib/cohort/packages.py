"""The packages of the extra ``cohort``, which nothing else of the program needs."""

from __future__ import annotations

import signal
import threading
from types import ModuleType

from PolyPoseLib.errors import InputError


def require_packages() -> None:
    """Raise InputError where one is missing."""
    try:
        import cryptography
        import distributed
        import pyarrow

        jobqueue()
    except ImportError as error:
        raise InputError(
            f"A cohort needs packages that are not installed ({error}): pip install 'polypose[cohort]'."
        ) from error
    del cryptography, distributed, pyarrow


def jobqueue() -> ModuleType:
    """The package dask_jobqueue; raises ImportError.

    On import it makes Ctrl+C end the process at once, as if all was well, and without a summary: the earlier handler
    is put back.
    """
    handler = signal.getsignal(signal.SIGINT)
    try:
        import dask_jobqueue
    finally:
        if threading.current_thread() is threading.main_thread() and handler is not None:
            signal.signal(signal.SIGINT, handler)
    return dask_jobqueue
