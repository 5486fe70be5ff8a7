"""Choose the device and the code that renders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.numba_backend import NumbaBackend

if TYPE_CHECKING:
    import torch


def resolve_device(device: str) -> str:
    """The device to use.

    Parameters
    ----------
    device : {"auto", "cpu", "cuda"}
        "auto" takes a CUDA device when there is one.

    Returns
    -------
    str
        "cpu" or "cuda".

    Raises
    ------
    InputError
        "cuda" is asked for, but torch finds none.

    """
    if device == "cpu":
        return "cpu"
    import torch

    if torch.cuda.is_available():
        return "cuda"
    if device == "cuda":
        raise InputError(
            'Option "device" is "cuda", but torch finds no CUDA device: give "cpu", or install a CUDA build of torch.'
        )
    return "cpu"


def select_backend(kernel: str = "auto", device: str = "cpu", threads: int | None = None) -> Backend:
    """The backend for a kernel and a device.

    Parameters
    ----------
    kernel : {"auto", "numba", "torch"}
        "auto" takes numba on a CPU where it is installed, and torch otherwise.
    device : {"auto", "cpu", "cuda"}
        "auto" takes a CUDA device when there is one; where numba could render on the CPU instead, whichever a short
        trial finds faster.
    threads : int, optional
        CPU threads, None for all.

    Returns
    -------
    Backend
        Ready to use.

    Raises
    ------
    InputError
        Numba is asked for but not installed, or "cuda" but torch finds no such device.

    """
    numba = _numba()
    if kernel == "numba" and numba is None:
        raise InputError(
            'Option "kernel" is "numba", which is not installed: pip install numba, or give "auto".'
        )
    if kernel == "numba" or (kernel == "auto" and numba is not None and device == "cpu"):
        return _compiled(numba, threads)
    from PolyPoseLib.rendering.torch_backend import TorchBackend

    found = TorchBackend(resolve_device(device))
    if kernel == "torch" or numba is None or device == "cuda":
        return found
    compiled = _compiled(numba, threads)
    if found.device.type == "cpu":
        return compiled
    from PolyPoseLib.rendering.trial import faster_of

    return faster_of([compiled, found])


def device_of(backend: Backend) -> str:
    """Where a backend renders, "cpu" or "cuda"."""
    device = torch_device_of(backend)
    return "cpu" if device is None else device.type


def must_compile(backend: Backend) -> bool:
    """Whether a backend's loops have still to be compiled, which takes memory."""
    return getattr(backend, "must_compile", False)


def torch_device_of(backend: Backend) -> torch.device | None:
    """Where torch renders; None where compiled loops do."""
    return getattr(backend, "device", None)


def _compiled(numba: Any, threads: int | None) -> NumbaBackend:
    """Numba with so many threads, None for all."""
    if threads is not None:
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    return NumbaBackend()


def _numba() -> Any:
    """The module numba, None where it is not installed."""
    try:
        import numba
    except ImportError:
        return None
    return numba
