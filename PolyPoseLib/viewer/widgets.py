"""Controls, tables and texts of which the page is made; each is added where it is called."""

from __future__ import annotations

from trame.widgets import html, vtk


def literal(text: str) -> str:
    """A text that Vue shows as it is: names are the user's, and braces or tags in one are no template."""
    replaced = text.encode("utf-8", "replace").decode("utf-8")
    for character in "&<>{}\"'`":
        replaced = replaced.replace(character, f"&#{ord(character)};")
    return f"<span v-pre>{replaced}</span>"


def slider(name: str, most: int, low: str, high: str, label: str) -> None:
    """A slider from 0 to `most`, with what its ends mean; `label` is for screen readers."""
    with html.Label(classes="slider"):
        html.Span(low)
        html.Input(
            type="range", min=0, max=most, step=1, id=f"slider-{name}", value=(name,), aria_label=label,
            input=f"{name} = Number($event.target.value)",
        )  # fmt: skip
        html.Span(high)


def check(name: str, label: str) -> None:
    """A box to tick."""
    with html.Label(classes="check"):
        html.Input(type="checkbox", v_model=name, id=f"check-{name}")
        html.Span(label)


def actor(mesh: str, properties: str, placing: str) -> None:
    """A mesh of the page's state in the scene; properties and placing are expressions of the page."""
    with vtk.VtkGeometryRepresentation(property=(properties,), actor=(placing,)):
        vtk.VtkMesh(mesh, state=(mesh,))


def table(header: tuple[str, ...], rows: list[list[str]], colours: list[str]) -> None:
    """A table; the first rows have a mark of their colour."""
    with html.Div(classes="wide"), html.Table():
        with html.Thead(), html.Tr():
            for cell in header:
                html.Th(cell)
        with html.Tbody():
            for n, row in enumerate(rows):
                with html.Tr():
                    for place, cell in enumerate(row):
                        with html.Td():
                            if place == 0 and n < len(colours):
                                html.I(classes="swatch", style=f"background: {colours[n]}")
                            html.Span(literal(cell))
