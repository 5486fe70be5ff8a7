"""A sequence's fingerprint: two sequences that are tracked alike have the same, so that a run can be resumed."""

from __future__ import annotations

import hashlib
import json

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.io.json_records import plain
from PolyPoseLib.io.tracking.camera_images import spread

LOOKED_AT = 9
"""Images of each camera whose pixels count."""


def fingerprint(sequence: Sequence) -> str:
    """A digest of all on which the poses of a forward pass depend.

    The backward pass, smoothing and joints with their landmarks come after what is resumed, and threads change nothing.
    The range of frames counts, because the images' scale is decided on it. Of the images, a few spread over the frames
    count: reading all of them takes minutes.

    Parameters
    ----------
    sequence : Sequence
        To be tracked.

    Returns
    -------
    str
        64 hexadecimal digits.

    """
    options = sequence.options
    digest = hashlib.sha256()
    texts = {
        "version": __version__,
        "names": sequence.structures.names,
        "frames_per_second": sequence.frames_per_second,
        "reference": sequence.reference,
        "still": sequence.still,
        "initial_poses": dict(sorted(sequence.initial_poses.items())),
        "options": [
            options.start,
            options.prediction,
            options.first,
            options.last,
            options.kernel,
        ],
        "cameras": [
            [
                view.name,
                view.first,
                view.camera.intrinsics,
                view.camera.extrinsic,
                view.camera.height,
                view.camera.width,
            ]
            for view in sequence.views
        ],
    }
    digest.update(json.dumps(plain(texts), sort_keys=True).encode())
    for each in (sequence.ct.affine, sequence.ct.voxels, sequence.structures.labels):
        digest.update(f"{each.dtype.str}{each.shape}".encode())
        digest.update(np.ascontiguousarray(each).data)
    for view in sequence.views:
        for number in spread(range(options.first, sequence.available), LOOKED_AT):
            image, mask = view.images.read(view.first + number)
            digest.update(image.tobytes())
            digest.update(np.packbits(mask).tobytes())
    return digest.hexdigest()
