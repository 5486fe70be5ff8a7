"""The images of one calibrated camera as line integrals: all converted by the same numbers, undistorted and masked.

What the values mean, their scale and the mask are decided once, on a few images spread over the run: gray values then
do not jump from frame to frame, and a bone that is not there yet in the first image does not leave the scale later.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.distortion import straightened, straightened_mask
from PolyPoseLib.io.tracking.image_run import ImageRun, image_of
from PolyPoseLib.io.tracking.tiff_run import other_size
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.intensity import Conversion, conversion_of
from PolyPoseLib.io.xray.values import PixelValues

LEAST_CONTRAST = 0.2
"""Span of an image's gray values, in that of the richest of those that are looked at, below which it shows nothing."""

KEPT = 4
"""Images that are kept, of those that were read last: restarts read them again."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What was decided for all images of a run.

    Attributes
    ----------
    conversion
        From values to line integrals.
    mask
        (H, W) bool in the file's arrangement, True where images may be used.

    """

    conversion: Conversion
    mask: np.ndarray


def decide(
    run: ImageRun, numbers: Sequence[int], given: XrayFields, given_mask: np.ndarray | None, notes: Notes
) -> Decision:
    """Decide meaning, scale and mask on some images of a run.

    Images without contrast do not count. A pixel is used where any of the others shows it: what hides it in some moves,
    and so do bones, into what was plain direct beam before.

    Parameters
    ----------
    run
        The images.
    numbers
        Of those that are looked at.
    given
        The camera's entry.
    given_mask
        (H, W) bool, the entry's own mask, or None.
    notes
        Receives what was decided.

    Raises
    ------
    InputError
        Images that cannot be read, of different sizes, constant, or of which the mask leaves nothing.

    """
    found: list[PixelValues] = []
    for number in numbers:
        own = notes if not found else Notes(image_of(notes.where, number), notes.entry)
        pixels = run.decided(number, given, own)
        if found and pixels.shape != found[0].shape:
            raise other_size(notes.where, number, pixels.shape, found[0].shape)
        found.append(pixels)
    shown = _with_contrast(found, given_mask)
    mask = np.any([each.mask for each in shown], axis=0)
    if given_mask is not None:
        mask &= given_mask
    if not mask.any():
        raise InputError(f'{notes.where}: the "mask" and the shutter leave no pixels; correct the mask.')
    conversion = conversion_of(
        np.concatenate([each.values[mask] for each in shown]),
        found[0].meaning,
        notes,
        unattenuated=found[0].unattenuated,
        step=found[0].step,
        largest=found[0].largest,
    )
    return Decision(conversion, mask)


def _with_contrast(found: list[PixelValues], given_mask: np.ndarray | None) -> list[PixelValues]:
    """Those of some images that show something: the tube may be off at times."""
    spans = []
    for each in found:
        seen = each.values[each.mask if given_mask is None else each.mask & given_mask]
        spans.append(float(np.ptp(np.percentile(seen, (1, 99)))) if seen.size else 0.0)
    return [each for each, span in zip(found, spans, strict=True) if span >= LEAST_CONTRAST * max(spans)]


class CameraImages:
    """Images of one camera, as :class:`PolyPoseLib.data.tracking.sequence.FrameImages` asks for them.

    Parameters
    ----------
    run : ImageRun
        The files.
    given : XrayFields
        The camera's entry.
    decision : Decision
        For all images.
    places : (2, H, W) ndarray, optional
        Where pixels without distortion lie in the files' images.
    mirrored : bool
        Whether the files show the detector's side: columns are then reversed.
    where : str
        Opening of the sentences of errors.

    """

    def __init__(
        self,
        run: ImageRun,
        given: XrayFields,
        decision: Decision,
        places: np.ndarray | None,
        mirrored: bool,
        where: str,
    ) -> None:
        self._run, self._given, self._decision, self._where = run, given, decision, where
        self._places, self._mirrored = places, mirrored
        self._recent: OrderedDict[int, np.ndarray] = OrderedDict()
        mask = decision.mask
        if places is not None:
            mask = straightened_mask(mask, places)
        self._mask = np.ascontiguousarray(mask[:, ::-1] if mirrored else mask)

    @property
    def count(self) -> int:
        """Number of images."""
        return self._run.count

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """One image (H, W) float32 line integrals and the mask (H, W) bool; raises InputError."""
        image = self._recent.get(index)
        if image is None:
            image = self._converted(index)
            self._recent[index] = image
            while len(self._recent) > KEPT:
                self._recent.popitem(last=False)
        return image.copy(), self._mask.copy()

    def _converted(self, index: int) -> np.ndarray:
        values = self._run.values(index, self._given)
        if values.shape != self._decision.mask.shape:
            raise other_size(self._where, index, values.shape, self._decision.mask.shape)
        if not np.isfinite(values).all():
            raise InputError(f"{image_of(self._where, index)} holds NaN or infinity; replace them by 0.")
        image = self._decision.conversion.apply(values)
        if self._places is not None:
            image = straightened(image, self._places)
        return np.ascontiguousarray(image[:, ::-1] if self._mirrored else image)
