"""A GPU that is only pretended: tensors on "cuda" are kept on the CPU, and mixing them with the CPU's is an error.

Finds what otherwise only a machine with a GPU finds: arguments on two devices, and arrays taken from a device without a
copy. Values are the CPU's.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

import pytest
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._pytree import tree_leaves, tree_map

CUDA = pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))
"""Among the devices of a test: it is skipped where there is none."""

_CPU = torch.device("cpu")
_DEVICE = torch.Tensor.device.__get__
_MOVES = (torch.Tensor.to, torch.as_tensor, torch.tensor)
_INDEXING = (torch.Tensor.__getitem__, torch.Tensor.__setitem__)


class PretendedGpu(TorchFunctionMode):
    """Inside of it, ``device="cuda"`` works on any machine."""

    def __torch_function__(self, func, types, args=(), kwargs=None):
        kwargs = kwargs or {}
        if func is torch.device:
            return func(*args, **kwargs)
        if func == _DEVICE:
            return torch.device("cuda") if _on_gpu(args[0]) else _CPU
        leaves = tree_leaves((args, kwargs))
        tensors = [each for each in leaves if isinstance(each, Tensor)]
        wanted = []
        if "device" in kwargs or func in _MOVES:
            wanted = [torch.device(each) for each in leaves if isinstance(each, (torch.device, str))]
        if func is torch.Tensor.numpy and _on_gpu(args[0]):
            raise TypeError("a tensor on the GPU is turned into an array: copy it to the CPU first")
        if func in _MOVES:
            goal = next(iter(wanted), None)
            if goal is None and func is torch.Tensor.to:
                goal = torch.device(
                    "cuda" if _on_gpu(tensors[-1]) else "cpu"
                )  # as another tensor, or as itself
            on_gpu = goal.type == "cuda" if goal is not None else any(map(_on_gpu, tensors))
        elif func is torch.Tensor.cpu:
            on_gpu = False
        else:
            on_gpu = any(map(_on_gpu, tensors)) or any(each.type == "cuda" for each in wanted)
            self._require_one_device(func, tensors)
        args, kwargs = tree_map(_really, (args, kwargs))
        found = func(*args, **kwargs)
        return tree_map(lambda each: _marked(each, on_gpu, tensors), found)

    @staticmethod
    def _require_one_device(func, tensors: list[Tensor]) -> None:
        if func in _INDEXING:  # numbers of elements may be on the CPU
            tensors = [each for each in tensors if each.is_floating_point()]
        places = {_on_gpu(each) for each in tensors if each.dim() > 0}
        if len(places) > 1:
            raise RuntimeError(f"{func.__name__} is given tensors on the CPU and on the GPU")


def _on_gpu(tensor: Tensor) -> bool:
    return getattr(tensor, "_pretended", False)


def _really(value: object) -> object:
    """The CPU for the GPU."""
    return _CPU if isinstance(value, torch.device) or (isinstance(value, str) and value == "cuda") else value


def _marked(value: object, on_gpu: bool, given: list[Tensor]) -> object:
    """A result, which is another object than what was given where it is on another device."""
    if not isinstance(value, Tensor):
        return value
    if any(value is each for each in given) and _on_gpu(value) != on_gpu:
        value = value.view_as(value)
    value._pretended = on_gpu  # type: ignore[attr-defined]
    return value


def gpu_at(where: str) -> AbstractContextManager[object]:
    """What a test on a device runs in: something where the device is "pretended", nothing otherwise."""
    return PretendedGpu() if where == "pretended" else nullcontext()
