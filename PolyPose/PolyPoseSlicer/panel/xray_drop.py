"""Drag and drop onto the table of X-rays: image files of the desktop, and items of a tree of the data.

Slicer's tree of the subject hierarchy gives one address per item (mrml://scene/subjecthierarchy/item?id=...), as its
slice views take them; a file manager gives addresses of files. The DICOM browser gives no drags at all: its patients,
studies and series say NoDragDrop, and its thumbnails and tables start none; what was loaded from it is in the tree.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import qt
from slicer.i18n import tr as _

from ..study.dropped_xrays import xrays_of_files, xrays_of_items
from ..study.xray_source import XraySource

_ITEM = re.compile(r"mrml://scene/subjecthierarchy/item\?id=(\d+)")
_HIGHLIGHT = "QTableWidget { border: 2px solid palette(highlight); }"
_MOST_NAMES = 3


class XrayDrop(qt.QObject):
    """Filters the events of a table's viewport, the way in which Slicer's own Python modules take events of a widget.

    add: takes X-rays. say: takes one sentence.
    """

    def __init__(
        self, table: Any, add: Callable[[list[XraySource]], None], say: Callable[[str], None]
    ) -> None:
        """Let X-rays be dropped on a table."""
        super().__init__()
        self._table, self._add, self._say = table, add, say
        self._sources: list[XraySource] = []
        self._refused: list[str] = []
        # Added once the drop is over: until then the program that gave the drag waits.
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.interval = 0
        self._timer.connect("timeout()", self._take)
        table.viewport().setAcceptDrops(True)
        table.viewport().installEventFilter(self)

    def eventFilter(self, _watched: Any, event: Any) -> bool:
        """True for what is dragged over the table; Qt asks it for every event."""
        kind = event.type()
        if kind == qt.QEvent.DragEnter:
            self._enter(event)
        elif kind == qt.QEvent.DragMove:
            _accept(event, bool(self._sources))
        elif kind == qt.QEvent.DragLeave:
            self._highlight(False)
        elif kind == qt.QEvent.Drop:
            self._highlight(False)
            _finish(event, bool(self._sources))
            if self._sources:
                self._timer.start()
        else:
            return False
        return True

    def close(self) -> None:
        """Forget what was dropped last."""
        self._timer.stop()
        self._sources, self._refused = [], []

    def _enter(self, event: Any) -> None:
        """Take what is of use, and say at once what is not; refused drags go on to what lies below the table."""
        items, paths = _dragged(event)
        from_items, no_items = xrays_of_items(items)
        from_files, no_files = xrays_of_files(paths)
        self._sources, self._refused = from_items + from_files, no_items + no_files
        _accept(event, bool(self._sources))
        self._highlight(bool(self._sources))
        if not self._sources:
            self._say(_refusal(self._refused))

    def _take(self) -> None:
        sources, refused = self._sources, self._refused
        self.close()
        self._add(sources)
        if refused:
            self._say(_refusal(refused))

    def _highlight(self, shown: bool) -> None:
        self._table.setStyleSheet(_HIGHLIGHT if shown else "")


def _dragged(event: Any) -> tuple[list[int], list[str]]:
    """Items of the subject hierarchy, and files. Items of another Slicer have numbers that mean nothing here."""
    items, paths = [], []
    data = event.mimeData()
    for url in data.urls() if data.hasUrls() else ():
        item = _ITEM.fullmatch(url.toString())
        if item and is_from_here(event):
            items.append(int(item[1]))
        elif url.isLocalFile():
            paths.append(url.toLocalFile())
    return items, paths


def is_from_here(event: Any) -> bool:
    """Whether a widget of this application gave the drag."""
    return event.source() is not None


def _accept(event: Any, usable: bool) -> None:
    """Accept a drag as a copy where its source allows one: a file manager that moves would delete the file."""
    if not usable:
        event.ignore()
        return
    if event.possibleActions() & qt.Qt.CopyAction:
        event.setDropAction(qt.Qt.CopyAction)
    event.accept()


def _finish(event: Any, usable: bool) -> None:
    """Accept a drop; Slicer's tree only offers to move items, and would take its rows away after a move."""
    if usable and not event.possibleActions() & qt.Qt.CopyAction:
        event.setDropAction(qt.Qt.IgnoreAction)
        event.accept()
    else:
        _accept(event, usable)


def _refusal(names: list[str]) -> str:
    """One sentence about what cannot be dropped, and what can."""
    can = _(
        "drop image files, or loaded X-rays (a volume, a sequence, or a folder of them) from a tree of the data"
    )
    if not names:
        return _("Nothing here is an X-ray: {can}.").format(can=can)
    listed = ", ".join(f"'{name}'" for name in names[:_MOST_NAMES])
    if len(names) > _MOST_NAMES:
        listed = _("{names} and {count} more").format(names=listed, count=len(names) - _MOST_NAMES)
    return _("No X-ray: {names}; {can}.").format(names=listed, can=can)
