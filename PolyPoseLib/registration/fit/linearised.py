"""A view's residual with its derivatives, each where it is not zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.geometry.windows import Window, slices_of


@dataclass(frozen=True)
class Block:
    """Derivative of a view's residual by six unknowns.

    Attributes
    ----------
    first : int
        Number of the first unknown.
    window : Window
        Where it is not zero.
    jacobian : np.ndarray
        (6, h, w) inside the window.

    """

    first: int
    window: Window
    jacobian: np.ndarray

    @property
    def slices(self) -> tuple[slice, slice]:
        """The window as an index into an image."""
        return slices_of(self.window)


@dataclass(frozen=True)
class Linearised:
    """A view's residual and its derivatives.

    Attributes
    ----------
    residual : np.ndarray
        (H, W) normalised rendering less normalised X-ray.
    blocks : list[Block]
        Derivatives by the unknowns that the view depends on.

    """

    residual: np.ndarray
    blocks: list[Block]


def overlap_product(first: Block, weighted: np.ndarray, second: Block) -> np.ndarray:
    """(6, 6) sum over the pixels that two blocks share of the first's weighted derivative times the second's."""
    row0, row1 = max(first.window[0], second.window[0]), min(first.window[1], second.window[1])
    column0, column1 = max(first.window[2], second.window[2]), min(first.window[3], second.window[3])
    if row0 >= row1 or column0 >= column1:
        return np.zeros((6, 6))

    def part(values: np.ndarray, window: Window) -> np.ndarray:
        rows = slice(row0 - window[0], row1 - window[0])
        return values[:, rows, column0 - window[2] : column1 - window[2]].reshape(6, -1)

    return part(weighted, first.window) @ part(second.jacobian, second.window).T
