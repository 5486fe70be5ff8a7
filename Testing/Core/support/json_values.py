"""Any JSON value, and JSON with one value replaced: for properties of what reads files."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import strategies as st

from PolyPoseLib.errors import InputError

SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**6), 10**6),
    st.integers(),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(max_size=12),
    st.sampled_from(["pelvis", "known", "ap.nii.gz", "image", "extrinsic", "\0", "a\nb", "\ud800", " "]),
)

VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=8,
)


def places(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The keys and numbers that lead to every value inside, the whole first."""
    yield place
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from places(inner, (*place, key))
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from places(inner, (*place, number))


@st.composite
def changed(draw: st.DrawFn, fields: dict[str, Any]) -> dict[str, Any]:
    """The fields with one value inside replaced by any other, or removed."""
    fields = copy.deepcopy(fields)
    place = draw(st.sampled_from([each for each in places(fields) if each]))
    inner: Any = fields
    for key in place[:-1]:
        inner = inner[key]
    if draw(st.integers(0, 9)) == 0:
        del inner[place[-1]]
    else:
        inner[place[-1]] = draw(VALUES)
    return fields


def assert_one_sentence(error: pytest.ExceptionInfo[InputError] | InputError) -> None:
    """The message is one line of a readable length."""
    text = str(error if isinstance(error, InputError) else error.value)
    assert text and "\n" not in text and len(text) < 700, text
