"""Bytes of a file changed as accidents and attackers change them: flips, cuts, absurd numbers, endless fields."""

from __future__ import annotations

import re
import struct

from damaged_files import HEAD_BYTES, damaged
from hypothesis import strategies as st

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")

_ABSURD_TEXTS = [
    b"0", b"-1", b"2", b"7", b"11", b"16", b"100", b"255", b"65536", b"2147483647", b"-2147483648", b"4294967297",
    b"99999999999999999999", b"1e9", b"1e400", b"-1e-300", b"nan", b"inf", b"0x10", b"1.5", b"", b"%s", b"%n",
    b"1" * 400, b"A", b"true", b"null", b"[]", b"{}",
]  # fmt: skip

_ABSURD_WHOLE = [
    0,
    1,
    2,
    11,
    127,
    128,
    255,
    256,
    32767,
    32768,
    65535,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**63,
    2**64 - 1,
]

_ABSURD_REAL = [0.0, -0.0, -1.0, 1e-30, 1e30, float("nan"), float("inf"), float("-inf")]

_REPEATS = [2, 40, 260, 1100, 5000, 70_000]


@st.composite
def hostile(draw: st.DrawFn, whole: bytes) -> bytes:
    """The bytes with one change of a drawn kind, and sometimes accidental damage besides."""
    change = draw(st.sampled_from(_CHANGES))
    content = draw(change(whole))
    return draw(damaged(content)) if draw(st.integers(0, 3)) == 0 and content else content


@st.composite
def _stretched(draw: st.DrawFn, whole: bytes) -> bytes:
    """A few bytes of the file, or others, repeated very often in one place."""
    place = _place(draw, whole)
    piece = draw(
        st.sampled_from([whole[place : place + 1], whole[place : place + 8], b"A", b"9", b" ", b"\n"])
    )
    return whole[:place] + piece * draw(st.sampled_from(_REPEATS)) + whole[place:]


@st.composite
def _absurd_text(draw: st.DrawFn, whole: bytes) -> bytes:
    """A number that is written out, replaced by an absurd one."""
    found = [match.span() for match in _NUMBER.finditer(whole, 0, 8 * HEAD_BYTES)]
    if not found:
        return draw(_absurd_binary(whole))
    start, end = draw(st.sampled_from(found))
    return whole[:start] + draw(st.sampled_from(_ABSURD_TEXTS)) + whole[end:]


@st.composite
def _absurd_binary(draw: st.DrawFn, whole: bytes) -> bytes:
    """Bytes replaced by an absurd whole or real number in either order of bytes."""
    place, order = _place(draw, whole), draw(st.sampled_from("<>"))
    size = draw(st.sampled_from([1, 2, 4, 8]))
    if size >= 4 and draw(st.booleans()):
        piece = struct.pack(order + {4: "f", 8: "d"}[size], draw(st.sampled_from(_ABSURD_REAL)))
    else:
        value = draw(st.sampled_from(_ABSURD_WHOLE)) % 256**size
        piece = value.to_bytes(size, {"<": "little", ">": "big"}[order])
    return whole[:place] + piece + whole[place + size :]


@st.composite
def _copied(draw: st.DrawFn, whole: bytes) -> bytes:
    """A piece of the file written over another place of it."""
    source, place, size = _place(draw, whole), _place(draw, whole), draw(st.sampled_from([2, 8, 40, 200]))
    return whole[:place] + whole[source : source + size] + whole[place + size :]


def _place(draw: st.DrawFn, whole: bytes) -> int:
    """A place in the file, mostly in its head."""
    end = draw(st.sampled_from([min(len(whole), HEAD_BYTES), len(whole)]))
    return draw(st.integers(0, max(end - 1, 0)))


_CHANGES = [damaged, _stretched, _absurd_text, _absurd_binary, _copied]
