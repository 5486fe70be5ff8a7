"""Trained weights that a user brings as a file: found, read without unpickling, or asked for in one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import torch

from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.errors import InputError, memory_ran_out

_COMPILED = "_orig_mod."
"""What torch.compile puts before the names of a network's parameters."""


def weights_file(setting: SystemSetting, system: str, source: str) -> Path:
    """The file of a system's weights.

    Parameters
    ----------
    setting
        Its `weights` name the file.
    system
        Whose weights.
    source
        Where they are downloaded from, for the sentence.

    Raises
    ------
    InputError
        None given, or no such file.

    """
    path = setting.weights.get(system)
    if path is None:
        raise InputError(
            f"{system} needs trained weights, which PolyPose does not bring: download {source} and give it with "
            f"--weights {system}=FILE."
        )
    if not Path(path).is_file():
        raise InputError(f"{path}: there is no such file of weights for {system}; download {source}.")
    return Path(path)


def read_weights(path: Path, system: str) -> dict[str, torch.Tensor]:
    """Tensors by their names out of a file that torch.save wrote; nothing else in it is unpickled.

    Raises
    ------
    InputError
        Not such a file, or something else than tensors in it.

    """
    try:
        read = torch.load(path, map_location="cpu", weights_only=True)
    except MemoryError as error:
        raise memory_ran_out(str(path)) from error
    except Exception as error:  # torch raises many kinds for files that are damaged or hostile
        raise InputError(
            f"{path}: this is no file of weights for {system}, as torch.save writes a state dict: download it again."
        ) from error
    if (
        not isinstance(read, Mapping)
        or not read
        or not all(isinstance(t, torch.Tensor) for t in read.values())
    ):
        raise InputError(
            f"{path}: holds something else than named tensors, so it is not the weights of {system}."
        )
    return {str(name).removeprefix(_COMPILED): tensor for name, tensor in read.items()}


def load_weights(network: torch.nn.Module, path: Path, system: str) -> None:
    """Put a file's tensors into a network; raises InputError where names or shapes differ or numbers are not finite."""
    tensors = read_weights(path, system)
    wanted = {name: tuple(tensor.shape) for name, tensor in network.state_dict().items()}
    found = {name: tuple(tensor.shape) for name, tensor in tensors.items()}
    if wanted != found:
        odd = next(name for name in (*wanted, *found) if wanted.get(name) != found.get(name))
        raise InputError(
            f'{path}: these are not the weights of {system}: "{odd}" has the shape {found.get(odd, "of nothing")}, the '
            f"network's {wanted.get(odd, 'has none of that name')}."
        )
    if not all(
        bool(torch.isfinite(tensor).all()) for tensor in tensors.values() if tensor.is_floating_point()
    ):
        raise InputError(f"{path}: the weights of {system} hold NaN or infinity: download them again.")
    network.load_state_dict(tensors)
