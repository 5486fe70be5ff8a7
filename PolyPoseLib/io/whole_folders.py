"""Folders that are written whole or not at all, whatever ends the process meanwhile.

A place is claimed before the work (:mod:`PolyPoseLib.io.locks`), so that two runs never work towards one place. What is
written has a hidden name beside the place until it is whole, and takes the place in one step. What a killed process has
left beside a place is removed by whoever claims the place next.
"""

from __future__ import annotations

import errno
import logging
import os
import re
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.disk_space import FULL
from PolyPoseLib.io.locks import hidden_stem, locked
from PolyPoseLib.io.renames import exchange, rename_folder_to_new
from PolyPoseLib.io.signals import deferred_signals

_LOG = logging.getLogger(__name__)

StrangerIn = Callable[[Path], str | None]
"""Names a file of a folder that is none of an earlier result, which may be replaced; None where there is none."""

_OURS = re.compile(
    r"^(result\.json|(inverse_)?transform\.h5|(warped_ct|warped_labels|structures)\.nii\.gz|report\.(png|html))$"
    r"|^xray_\d+(_drr)?\.nii\.gz$"
)


def stranger_in_result(folder: Path) -> str | None:
    """The first file in a folder that no registration wrote, or None."""
    names = sorted(each.name for each in folder.iterdir())
    ours = ["README.txt"] if "result.json" in names else []  # without a result beside it, it is another's
    return next((name for name in names if not _OURS.match(name) and name not in ours), None)


def check_destination(folder: str | Path, overwrite: bool) -> None:
    """Refuse a destination that cannot take a result, before hours are spent on it; raises InputError.

    Only a folder that is absent, empty, or an earlier result (with overwrite) will do: nothing else is
    deleted.
    """
    folder = Path(folder)
    _check_place(folder)
    _check_contents(folder, overwrite)


def _check_place(folder: Path) -> None:
    """Refuse a path at which no folder can be made; raises InputError."""
    parent = folder.resolve().parent
    if not parent.is_dir():
        raise InputError(f"{folder}: the folder {parent} does not exist: make it first.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: nothing can be written in {parent}: check its permissions or choose another."
        )
    if os.path.ismount(folder):
        raise InputError(
            f"{folder}: a disk is mounted here, which cannot be replaced: choose a folder in it."
        )


