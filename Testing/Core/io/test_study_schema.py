"""JSON that no study needs, and that would harm what reads it, is refused while it is parsed."""

import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.json_records import parse_object


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("1" * 5000, "whole number of 5000 digits"),
        ("-" + "1" * 400, "whole number of 401 digits"),
        ("1e999", "1e999, which is too large"),
        ("-1e999", "-1e999, which is too large"),
        ("[" * 60 + "]" * 60, "nested too deeply"),
        ('{"a":' * 60 + "1" + "}" * 60, "nested too deeply"),
        ("[" * 900 + "]" * 900, "nested too deeply"),
        ("[" * 100_000 + "]" * 100_000, "nested too deeply"),
    ],
)
def test_what_computers_do_not_hold_is_refused(value, words):
    with pytest.raises(InputError, match=words) as caught:
        parse_object(f'{{"comment": {value}}}', "study.json")
    assert str(caught.value).startswith("study.json: ") and len(str(caught.value)) < 200


def test_numbers_and_nests_of_any_study_are_read():
    text = '{"a": [[[{"b": [1, -2.5, 1e300, 123456789012345678901234567890]}]]]}'
    numbers = parse_object(text, "x")["a"][0][0][0]["b"]
    assert numbers == [1, -2.5, 1e300, 123456789012345678901234567890] and isinstance(numbers[0], int)
