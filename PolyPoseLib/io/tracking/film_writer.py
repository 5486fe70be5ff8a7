"""A film written picture by picture: MP4, encoded by PyAV."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, cast

import numpy as np

from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from av.container import OutputContainer
    from av.video.stream import VideoStream

ENDING = ".mp4"
"""Of a film's name."""

_ENCODERS = (
    ("libx264", {"crf": "23", "preset": "veryfast", "rc-lookahead": "10"}),
    ("mpeg4", {"qscale": "3"}),
)
"""H.264, which every browser and player shows, or else MPEG-4 part 2: builds without H.264 have that one."""


class FilmWriter:
    """Encodes pictures as they come; only a few of them are held in memory.

    Parameters
    ----------
    path : Path
        Ends with ENDING; its folder exists.
    height, width : int
        Of the pictures, even numbers of pixels.
    frames_per_second : float
        At which they are played.

    Raises
    ------
    InputError
        PyAV is missing, or has neither encoder.

    """

    def __init__(self, path: Path, height: int, width: int, frames_per_second: float) -> None:
        try:
            import av
        except ImportError as error:
            raise InputError("The video needs PyAV, which is not installed: pip install av.") from error
        self._av = av
        self._rate = Fraction(frames_per_second).limit_denominator(1000) or Fraction(1, 1000)
        name, options = _encoder()
        self._container: OutputContainer = av.open(str(path), "w", options={"movflags": "+faststart"})
        stream = self._container.add_stream(name, rate=self._rate, options=options)
        self._stream = cast("VideoStream", stream)
        self._stream.height, self._stream.width = height, width
        self._stream.pix_fmt = "yuv420p"
        self._shape = (height, width, 3)
        self._count = 0

    def add(self, picture: np.ndarray) -> None:
        """Encode the next picture, (H, W, 3) uint8; raises ValueError for another size."""
        if picture.shape != self._shape or picture.dtype != np.uint8:
            raise ValueError(f"the picture is {picture.shape} {picture.dtype}: give {self._shape} uint8")
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        frame.pts, frame.time_base = self._count, 1 / self._rate
        self._count += 1
        self._container.mux(self._stream.encode(frame))

    def __enter__(self) -> FilmWriter:
        """Return the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write what is still held, unless an error ends the film, and close the file."""
        try:
            if kind is None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()


def _encoder() -> tuple[str, dict[str, str]]:
    """The first encoder that this build of PyAV has, and its options; raises InputError when it has none."""
    from av.codec import Codec

    for name, options in _ENCODERS:
        try:
            Codec(name, "w")
        except ValueError:
            continue
        return name, options
    raise InputError(
        "This build of PyAV encodes neither H.264 nor MPEG-4: install the one of PyPI, pip install av."
    )
