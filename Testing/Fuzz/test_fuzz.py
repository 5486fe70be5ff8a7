"""Ten seconds of fuzzing for every reader, from a fixed seed: ``python -m pytest -m fuzz Testing/Fuzz``."""

import pytest
from fuzz import fuzz
from fuzz_targets import TARGETS

from PolyPoseLib.errors import InputError

SECONDS = 10


@pytest.mark.fuzz
@pytest.mark.parametrize("name", TARGETS)
def test_nothing_but_values_and_sentences(name, tmp_path):
    tried, refused, findings = fuzz(name, 0, SECONDS, tmp_path)
    assert tried > 5 and refused > 0
    assert not findings, [(tmp_path / each).read_text()[-2000:] for each in findings]


@pytest.mark.parametrize("name", TARGETS)
def test_every_sound_file_is_read(name, tmp_path):
    subjects = TARGETS[name](tmp_path)
    for subject in subjects:
        subject.path.write_bytes(subject.packed(subject.whole))
    for read in dict.fromkeys(subject.read for subject in subjects):
        try:
            read()
        except InputError as error:
            assert name == "camera_model", error
