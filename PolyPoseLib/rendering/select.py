"""Choose the device and the code that renders."""

from __future__ import annotations

from PolyPoseLib.errors import InputError
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.rendering.numba_backend import NumbaBackend


def resolve_device(device: str) -> str:
    """The device to use ("cpu" or "cuda"); raises InputError when CUDA is asked for but not there."""
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
    """The backend for options ``kernel`` ("auto", "numba", "torch") and a resolved ``device``.

    threads: CPU threads, None for all.  Raises InputError when numba is asked for but not installed.
    """
    try:
        import numba
    except ImportError:
        numba = None
    if kernel == "numba" and numba is None:
        raise InputError(
            'Option "kernel" is "numba", which is not installed: pip install numba, or give "auto".'
        )
    if kernel == "numba" or (kernel == "auto" and numba is not None and device == "cpu"):
        if threads is not None:
            numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
        return NumbaBackend()
    from PolyPoseLib.rendering.torch_backend import TorchBackend

    return TorchBackend(device)
