"""Images and label maps carried through the dense transform, onto their own grid."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.carried import Frame
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.images import ENDINGS, read_scalar_image, write_image
from PolyPoseLib.io.volumes import read_volume

if TYPE_CHECKING:
    import SimpleITK as sitk

IMAGE_ENDINGS = tuple(each for each in ENDINGS if each not in (".hdr", ".img", ".img.gz", ".nhdr", ".mhd"))
"""Images in one file."""

MOST_LABELS = 512
"""An image of whole numbers, none negative, with no more values than this is a label map."""

_LOG = logging.getLogger(__name__)


def carry_image(result: Result, source: Path, target: Path, to: Frame, labels: bool | None) -> str:
    """Carry an image file; returns what to say of it.

    labels: whether its values are labels, which are never mixed; None to tell by its values.
    """
    read_volume(source)  # checks it
    image = read_scalar_image(source)
    volume = Volume.from_sitk(image)
    if labels is None:
        labels = looks_like_labels(volume)
        _LOG.info("%s: taken for %s.", source.name, "a label map" if labels else "an image of intensities")
    if labels and not np.issubdtype(volume.voxels.dtype, np.integer):
        whole = np.rint(volume.voxels)
        if not np.array_equal(whole, volume.voxels) or np.abs(whole).max() > np.iinfo(np.int32).max:
            raise InputError(f"{source}: its values are no whole numbers, so no labels: leave out --labels.")
        volume = volume.with_voxels(whole.astype(np.int32))
    carried = result.transform_image(volume, to, labels)
    out = carried.to_sitk()
    _keep_segments(image, out)
    write_image(out, target)
    kind = "label map" if labels else "image"
    return f"{kind} of {' x '.join(map(str, reversed(volume.shape)))} voxels, by the displacement field"


def looks_like_labels(volume: Volume) -> bool:
    """Whether an image holds few different whole numbers, none negative."""
    voxels = volume.voxels
    if not np.issubdtype(voxels.dtype, np.integer) or int(voxels.min()) < 0:
        return False
    return len(np.unique(voxels[:: max(1, len(voxels) // 64)])) <= MOST_LABELS


def _keep_segments(image: sitk.Image, out: sitk.Image) -> None:
    """Give the written image the segments' names and colours of a .seg.nrrd, each with the whole grid as extent."""
    whole = " ".join(f"0 {size - 1}" for size in out.GetSize())
    for key in image.GetMetaDataKeys():
        if key.startswith("Segment"):
            out.SetMetaData(key, whole if key.endswith("_Extent") else image.GetMetaData(key))
