"""Files that --weights gives, looked into before anything runs: a wrong one would be found out only hours later."""

from __future__ import annotations

from pathlib import Path

from PolyPoseLib.benchmark.systems import SYSTEMS
from PolyPoseLib.data.benchmark.job import TRAINED_SYSTEMS
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.files import refuse_special_file

_WITHOUT = (
    *("rest", "polypose", "polypose-found", "paper", "dense-r3", "dense-se3"),
    *("fdk-greedy", "fdk-elastix", "fdk-fireants", "fdk-convexadam"),
)
"""Systems of the table that take no weights."""

_OPTIONAL = ("rigid",)
"""Those that run without as well."""


def weights_word(system: str) -> str:
    """Whether a system of the table takes weights: "needed", "optional", or "-"."""
    if system in _WITHOUT:
        return "-"
    return "optional" if system in _OPTIONAL else "needed"


def require_weights(system: str, path: Path) -> None:
    """Refuse a file that a system could not take as its weights, whatever the case.

    Of a user's own system it is only seen whether the file can be read. Whether a network's tensors have the right
    shapes, and whether weights fit a case, is found out by the system itself.

    Parameters
    ----------
    system : str
        Its name in the tables.
    path : Path
        The file.

    Raises
    ------
    InputError
        The system takes none; there is no such file; it cannot be read; it holds something else, or other weights.

    """
    if system in _WITHOUT:
        raise InputError(f'"{system}" takes no weights: leave {system}={path} out.')
    refuse_special_file(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file: give the weights of {system}.")
    try:
        with path.open("rb") as stream:
            stream.read(1)
    except OSError as error:
        raise InputError(
            f"{path}: the file cannot be read ({error.strerror}): check its permissions."
        ) from error
    if system in SYSTEMS:
        _require_content(system, path)


def _require_content(system: str, path: Path) -> None:
    """Read the weights of a system of the table; raises InputError."""
    if system == "rigid":
        from PolyPoseLib.io.camera_models import load_model

        load_model(path)
    elif system in TRAINED_SYSTEMS:
        from PolyPoseLib.baselines.trained.fitting import training_command
        from PolyPoseLib.baselines.trained.trained_weights import read_weights

        read_weights(path, system, training_command(system))
    else:
        from PolyPoseLib.baselines.weights import read_weights as read_tensors

        read_tensors(path, system)
