"""Values of an HDF5 file by h5py, read with bounds: nothing outside of the file, nothing larger than it says it is."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.machine_memory import require_room

EXTRA = 'pip install "polypose[benchmark]"'
_MOST_VALUES = 1 << 31


@contextmanager
def opened(path: Path) -> Iterator[H5Group]:
    """A file's root for a ``with`` block; raises InputError when h5py is missing or the file is no HDF5."""
    try:
        h5py = importlib.import_module("h5py")
    except ImportError as error:
        raise InputError(f"{path}: reading HDF5 needs the package h5py: {EXTRA}.") from error
    try:
        file = h5py.File(path, "r")
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(
            f"{path}: it cannot be read as HDF5, so it is damaged or was not copied whole: copy or download it again."
        ) from error
    with file:
        yield H5Group(file, path, h5py)


class H5Group:
    """A group of an open file; every method raises InputError that names the file and the place in it."""

    def __init__(self, group: Any, path: Path, h5py: Any) -> None:
        self._group, self._path, self._h5py = group, path, h5py

    @property
    def where(self) -> str:
        """For sentences: the file, and the place in it unless it is the root."""
        place = str(self._group.name or "/")
        return f"{self._path}" if place == "/" else f'{self._path}, "{place}"'

    def names(self) -> list[str]:
        """Names of what the group holds, sorted."""
        try:
            return sorted(str(name) for name in self._group)
        except (RuntimeError, OSError, KeyError) as error:
            raise self._damaged() from error

    def __contains__(self, name: str) -> bool:
        return name in self.names()

    def group(self, *names: str) -> H5Group:
        """A group below, by the names on the way."""
        group = self
        for name in names:
            found = group._member(name)
            if not isinstance(found, self._h5py.Group):
                raise InputError(f'{group.where}: "{name}" is no group, so the file has another layout.')
            group = H5Group(found, self._path, self._h5py)
        return group

    def numbers(self, name: str, dimensions: int | None = None) -> np.ndarray:
        """A dataset of finite numbers; of so many dimensions where that is given."""
        dataset = self._dataset(name)
        place = f'{self.where}: "{name}"'
        try:
            is_number = dataset.dtype.kind in "fiub"
        except TypeError:  # of types that NumPy does not have
            is_number = False
        if not is_number or dataset.shape is None:
            raise InputError(f"{place} holds no numbers, so the file has another layout.")
        if dimensions is not None and len(dataset.shape) != dimensions:
            raise InputError(f"{place} has {len(dataset.shape)} dimensions instead of {dimensions}.")
        if dataset.size > _MOST_VALUES:
            raise InputError(f"{place} says that it holds {dataset.size} values, which no scan has.")
        require_room(float(dataset.size) * dataset.dtype.itemsize, place)
        try:
            values = np.asarray(dataset[()])
        except (OSError, RuntimeError, ValueError) as error:
            raise self._damaged() from error
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise InputError(f"{place} holds NaN or infinity: download the file again.")
        return values

    def matrix(self, name: str, *shapes: tuple[int, int]) -> np.ndarray:
        """A matrix of one of some shapes, float64."""
        values = self.numbers(name)
        if values.shape not in shapes:
            wanted = " or ".join("x".join(map(str, shape)) for shape in shapes)
            raise InputError(f'{self.where}: "{name}" has the shape {values.shape} instead of {wanted}.')
        return values.astype(np.float64)

    def number(self, name: str) -> float:
        """One number."""
        values = self.numbers(name)
        if values.size != 1:
            raise InputError(f'{self.where}: "{name}" holds {values.size} numbers instead of one.')
        return float(values.reshape(()))

    def _dataset(self, name: str) -> Any:
        found = self._member(name)
        if not isinstance(found, self._h5py.Dataset):
            raise InputError(f'{self.where}: "{name}" is no dataset, so the file has another layout.')
        if found.external or found.is_virtual:
            raise InputError(
                f'{self.where}: "{name}" takes its values from another file, which is not followed: give the one file.'
            )
        return found

    def _member(self, name: str) -> Any:
        """What has a name, by a hard link of this file."""
        try:
            link = self._group.get(name, getlink=True)
            is_hard = isinstance(link, self._h5py.HardLink)
            found = self._group.get(name) if is_hard else None
        except (RuntimeError, OSError, KeyError, ValueError, TypeError) as error:
            raise self._damaged() from error
        if link is not None and not is_hard:
            raise InputError(
                f'{self.where}: "{name}" is a link to another place, which is not followed: give the one file.'
            )
        if found is None:
            raise InputError(
                f'{self.where}: there is no "{name}": the file is not whole, or not the one at full resolution.'
            )
        return found

    def _damaged(self) -> InputError:
        return InputError(f"{self.where}: it is damaged: copy or download the file again.")
