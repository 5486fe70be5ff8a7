"""The systems that are compared: one table of names, and how a user names a system of their own.

Nothing is imported before a system is loaded, so that packages that are not installed cost nothing.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module, metadata
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING

from PolyPoseLib.benchmark.digests import file_digest
from PolyPoseLib.errors import InputError, one_line, unknown_name

if TYPE_CHECKING:
    from PolyPoseLib.data.benchmark.system import System

SYSTEMS: dict[str, str] = {
    "rest": "PolyPoseLib.benchmark.own_systems:Rest",
    "polypose": "PolyPoseLib.benchmark.own_systems:PolyPose",
    "polypose-found": "PolyPoseLib.benchmark.own_systems:PolyPoseFound",
    "paper": "PolyPoseLib.benchmark.own_systems:Paper",
    "rigid": "PolyPoseLib.benchmark.learned_start:RigidWithStart",
    "dense-r3": "PolyPoseLib.baselines.dense_r3:DenseR3",
    "dense-se3": "PolyPoseLib.baselines.dense_se3:DenseSE3",
    "fdk-greedy": "PolyPoseLib.baselines.volumes.greedy:FdkGreedy",
    "fdk-elastix": "PolyPoseLib.baselines.volumes.elastix:FdkElastix",
    "fdk-fireants": "PolyPoseLib.baselines.volumes.fireants:FdkFireAnts",
    "fdk-convexadam": "PolyPoseLib.baselines.volumes.convexadam:FdkConvexAdam",
    "fdk-unigradicon": "PolyPoseLib.baselines.volumes.unigradicon:FdkUniGradIcon",
    "fdk-unigradicon-io": "PolyPoseLib.baselines.volumes.unigradicon:FdkUniGradIconIo",
    "fdk-multigradicon": "PolyPoseLib.baselines.volumes.unigradicon:FdkMultiGradIcon",
    "fdk-multigradicon-io": "PolyPoseLib.baselines.volumes.unigradicon:FdkMultiGradIconIo",
    "fdk-anatomix": "PolyPoseLib.baselines.volumes.anatomix:FdkAnatomix",
    "liftreg": "PolyPoseLib.baselines.liftreg:LiftReg",
    "2d3d-regnet": "PolyPoseLib.baselines.regnet:RegNet",
}
"""Name of a system, and "module:Class"."""

ABOUT: dict[str, str] = {
    "rest": "nothing moves: what every system must beat",
    "polypose": "the default method",
    "polypose-found": "the same, from cameras that are wrong",
    "paper": "the published method, preset paper",
    "rigid": "one rigid body for the whole patient",
    "dense-r3": "a displacement at every node of a grid",
    "dense-se3": "a rigid motion at every node of a grid",
    "fdk-greedy": "FDK volume, greedy",
    "fdk-elastix": "FDK volume, elastix",
    "fdk-fireants": "FDK volume, FireANTs",
    "fdk-convexadam": "FDK volume, ConvexAdam",
    "fdk-unigradicon": "FDK volume, uniGradICON",
    "fdk-unigradicon-io": "the same with instance optimisation",
    "fdk-multigradicon": "FDK volume, multiGradICON",
    "fdk-multigradicon-io": "the same with instance optimisation",
    "fdk-anatomix": "FDK volume, ConvexAdam on anatomix",
    "liftreg": "trained network LiftReg",
    "2d3d-regnet": "trained network 2D3D-RegNet",
}
"""What a system is, in a few words; fdk: a 3D/3D registration to a volume reconstructed from the X-rays."""

ALL = "all"
"""Stands for the whole table."""

_PATH = re.compile(r"(?:[^\W\d]\w*\.)*[^\W\d]\w*:[^\W\d]\w*")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class NamedSystem:
    """A system under its name in the tables.

    Attributes
    ----------
    name : str
        In the tables.
    path : str
        "module:Class".
    own : bool
        Whether it is a user's, not of the table.

    """

    name: str
    path: str
    own: bool = False

    @property
    def code(self) -> str:
        """What tells its code from another's: its path, of the table the versions of its packages, a user's its file.

        Nothing of a user's is imported for that. Raises InputError where there is no such module.
        """
        if not self.own:
            try:
                needs = load_system(self.path).needs
            except ImportError:  # its runs say so
                return self.path
            return ", ".join([self.path, *(f"{need} {_version(need) or 'absent'}" for need in needs)])
        return f"{self.path} {file_digest(_file_of(self.path.partition(':')[0]))}"


def weights_names(name: str) -> tuple[str, ...]:
    """Under which names --weights may give a system's file: its own, or that of the same network without IO."""
    return tuple(dict.fromkeys((name, name.removesuffix("-io"))))


