"""Which of the extensions that segment bones are installed, and the offer to install one."""

from __future__ import annotations

from typing import Any

import slicer
from slicer.i18n import tr as _

from .dependencies import is_testing
from .monai_auto3dseg import MonaiAuto3DSeg
from .segmentation_task import Segmenter
from .total_segmentator import TotalSegmentator

_SEGMENTERS = (TotalSegmentator, MonaiAuto3DSeg)
_OFFERED = TotalSegmentator.name


def installed_segmenter() -> Segmenter | None:
    """The first extension whose module the application has loaded, or None."""
    for segmenter in _SEGMENTERS:
        if hasattr(slicer.modules, segmenter.name.lower()):
            return segmenter()
    return None


def offer_segmenter() -> str:
    """Ask whether to install the extension TotalSegmentator, and do so; one sentence says what came of it.

    The extensions manager asks by itself when it is interactive; here it is asked once, and in words that name the
    other extension.
    """
    by_hand = _(
        "Bones are segmented by the extension TotalSegmentator or MONAIAuto3DSeg: install one in the Extensions "
        "Manager and restart Slicer."
    )
    manager = slicer.app.extensionsManagerModel() if hasattr(slicer.app, "extensionsManagerModel") else None
    if manager is None or is_testing():
        return by_hand
    if manager.isExtensionInstalled(_OFFERED):
        return _(
            "The extension {name} is installed, but its module is not loaded: restart Slicer, or enable it in the "
            "Extensions Manager."
        ).format(name=_OFFERED)
    question = _(
        "Bones are segmented by an extension, and neither TotalSegmentator nor MONAIAuto3DSeg is installed.\n\n"
        "Install {name} now, with the extensions that it needs? It is downloaded from Slicer's extensions server."
    ).format(name=_OFFERED)
    if not slicer.util.confirmOkCancelDisplay(question):
        return by_hand
    if not _install(manager):
        return _(
            "The extension {name} could not be installed: check the network connection, or install it in the "
            "Extensions Manager."
        ).format(name=_OFFERED)
    slicer.app.confirmRestart(
        _(
            "{name} was installed. Slicer must be restarted before it can be used; data that were not saved are "
            "lost. Restart now?"
        ).format(name=_OFFERED)
    )
    return _("{name} was installed: save your data and restart Slicer.").format(name=_OFFERED)


def _install(manager: Any) -> bool:
    """Install without further questions, and wait for it."""
    was = manager.interactive
    manager.interactive = False
    try:
        # Returns before a restart, which is left to the user.
        installed = manager.installExtensionFromServer(_OFFERED, False)
    finally:
        manager.interactive = was
    return bool(installed) and manager.isExtensionInstalled(_OFFERED)
