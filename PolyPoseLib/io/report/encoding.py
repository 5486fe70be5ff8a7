"""Pictures as files in memory, for pages that need no other file."""

from __future__ import annotations

import base64
import tempfile
from pathlib import Path

import numpy as np

QUALITY = 88
"""Of JPEG, in percent: edges of bones stay as they are, and a page of two X-rays has about a megabyte."""


def jpeg_uri(image: np.ndarray) -> str:
    """An image (H, W) or (H, W, 3) uint8 as a data URI of a JPEG file."""
    import SimpleITK as sitk

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.jpg"
        picture = sitk.GetImageFromArray(np.ascontiguousarray(image), isVector=image.ndim == 3)
        sitk.WriteImage(picture, str(path), useCompression=True, compressionLevel=QUALITY)
        return "data:image/jpeg;base64," + base64.b64encode(path.read_bytes()).decode("ascii")
