"""What the values of a DICOM X-ray mean, decided from its tags by a table: one row a rule.

The sources are PS3.3 C.8.11.3.1.2 (radiographs) and C.8.7.1 (fluoroscopy). The Pixel Intensity Relationship
(0028,1040) and its Sign (0028,1041) describe stored values, before the rescale slope, and count first; fluoroscopy
without a sign rises with the beam. The display (MONOCHROME1 or 2) describes the rescaled values.
An image that a radiograph's vendor processed for presentation is never taken as proportional to the beam, and its sign
yields to the display, where bone is bright. Without the relationship, fluoroscopy is dark behind bone, and
radiographs and RT images are bright behind bone once MONOCHROME1 or the presentation LUT's INVERSE is undone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.tags import XrayTags

FLUOROSCOPY = ("XA", "RF", "XC")
"""Modalities whose images are dark behind bone."""

SignState = Literal["absent", "as displayed", "against the display"]


@dataclass(frozen=True)
class IntensityFacts:
    """What the rules depend on.

    Attributes
    ----------
    relationship
        Pixel Intensity Relationship (0028,1040): "LIN", "LOG", "DISP", another text, or "".
    sign
        Pixel Intensity Relationship Sign (0028,1041): 1 when stored values rise with the beam, -1 when they fall,
        None when the file does not say.
    fluoroscopy
        Whether the modality is one of `FLUOROSCOPY`.
    inverted
        Whether the display inverts the values: MONOCHROME1, or a presentation LUT of the shape INVERSE.
    presented
        Whether the values were processed FOR PRESENTATION (0008,0068).
    lut
        Whether a Modality LUT (0028,3000) is applied to the stored values.
    order
        1 when the rescaled values rise with the stored ones, -1 when they fall.

    """

    relationship: str
    sign: int | None
    fluoroscopy: bool
    inverted: bool
    presented: bool
    lut: bool
    order: int = 1

    @property
    def display_sign(self) -> int:
        """1 when rescaled values rise with the beam by the display's convention, else -1."""
        return 1 if self.fluoroscopy or self.inverted else -1

    @property
    def stated_sign(self) -> int | None:
        """1 when rescaled values rise with the beam by the relationship and its sign, else -1; None if unsaid."""
        if self.sign is not None:
            return self.sign * self.order
        return self.order if self.fluoroscopy and self.relationship in ("LIN", "LOG") else None

    @property
    def sign_state(self) -> SignState:
        """Whether there is a sign, and whether the display agrees with it."""
        if self.sign is None:
            return "absent"
        return "as displayed" if self.stated_sign == self.display_sign else "against the display"


@dataclass(frozen=True)
class Rule:
    """One row: which facts it is for, and what follows. A condition that is None holds for every value.

    Attributes
    ----------
    relationship
        Accepted relationships; None for those that are neither LIN nor LOG.
    fluoroscopy, presented, lut, signs
        Conditions on the facts of the same name; `signs` lists accepted states of the sign.
    proportional
        Whether the values are proportional to the beam; otherwise they are linear in the line integral.
    direction
        What says whether the values rise with the beam: the file's "sign" (where absent, the display), the "display",
        or the "lut", after which they always rise.
    reason
        Line for the provenance. The texts may hold {relationship}, {sign}, {stated}, {modality}, {photometric}, {why}
        and {bone}.
    warning
        Line for the warnings, or "".

    """

    relationship: tuple[str, ...] | None
    proportional: bool
    direction: Literal["sign", "display", "lut"]
    reason: str
    fluoroscopy: bool | None = None
    presented: bool | None = None
    lut: bool | None = None
    signs: tuple[SignState, ...] | None = None
    warning: str = ""

    def applies(self, facts: IntensityFacts) -> bool:
        """Whether the row is for these facts."""
        known = facts.relationship in ("LIN", "LOG")
        return (
            (not known if self.relationship is None else facts.relationship in self.relationship)
            and self.fluoroscopy in (None, facts.fluoroscopy)
            and self.presented in (None, facts.presented)
            and self.lut in (None, facts.lut)
            and (self.signs is None or facts.sign_state in self.signs)
        )

    def value_sign(self, facts: IntensityFacts) -> int:
        """1 when values after the Modality LUT or rescaling rise with the beam, else -1."""
        if self.direction == "lut":
            return 1
        stated = facts.stated_sign if self.direction == "sign" else None
        return facts.display_sign if stated is None else stated


