"""Sentences of the core, which name fields of a study file, in the words of the panel's form."""

from __future__ import annotations

import re

from slicer.i18n import tr as _

_UNITS = {"_mm": "mm", "_px": "px", "_deg": "deg"}


def field_labels() -> dict[str, str]:
    """{field of an X-ray in a study file: what the panel's form calls it}."""
    return {
        "source_to_detector_mm": _("Source to detector"),
        "source_to_isocenter_mm": _("Source to isocentre"),
        "pixel_spacing_mm": _("Pixel spacing"),
        "principal_point_px": _("Principal point"),
        "primary_angle_deg": _("LAO + / RAO -"),
        "secondary_angle_deg": _("CRA + / CAU -"),
        "isocenter_mm": _("Isocentre"),
        "patient_position": _("Patient position"),
        "standard_view": _("Search near"),
        "extrinsic": _("Camera pose"),
    }


def choices() -> dict[str, str]:
    """{what a sentence advises to add to a study file: what is chosen in the form instead}."""
    chosen = {
        'add "mirrored": false': (_("Image seen from"), _("the source")),
        'give "mirrored": false': (_("Image seen from"), _("the source")),
        'add "distortion_corrected": true': (_("Distortion"), _("corrected")),
    }
    words = _('set "{field}" to "{choice}"')
    return {advice: words.format(field=field, choice=choice) for advice, (field, choice) in chosen.items()}


def in_words(sentence: str) -> str:
    """A sentence of the core with the form's labels in place of the names of fields.

    A line that says where a number comes from, "source_to_detector_mm 1020 from DICOM", becomes
    "Source to detector: 1020 mm, from DICOM".
    """
    for advice, choice in choices().items():
        sentence = sentence.replace(advice, choice)
    labels = field_labels()
    names = "|".join(labels)
    origin = re.match(rf"({names}) ([-\d., x]*\d):? (.*)$", sentence, re.DOTALL)
    if origin:
        name, value, rest = origin.groups()
        return f"{labels[name]}: {value} {_unit(name)}, {rest}"
    sentence = re.sub(rf"^({names})(?= from |:)", lambda found: labels[found[1]], sentence)
    sentence = sentence.replace('an "extrinsic"', 'a "extrinsic"')
    sentence = re.sub(rf'"({names})"', lambda found: f'"{_with_unit(found[1], labels)}"', sentence)
    # Outside of quotes only names that cannot be words of the sentence.
    return re.sub(
        rf"\b({names})\b",
        lambda found: f'"{_with_unit(found[1], labels)}"' if "_" in found[1] else found[1],
        sentence,
    )


def _unit(name: str) -> str:
    return next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "")


def _with_unit(name: str, labels: dict[str, str]) -> str:
    unit = _unit(name)
    return f"{labels[name]} [{unit}]" if unit else labels[name]