def file_part(name: str) -> str:
    """A name as a part of file names."""
    return re.sub(r"[^A-Za-z0-9._-]", ".", name)


def named_systems(words: Sequence[str]) -> tuple[NamedSystem, ...]:
    """The systems that --methods names: of the table, "all", "module:Class", or "name=module:Class".

    Raises InputError for names that are not known, and for two systems under one name.
    """
    found: list[NamedSystem] = []
    for word in words:
        if word == ALL:
            found += [NamedSystem(name, path) for name, path in SYSTEMS.items()]
        elif ":" in word:
            found.append(_own_system(word))
        elif word in SYSTEMS:
            found.append(NamedSystem(word, SYSTEMS[word]))
        else:
            raise InputError(f"--methods: {unknown_name('system', word, [*SYSTEMS, ALL])}")
    systems = tuple(dict.fromkeys(found))
    for number, each in enumerate(systems):
        if any(file_part(each.name) == file_part(other.name) for other in systems[:number]):
            raise InputError(
                f'--methods: two systems are called "{each.name}": give one of them another name, as in '
                f"{file_part(each.name)}-2={each.path}."
            )
    return systems


def _own_system(word: str) -> NamedSystem:
    """A user's own system; raises InputError."""
    name, equals, path = word.rpartition("=")
    if not _PATH.fullmatch(path):
        raise InputError(
            f'--methods: "{one_line(word)[:80]}" names no class: write module:Class, as in my_systems:MySystem.'
        )
    if equals and not _NAME.fullmatch(name):
        raise InputError(
            f'--methods: "{one_line(name)[:80]}" cannot be a name: give up to 64 letters, digits, points, hyphens and '
            "underscores, a letter or digit first."
        )
    if name in SYSTEMS or name == ALL:
        raise InputError(f'--methods: "{name}" is a system of the table: give yours another name.')
    _file_of(path.partition(":")[0])
    return NamedSystem(name or path, path, own=True)


def _file_of(module: str) -> Path:
    """The file of a module, found without running any of its code; raises InputError."""
    places = [str(Path.cwd()), *sys.path]  # as ``python -m`` has them, by which systems are run
    spec = None
    for part in module.split("."):
        spec = PathFinder.find_spec(part, places) if places else None
        if spec is None:
            raise InputError(
                f'--methods: there is no module "{module}": run the command in the folder that holds {part}.py, or '
                "install the package."
            )
        places = list(spec.submodule_search_locations or ())
    if spec is None or spec.origin is None or not Path(spec.origin).is_file():
        raise InputError(
            f'--methods: the module "{module}" has no file: name the module that holds the class.'
        )
    return Path(spec.origin)


def load_system(path: str) -> System:
    """Import and construct a system; raises InputError when the class does not fulfil the protocol.

    Whatever the module itself raises when it is imported comes through.
    """
    module, _, name = path.partition(":")
    found = getattr(import_module(module), name, None)
    if not isinstance(found, type):
        raise InputError(f"{path}: the module has no class of that name: correct it.")
    system = found()
    if not isinstance(getattr(system, "name", None), str):
        raise InputError(f'{path}: a system needs a text "name".')
    needs = getattr(system, "needs", None)
    if not isinstance(needs, tuple) or not all(isinstance(each, str) for each in needs):
        raise InputError(f'{path}: a system needs a tuple "needs", of the packages that it imports.')
    if not callable(getattr(system, "fit", None)):
        raise InputError(f'{path}: a system needs a method "fit(study, setting)".')
    return system


def missing_packages(system: System) -> list[str]:
    """Those of the packages that a system needs that are not installed."""
    return [need for need in system.needs if _version(need) is None]


def _version(need: str) -> str | None:
    """The installed version of a package that is needed; None without one."""
    try:
        return metadata.version(re.split(r"[\s\[<>=!~;]", need, maxsplit=1)[0])
    except metadata.PackageNotFoundError:
        return None


def installing(system: System, missing: Sequence[str]) -> str:
    """How to install packages that a system lacks: as the system itself says, where it does, else by pip.

    Parameters
    ----------
    system : System
        May have ``fixes``, {package: how to get it}, as the class FdkSystem of ``baselines.volumes`` has.
    missing : sequence of str
        One at least of the packages that it needs.

    """
    fixes = getattr(system, "fixes", {})
    plain = [need for need in missing if need not in fixes]
    ways = [f"pip install {' '.join(plain)}"] if plain else []
    return ", and ".join([*ways, *dict.fromkeys(fixes[need] for need in missing if need in fixes)])


def require_packages(system: System) -> None:
    """Raise InputError when a package that a system needs is not installed."""
    if missing := missing_packages(system):
        raise InputError(
            f"{system.name} needs {' and '.join(missing)}, not installed here: {installing(system, missing)}."
        )