_STATED = "pixel intensity relationship {relationship}, sign {sign:+d}"
_PROCESSED = _STATED + ", processed for presentation"
_UNSTATED = "{modality}, {photometric}, {why}"

RULES = (
    Rule(("LIN",), True, "sign", _STATED, presented=False),
    Rule(("LIN",), False, "sign", _PROCESSED, presented=True, fluoroscopy=True),
    Rule(("LOG",), True, "lut", _STATED + ", made linear by the Modality LUT", fluoroscopy=True, lut=True),
    Rule(("LOG",), False, "sign", _STATED, presented=False, fluoroscopy=True, lut=False),
    Rule(("LOG",), False, "sign", _PROCESSED, presented=True, fluoroscopy=True, lut=False),
    Rule(("LOG",), False, "sign", _STATED, presented=False, fluoroscopy=False),
    Rule(
        ("LIN", "LOG"),
        False,
        "sign",
        _PROCESSED,
        presented=True,
        fluoroscopy=False,
        signs=("absent", "as displayed"),
    ),
    Rule(
        ("LIN", "LOG"),
        False,
        "display",
        _PROCESSED,
        presented=True,
        fluoroscopy=False,
        signs=("against the display",),
        warning="the intensity relationship's sign (0028,1041) {stated:+d} contradicts {photometric}, which shows bone "
        'bright; the display decides; if that is wrong, add "intensity".',
    ),
    Rule(
        None,
        False,
        "display",
        _UNSTATED,
        warning="bone is taken as {bone} in the values ("
        + _UNSTATED
        + '); if that is wrong, add "intensity".',
    ),
)
"""The decision: for every combination of facts exactly one row applies."""


def rule_for(facts: IntensityFacts) -> Rule:
    """The row of the table that applies."""
    return next(rule for rule in RULES if rule.applies(facts))


def intensity_of_tags(tags: XrayTags, order: int, notes: Notes) -> str:
    """Decide what the values of a DICOM frame mean.

    Parameters
    ----------
    tags
        The frame's attributes.
    order
        1 when the values rise with the stored ones after the Modality LUT, -1 when they fall.
    notes
        Receives the decision and what is uncertain about it.

    Returns
    -------
    str
        One of the meanings described in `PolyPoseLib.io.xray.intensity`.

    """
    facts = _facts(tags, order)
    modality, photometric = tags.text("Modality"), tags.text("PhotometricInterpretation")
    if facts.fluoroscopy and facts.inverted:
        notes.warn(
            f"{modality} images are MONOCHROME2, this one is {photometric}: bone is taken as dark in the stored "
            'values; if that is wrong, add "intensity": "attenuation".'
        )
    rule = rule_for(facts)
    rising = rule.value_sign(facts)
    texts = {
        "relationship": facts.relationship,
        "sign": facts.sign or rising * order,
        "stated": facts.sign or 0,
        "modality": modality or "unknown modality",
        "photometric": photometric or "unknown photometric interpretation",
        "why": "display values" if facts.relationship == "DISP" else "no pixel intensity relationship",
        "bone": "dark" if rising > 0 else "bright",
    }
    if rule.warning:
        notes.warn(rule.warning.format(**texts))
    notes.say(f"intensity: {rule.reason.format(**texts)}")
    if rule.proportional:
        return "transmission" if rising > 0 else "inverse_transmission"
    return "log_transmission" if rising > 0 else "attenuation"


def _facts(tags: XrayTags, order: int) -> IntensityFacts:
    """The facts that a frame's tags state, whose values rise (1) or fall (-1) with the stored ones."""
    sign = tags.number("PixelIntensityRelationshipSign")
    return IntensityFacts(
        relationship=tags.text("PixelIntensityRelationship"),
        sign=int(sign) if sign in (1, -1) else None,
        fluoroscopy=tags.text("Modality") in FLUOROSCOPY,
        inverted=tags.text("PhotometricInterpretation") == "MONOCHROME1"
        or tags.text("PresentationLUTShape") == "INVERSE",
        presented=tags.text("PresentationIntentType") == "FOR PRESENTATION",
        lut=tags.has("ModalityLUTSequence"),
        order=order,
    )
