"""The verdict on a result: one banner that says whether it may be used, why not, and what to do."""

from __future__ import annotations

from dataclasses import dataclass

from slicer.i18n import tr as _

from ..study.results import OutputNodes


@dataclass(frozen=True)
class Verdict:
    """A headline with a sign before it, the lines below it, and colours that all can tell apart (Okabe and Ito)."""

    title: str
    lines: tuple[str, ...]
    sign: str
    background: str
    foreground: str

    @property
    def headline(self) -> str:
        """The sign and the title."""
        return f"{self.sign} {self.title}"

    @property
    def style(self) -> str:
        """The style sheet of the banner."""
        return (
            f"background-color: {self.background}; color: {self.foreground}; font-weight: bold; "
            "padding: 6px; border-radius: 4px;"
        )


DISTRUSTED = ("\u2715", "#a33b00", "#ffffff")
CHECK = ("\u26a0", "#e69f00", "#000000")
FINE = ("\u2713", "#0072b2", "#ffffff")
"""The sign and the colours of each kind of verdict."""


def verdict_of(outputs: OutputNodes) -> Verdict:
    """The verdict on a result; every reason and warning is among its lines."""
    warnings = [_("Warning: {text}").format(text=each) for each in outputs.warnings]
    if outputs.distrust:
        reasons = [_("Why: {why}").format(why=each) for each in outputs.distrust]
        advice = _(
            "What to do: look at the overlay of each X-ray; where it does not match, give a better initial camera or "
            "landmarks, and register again."
        )
        return Verdict(_("DO NOT TRUST THIS RESULT"), (*reasons, advice, *warnings), *DISTRUSTED)
    if warnings:
        title = _("Check what is named here before you use the result")
        return Verdict(title, tuple(warnings), *CHECK)
    advice = _("Look at the overlay of each X-ray all the same.")
    return Verdict(_("The checks found no sign of failure"), (advice,), *FINE)
