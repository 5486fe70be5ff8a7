"""How line integrals are stored in a simulated X-ray file, and the exact scale that leads back to them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.tags import XrayTags

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

PRIVATE_GROUP, PRIVATE_CREATOR = 0x0011, "POLYPOSE"
"""Private block of simulated images: element 1 is I0; 2 and 3 are slope and intercept to line integrals."""

_ELEMENTS = {"unattenuated": 1, "slope": 2, "intercept": 3}


@dataclass(frozen=True, kw_only=True)
class Storage:
    """How line integrals become stored values; one that exists is valid.

    Attributes
    ----------
    bits
        Bits stored, 8 to 16.
    encoding
        "linear": proportional to the beam (LIN); "log": linear in the line integral (LOG).
    saturation
        Line integrals below this are burnt out to it.
    photons
        Count of an unattenuated pixel, for Poisson noise; no noise when None.
    seed
        Of the noise.
    display
        "source": stored as seen from the source; "detector": columns reversed, as C-arms show it.

    Raises
    ------
    InputError
        From the constructor, for settings that cannot be stored.

    """

    bits: int = 12
    encoding: str = "linear"
    saturation: float = 0.0
    photons: float | None = None
    seed: int = 0
    display: str = "source"

    def __post_init__(self) -> None:
        """Validate."""
        whole = isinstance(self.bits, int | np.integer) and not isinstance(self.bits, bool)
        if not whole or not 8 <= self.bits <= 16:
            raise InputError(f"bits is {self.bits}; give a whole number from 8 to 16.")
        if self.encoding not in ("linear", "log"):
            raise InputError(f'encoding is {self.encoding!r}; give "linear" or "log".')
        if self.display not in ("source", "detector"):
            raise InputError(f'display is {self.display!r}; give "source" or "detector".')
        if not (np.isfinite(self.saturation) and self.saturation >= 0):
            raise InputError(f"saturation is {self.saturation}; give a line integral of 0 or more.")
        if self.photons is not None and not (np.isfinite(self.photons) and self.photons > 0):
            raise InputError(f"photons is {self.photons}; give a count above 0.")

    def stored(self, line_integrals: ArrayLike) -> tuple[np.ndarray, dict[str, float]]:
        """Stored values, and the scale that leads back.

        Parameters
        ----------
        line_integrals
            (H, W) or (F, H, W), unitless, as seen from the source.

        Returns
        -------
        stored
            Whole numbers of the same shape, in the arrangement of the display.
        scale
            {"unattenuated": I0} of a linear encoding, {"slope", "intercept"} of a logarithmic one.

        Raises
        ------
        InputError
            Values that are not finite, or of another shape.

        """
        lines = np.asarray(line_integrals, dtype=np.float64)
        if lines.ndim not in (2, 3) or not lines.size or not np.isfinite(lines).all():
            raise InputError("Line integrals to write must be finite and of shape (H, W) or (F, H, W).")
        if self.photons is not None:
            counts = np.random.default_rng(self.seed).poisson(self.photons * np.exp(-lines))
            lines = -np.log(np.maximum(counts, 0.5) / self.photons)
        stored, scale = self._encoded(np.maximum(lines, self.saturation))
        return (stored[..., ::-1] if self.display == "detector" else stored), scale

    def _encoded(self, lines: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
        """Stored values in the source's arrangement, and the scale."""
        levels = 2**self.bits - 1
        if self.encoding == "linear":
            direct = levels * float(np.exp(self.saturation))
            stored = np.clip(np.rint(direct * np.exp(-lines)), 1, levels)
            scale = {"unattenuated": direct}
        else:
            top = max(float(lines.max()), self.saturation + 1e-6)
            step = (top - self.saturation) / levels
            stored = np.clip(np.rint((top - lines) / step), 0, levels)
            scale = {"slope": -step, "intercept": top}
        return stored.astype(np.uint8 if self.bits == 8 else np.uint16), scale


def put_scale(dataset: Dataset, scale: dict[str, float]) -> None:
    """Write the scale into the dataset's private block."""
    block = dataset.private_block(PRIVATE_GROUP, PRIVATE_CREATOR, create=True)
    for name, value in scale.items():
        block.add_new(_ELEMENTS[name], "FD", value)


def own_scale(tags: XrayTags) -> dict[str, float]:
    """Exact scale that a simulated image carries: {"unattenuated"} or {"slope", "intercept"}, else empty."""
    try:
        block = tags.dataset.private_block(PRIVATE_GROUP, PRIVATE_CREATOR)
    except KeyError:
        return {}
    found = {}
    for name, offset in _ELEMENTS.items():
        if offset in block:
            value = block[offset].value
            if isinstance(value, bytes) and len(value) == 8:
                (value,) = struct.unpack("<d", value)
            if isinstance(value, float) and np.isfinite(value):
                found[name] = value
    return found
