"""The XML of layouts: views, rows and tabs."""

from __future__ import annotations

THREE_D_VIEW = "1"
"""Slicer's own first 3D view."""

_VIEW = """<item splitSize="500"><view class="{kind}" singletontag="{name}">{properties}</view></item>"""
_SPLIT = ' split="true"'


def xray_item(name: str, number: int, group: int) -> str:
    """The slice view of an X-ray; number: its place, from 1. group: its view group."""
    return _view(
        "vtkMRMLSliceNode",
        name,
        orientation="Axial",
        viewlabel=f"X{number}",
        viewgroup=str(group),
        viewcolor="#E0A030",
    )


def slice_item(name: str, orientation: str, color: str) -> str:
    """A slice view of the anatomy."""
    return _view("vtkMRMLSliceNode", name, orientation=orientation, viewlabel=name[0], viewcolor=color)


def plot_item(name: str, label: str) -> str:
    """A plot view."""
    return _view("vtkMRMLPlotViewNode", name, viewlabel=label)


def _view(kind: str, name: str, **properties: str) -> str:
    lines = "".join(
        f'<property name="{key}" action="default">{value}</property>' for key, value in properties.items()
    )
    return _VIEW.format(kind=kind, name=name, properties=lines)


THREE_D = _view("vtkMRMLViewNode", THREE_D_VIEW, viewlabel="1")
"""The 3D view."""


def layout(kind: str, items: list[str], split: bool = True) -> str:
    """A layout's element around its items."""
    return f'<layout type="{kind}"{_SPLIT if split else ""}>{"".join(items)}</layout>'


def item(content: str, size: int = 500) -> str:
    """An item around a layout; size: its share of a split."""
    return f'<item splitSize="{size}">{content}</item>'
