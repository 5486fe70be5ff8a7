"""The table that says what pixel values mean: one row for every combination of tags, and the same for both signs."""

import itertools
from functools import cache

from pydicom.dataset import Dataset

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.intensity_rules import FLUOROSCOPY, RULES, IntensityFacts, intensity_of_tags
from PolyPoseLib.io.xray.tags import XrayTags

FACTS = [
    IntensityFacts(*values)
    for values in itertools.product(
        ["LIN", "LOG", "DISP", "", "ODD"],
        [1, -1, None],
        [True, False],
        [True, False],
        [True, False],
        [True, False],
        [1, -1],
    )
]

TAGS = {
    "Modality": ["XA", "DX", "RTIMAGE", None],
    "PixelIntensityRelationship": ["LIN", "LOG", "DISP", None],
    "PixelIntensityRelationshipSign": [1, -1, None],
    "PhotometricInterpretation": ["MONOCHROME1", "MONOCHROME2"],
    "PresentationLUTShape": ["INVERSE", None],
    "PresentationIntentType": ["FOR PRESENTATION", "FOR PROCESSING", None],
    "ModalityLUTSequence": [True, None],
}


def tags_of(values) -> XrayTags:
    """Attributes with these values; None leaves one out."""
    dataset = Dataset()
    for keyword, value in zip(TAGS, values, strict=True):
        if value is not None:
            setattr(dataset, keyword, [Dataset()] if keyword == "ModalityLUTSequence" else value)
    return XrayTags(dataset)


@cache
def decided(values, order):
    notes = Notes("x")
    return intensity_of_tags(tags_of(values), order, notes), notes


def test_exactly_one_row_applies():
    for facts in FACTS:
        assert sum(rule.applies(facts) for rule in RULES) == 1, facts


def test_every_row_is_reached():
    assert all(any(rule.applies(facts) for facts in FACTS) for rule in RULES)


def test_every_combination_of_tags_has_a_meaning_and_one_reason():
    opposite = {
        "transmission": "inverse_transmission",
        "inverse_transmission": "transmission",
        "attenuation": "log_transmission",
        "log_transmission": "attenuation",
    }
    for values in itertools.product(*TAGS.values()):
        meaning, notes = decided(values, 1)
        assert len(notes.provenance) == 1 and notes.provenance[0].startswith("intensity: ")
        assert "{" not in " ".join(notes.provenance + notes.warnings)
        falling, other = decided(values, -1)
        # The relationship describes stored values, which a falling slope turns round; the display the rescaled ones.
        unsaid = values[1] in ("DISP", None) or (values[2] is None and values[0] not in FLUOROSCOPY)
        if unsaid or "made linear by the Modality LUT" in notes.provenance[0]:
            assert falling == meaning
        elif not any("the display decides" in line for line in notes.warnings + other.warnings):
            assert falling == opposite[meaning]


def test_only_a_stated_linear_relationship_makes_values_proportional_to_the_beam():
    for values in itertools.product(*TAGS.values()):
        meaning, notes = decided(values, 1)
        if meaning in ("transmission", "inverse_transmission"):
            assert values[1] == "LIN" or (values[1] == "LOG" and values[6] and values[0] in FLUOROSCOPY)
            assert not (values[5] == "FOR PRESENTATION" and values[1] == "LIN")
        elif values[1] in ("DISP", None):
            assert any("bone is taken as" in line for line in notes.warnings)


def test_fluoroscopy_without_a_sign_is_dark_behind_bone():
    for values in itertools.product(*TAGS.values()):
        if values[0] in FLUOROSCOPY and values[2] not in (1, -1):
            assert decided(values, 1)[0] in ("transmission", "log_transmission")
            if values[1] is None:
                assert decided(values, -1)[0] == "log_transmission"


def test_a_processed_radiograph_follows_its_display():
    for values in itertools.product(*TAGS.values()):
        inverted = values[3] == "MONOCHROME1" or values[4] == "INVERSE"
        if values[0] not in FLUOROSCOPY and values[5] == "FOR PRESENTATION":
            for order in (1, -1):
                assert decided(values, order)[0] == ("log_transmission" if inverted else "attenuation")
