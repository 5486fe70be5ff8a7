"""Angles and translations of a joint over time, as they are plotted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Curve:
    """One angle or translation over F frames.

    Parameters
    ----------
    name : str
        As in headers of tables, such as "flexion".
    positive : str
        What positive values mean, for people.
    values, half_widths_95 : (F,) ndarray
        Degrees or mm, and the half widths of the 95 % intervals; NaN where they are not known.

    """

    name: str
    positive: str
    values: np.ndarray
    half_widths_95: np.ndarray


@dataclass(frozen=True, eq=False)
class JointCurves:
    """What a track's folder says of one joint.

    Parameters
    ----------
    name : str
        Of the joint.
    frames : (F,) ndarray
        int: their numbers in the sequence.
    seconds : (F,) ndarray
        Their times.
    angles, translations : tuple of Curve
        Degrees, mm.
    doubtful : (F,) ndarray
        bool: the pose of one of both bones is flagged as uncertain.

    """

    name: str
    frames: np.ndarray
    seconds: np.ndarray
    angles: tuple[Curve, ...]
    translations: tuple[Curve, ...]
    doubtful: np.ndarray
