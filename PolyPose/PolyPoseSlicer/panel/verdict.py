"""The verdict on a result: one banner that says whether it may be used, why not, and what to do."""

from __future__ import annotations

from dataclasses import dataclass

from slicer.i18n import tr as _

from ..study.results import OutputNodes


@dataclass(frozen=True)
class Verdict:
    """A headline with a sign before it, the lines below it, and colours that all can tell apart (Okabe and Ito)."""

    headline: str
    lines: tuple[str, ...]
    background: str
    foreground: str

    @property
    def style(self) -> str:
        """The style sheet of the banner."""
        return (
            f"background-color: {self.background}; color: {self.foreground}; font-weight: bold; "
            "padding: 6px; border-radius: 4px;"
        )


def verdict_of(outputs: OutputNodes) -> Verdict:
    """The verdict on a result; every reason and warning is among its lines."""
    warnings = [_("Warning: {text}").format(text=each) for each in outputs.warnings]
    if outputs.distrust:
        reasons = [_("Why: {why}").format(why=each) for each in outputs.distrust]
        advice = _(
            "What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or "
            "landmarks, and register again."
        )
        headline = "\u2715 " + _("DO NOT TRUST THIS RESULT")
        return Verdict(headline, (*reasons, advice, *warnings), "#a33b00", "#ffffff")
    if warnings:
        headline = "\u26a0 " + _("Check what is named here before you use the result")
        return Verdict(headline, tuple(warnings), "#e69f00", "#000000")
    headline = "\u2713 " + _("The checks found no sign of failure")
    advice = _("Look at the overlay of each X-ray all the same.")
    return Verdict(headline, (advice,), "#0072b2", "#ffffff")