def _check_contents(
    folder: Path,
    overwrite: bool | None,
    name: Path | None = None,
    stranger_in: StrangerIn = stranger_in_result,
) -> None:
    """Refuse a folder that holds anything but an earlier result that may be replaced; raises InputError.

    name: for the sentence, where it is not the folder's own.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{name or folder}: this is a file: choose a folder for --output.")
    filled = any(folder.iterdir())
    stranger = stranger_in(folder) if filled else None
    if stranger is not None:
        raise InputError(
            f'{name or folder}: the folder holds files that are no result ("{stranger}"): choose a new or empty '
            "folder."
        )
    if filled and not overwrite:
        raise InputError(
            f"{folder}: the folder already holds a result: choose another{_or_overwrite(overwrite)}."
        )
    if folder.is_symlink():
        raise InputError(f"{folder}: this is a link: give the folder that it leads to.")


def _or_overwrite(overwrite: bool | None) -> str:
    """The end of a sentence for users who have the option --overwrite."""
    return "" if overwrite is None else ", or add --overwrite"


class FolderClaim:
    """A folder that this process alone may write until it gives the claim back.

    Parameters
    ----------
    folder : Path
        As the user gave it.
    overwrite : bool or None
        Whether an earlier result is replaced; None where the user has no option for it.
    stranger_in : callable
        Tells what of a folder is not of an earlier result.

    Attributes
    ----------
    written : bool
        Whether the new folder has taken its place.

    """

    def __init__(
        self, folder: Path, overwrite: bool | None, stranger_in: StrangerIn = stranger_in_result
    ) -> None:
        self.folder = folder
        self.overwrite = overwrite
        self._stranger_in = stranger_in
        self.written = False
        self._target = folder.resolve()

    @contextmanager
    def whole(self) -> Iterator[Path]:
        """A temporary sibling that becomes the folder when the block succeeds and vanishes when it does not.

        Raises InputError for what the system refuses (no space, no permission), with the fix, and for a result that
        has appeared at the place meanwhile and may not be replaced.
        """
        temporary = self._target.with_name(f".{hidden_stem(self._target)}.{uuid.uuid4().hex[:8]}.partial")
        try:
            temporary.mkdir()
            yield temporary
            _flush(temporary)
            with deferred_signals():
                self._put(temporary)
                self.written = True
        except OSError as error:
            raise InputError(_refusal(self.folder, error)) from error
        except InputError as error:
            if str(temporary) not in str(error):
                raise
            raise InputError(str(error).replace(str(temporary), str(self.folder))) from error
        finally:
            shutil.rmtree(temporary, ignore_errors=True)

    def _put(self, temporary: Path) -> None:
        """Put the finished folder into its place; afterwards ``temporary`` is what stood there, or nothing."""
        if not _is_filled(self._target):
            try:
                rename_folder_to_new(temporary, self._target)
                return
            except FileExistsError:
                pass
        if not self.overwrite:
            raise InputError(
                f"{self.folder}: something appeared here while the result was computed, and it is not replaced: "
                f"choose another --output{_or_overwrite(self.overwrite)}."
            )
        _check_contents(self.folder, overwrite=True, stranger_in=self._stranger_in)
        if not exchange(temporary, self._target):
            _replace_in_two_steps(temporary, self._target)
            return
        try:
            _check_contents(temporary, overwrite=True, name=self.folder, stranger_in=self._stranger_in)
        except InputError:  # a file of someone else's was put there in the last moment
            exchange(temporary, self._target)
            raise


def _replace_in_two_steps(temporary: Path, target: Path) -> None:
    """Let the folder take its place where no exchange is possible; what stood there then has the temporary name.

    Whoever is killed between the steps leaves an "old" folder, which the next claim puts back.
    """
    old = target.with_name(f".{hidden_stem(target)}.{uuid.uuid4().hex[:8]}.old")
    try:
        target.rename(old)
        temporary.rename(target)
    except BaseException:
        if not target.exists():
            old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


@contextmanager
def claimed_folder(
    folder: str | Path, overwrite: bool | None, stranger_in: StrangerIn = stranger_in_result
) -> Iterator[FolderClaim]:
    """Claim a folder before the work whose result it will hold.

    Parameters
    ----------
    folder : path
        Absent, empty, or an earlier result with ``overwrite``.
    overwrite : bool or None
        Whether an earlier result is replaced; None where the user has no option for it, so that no sentence names it.
    stranger_in : callable
        Tells what of a folder is not of an earlier result, by default that of a registration.

    Yields
    ------
    FolderClaim
        Its ``whole`` writes the folder.

    Raises
    ------
    InputError
        The folder cannot take a result, another run is working towards it, or the system refuses.

    """
    folder = Path(folder)
    _check_place(folder)
    with ExitStack() as stack:
        try:
            stack.enter_context(_locked_and_tidy(folder))
            _check_contents(folder, overwrite, stranger_in=stranger_in)
        except OSError as error:
            raise InputError(_refusal(folder, error)) from error
        yield FolderClaim(folder, overwrite, stranger_in)


def restore_folder(folder: Path) -> None:
    """Put back what a killed process had renamed, where nothing stands at the place and nobody works towards it."""
    with suppress(OSError, InputError):
        if any(each.name.endswith(".old") for each in _left_beside(folder.resolve())):
            with _locked_and_tidy(folder):
                pass


def existing_folder(folder: str | Path, finished: str) -> Path:
    """A folder to read, put back where a killed process had renamed it.

    Raises InputError where there is none; ``finished`` names the command's run that leaves one.
    """
    folder = Path(folder)
    if not folder.is_dir():
        restore_folder(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder; give the --output of a finished {finished}.")
    return folder


@contextmanager
def _locked_and_tidy(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder's place, and repair what killed processes have left there.

    Everything that bears the hidden names of the place is of earlier runs and stale: those that run hold the lock.
    """
    target = folder.resolve()
    with locked(target, str(folder)) as held:
        if held:
            _repair(target)
        yield


def _repair(target: Path) -> None:
    """Put the folder back that a killed process had renamed, and remove what others have left."""
    stale = _left_beside(target)
    old = [each for each in stale if each.name.endswith(".old") and any(each.iterdir())]
    if old and not _is_filled(target):
        newest = max(old, key=lambda each: each.stat().st_mtime)
        rename_folder_to_new(newest, target)
        stale.remove(newest)
        _LOG.warning("%s: an interrupted run had moved this folder aside; it is in its place again.", target)
    for each in stale:
        shutil.rmtree(each, ignore_errors=True)


def _left_beside(target: Path) -> list[Path]:
    """Folders beside a place that bear its hidden names."""
    pattern = re.compile(rf"\.{re.escape(hidden_stem(target))}\.[0-9a-f]{{8}}\.(partial|old)")
    return [
        each
        for each in target.parent.iterdir()
        if pattern.fullmatch(each.name) and each.is_dir() and not each.is_symlink()
    ]


def _is_filled(folder: Path) -> bool:
    """Whether anything but an empty folder has that name."""
    if not os.path.lexists(folder):
        return False
    return not folder.is_dir() or any(folder.iterdir())


def _flush(folder: Path) -> None:
    """Have the system write all files to the disk: some say only then that it is full."""
    for each in folder.rglob("*"):
        if not each.is_file():
            continue
        with each.open("r+b") as stream:
            os.fsync(stream.fileno())


def _refusal(folder: Path, error: OSError) -> str:
    """One sentence for an error of the system."""
    if error.errno in FULL:
        reason = "the disk is full: free some space, or"
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        reason = "writing is not permitted here:"
    else:
        reason = f"the result could not be written ({error.strerror or error}):"
    return f"{folder}: {reason} choose another --output; nothing was written."
