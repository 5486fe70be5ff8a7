"""Bytes of a file with a few of them changed, missing or repeated: for properties of what reads files."""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st

FEW = settings(max_examples=max(settings.default.max_examples // 4, 1))
"""Fewer examples than the profile asks for: reading a file takes milliseconds."""

HEAD_BYTES = 700
"""Most changes fall here, where the headers of small files are."""


@st.composite
def damaged(draw: st.DrawFn, whole: bytes) -> bytes:
    """The bytes with one to four changes."""
    content = bytearray(whole)
    for _ in range(draw(st.integers(1, 4))):
        end = draw(st.sampled_from([min(len(content), HEAD_BYTES), len(content)]))
        place = draw(st.integers(0, max(end - 1, 0)))
        length = draw(st.sampled_from([1, 1, 2, 4, 16]))
        match draw(st.sampled_from(["replace", "replace", "replace", "cut", "remove", "repeat", "insert"])):
            case "replace":
                piece = draw(st.binary(min_size=length, max_size=length))
                content[place : place + length] = piece
            case "cut":
                del content[place:]
            case "remove":
                del content[place : place + length]
            case "repeat":
                content[place:place] = content[place : place + length]
            case "insert":
                content[place:place] = draw(st.binary(min_size=1, max_size=length))
    return bytes(content)
