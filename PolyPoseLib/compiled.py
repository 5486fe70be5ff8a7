"""Loops compiled by numba, kept on disk so that only the first run compiles them.

numba's own cache ends a run where no folder can be written, checks a kernel's own file only, and may mix up the machine
code of two signatures that two processes save at once. Here each signature has one file, written whole, which is
used only when nothing that it was made from has changed; a cache that fails costs time, never a run.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import pickle
import stat
import tempfile
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.serialize import dumps

KERNEL_FILES = "*kernel*.py"
"""Names of the files that hold compiled loops; a change in any of them makes all of the cached code stale."""

_LOG = logging.getLogger(__name__)

_DIGEST_BYTES = hashlib.sha256().digest_size

_warned: list[str] = []


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: ``numba.njit(**options)`` with a cache on disk.

    The cache is where numba would have it (``NUMBA_CACHE_DIR``, the package's folder, the user's cache folder), else in
    a private folder beside temporary files, else there is none.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher: Any = numba.njit(**options)(function)
        cache = _cache_of(function)
        if cache is not None:
            dispatcher._cache = cache
        return dispatcher

    return decorate


def is_kept(loop: Any) -> bool:
    """Whether a compiled loop has machine code for any signature, in memory or on disk."""
    if loop.signatures:
        return True
    try:
        return isinstance(loop._cache, KernelCache) and loop._cache.files.has_any()
    except OSError:
        return False


class KernelCache(FunctionCache):
    """numba's cache of one function, with our files and without errors."""

    def __init__(self, function: Callable[..., Any]) -> None:
        """Find a folder; raises RuntimeError where none can be written."""
        super().__init__(function)
        self.files = OverloadFiles(
            Path(self._impl.locator.get_cache_path()), self._impl.filename_base, sources_digest()
        )
        self._cache_file = self.files

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The machine code for a signature, or None to compile it."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:
            _LOG.debug("compiled code cannot be read: %s", error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the machine code of a signature where that is possible."""
        try:
            super().save_overload(sig, data)
        except Exception as error:
            _warn_once(str(error))


class OverloadFiles:
    """One file per signature of a function: digests of sources and of all that the code depends on, and the code."""

    def __init__(self, folder: Path, base: str, stamp: bytes) -> None:
        """folder, base: where, and how file names begin. stamp: what the code was made from."""
        self._folder = folder
        self._base = base
        self._stamp = stamp

    def flush(self) -> None:
        """Forget everything."""
        for path in self._folder.glob(f"{self._base}.*.nbc"):
            path.unlink(missing_ok=True)

    def load(self, key: object) -> Any:
        """What was saved under a key, or None when it is missing, stale or damaged."""
        try:
            content = self._path(key).read_bytes()
        except FileNotFoundError:
            return None
        payload = content[len(self._stamp) + _DIGEST_BYTES :]
        return pickle.loads(payload) if content.startswith(self._head(key, payload)) else None

    def has_any(self) -> bool:
        """Whether a file is there, for any key, that was made from the same."""
        for path in self._folder.glob(f"{self._base}.*.nbc"):
            with path.open("rb") as stream:
                if stream.read(len(self._stamp)) == self._stamp:
                    return True
        return False

    def save(self, key: object, data: object) -> None:
        """Write a file whole, replacing what was there."""
        payload = dumps(data)
        path = self._path(key)
        temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}.tmp")
        try:
            temporary.write_bytes(self._head(key, payload) + payload)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)

    def _path(self, key: object) -> Path:
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        return self._folder / f"{self._base}.{name}.nbc"

    def _head(self, key: object, payload: bytes) -> bytes:
        return self._stamp + hashlib.sha256(b"\0".join((self._stamp, repr(key).encode(), payload))).digest()


@functools.cache
def sources_digest() -> bytes:
    """Digest of numba's version and of all files of this package that hold compiled loops."""
    found = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.rglob(KERNEL_FILES)):
        found.update(path.read_bytes())
    return found.digest()


def private_temporary_folder() -> Path:
    """A folder for temporary files that nobody else can write to.

    Machine code must never be read from where another user could have put it.

    Raises
    ------
    OSError
        When it can neither be made nor trusted.

    """
    user = os.getuid() if hasattr(os, "getuid") else None
    folder = Path(tempfile.gettempdir()) / ("polypose" if user is None else f"polypose-{user}")
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    private = stat.S_ISDIR(found.st_mode) and (
        user is None or (found.st_uid == user and not found.st_mode & 0o077)
    )
    if not private:
        raise PermissionError(f"{folder} is open to other users")
    return folder


def _cache_of(function: Callable[..., Any]) -> KernelCache | None:
    """The cache of a function; None, after one line in the log, where there is no place for one."""
    try:
        try:
            return KernelCache(function)
        except RuntimeError:
            _use_folder(private_temporary_folder())
            return KernelCache(function)
    except Exception as error:
        _warn_once(str(error))
        return None


def _use_folder(folder: Path) -> None:
    """Let numba, here and in child processes, keep its code in a folder."""
    _LOG.info(
        "Compiled loops are kept in %s: neither the package's nor the user's folder can be written.", folder
    )
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    settings: Any = config
    settings.CACHE_DIR = str(folder)


def _warn_once(reason: str) -> None:
    """One line in the log, whatever the number of loops."""
    if _warned:
        return
    _warned.append(reason)
    _LOG.warning(
        "Compiled loops cannot be kept on disk (%s), so that every start compiles them again: "
        "set NUMBA_CACHE_DIR to a folder that can be written.",
        reason,
    )
