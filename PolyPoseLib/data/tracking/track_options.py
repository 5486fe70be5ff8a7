"""How to track."""

from __future__ import annotations

from dataclasses import dataclass

from PolyPoseLib.errors import InputError, unknown_name

TRACK_CHOICES: dict[str, tuple[str, ...]] = {
    "start": ("rest", "registration"),
    "prediction": ("previous", "constant_velocity"),
    "kernel": ("auto", "torch", "numba"),
}
"""Allowed values of the options that name something."""


@dataclass(frozen=True)
class TrackOptions:
    """Settings of one tracking.

    Parameters
    ----------
    start : {"rest", "registration"}
        How structures without an initial pose begin: where the CT has them, with the rig's world as the CT's unless
        initial poses of other structures tell another, or by a registration of the first frame.
    prediction : {"previous", "constant_velocity"}
        Where a frame's fit starts.
    first : int
        Number of the first frame.
    last : int, optional
        Number of the last frame, which is tracked too; None for the end.
    backward : bool
        Whether a second pass goes back in time, which keeps the better of two poses.
    smooth : bool
        Whether poses are smoothed with their own covariances; marked in the output.
    threads : int, optional
        CPU threads; None for all.
    kernel : {"auto", "torch", "numba"}
        What renders.

    Raises
    ------
    InputError
        A value out of its range; the sentence names the option.

    """

    start: str = "rest"
    prediction: str = "constant_velocity"
    first: int = 0
    last: int | None = None
    backward: bool = True
    smooth: bool = False
    threads: int | None = None
    kernel: str = "auto"

    def __post_init__(self) -> None:
        """Check the values; raises InputError."""
        for name, allowed in TRACK_CHOICES.items():
            if getattr(self, name) not in allowed:
                raise InputError(unknown_name(name, getattr(self, name), allowed))
        if self.first < 0 or (self.last is not None and self.last < self.first):
            raise InputError('"first" and "last" frame must be 0 <= first <= last.')
