"""The pages of the documentation and what tests look for in them: links, headings, code and tables."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = (
    *(
        ROOT / name
        for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")
    ),
    *sorted(DOCS.rglob("*.md")),
)
NOTEBOOKS = tuple(sorted(DOCS.rglob("*.ipynb")))

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.M | re.S)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def name_of(page: Path) -> str:
    """A page's path in the repository."""
    return page.relative_to(ROOT).as_posix()


def prose(page: Path) -> str:
    """A page's Markdown without its blocks of code; of a notebook, its cells of Markdown."""
    if page.suffix == ".ipynb":
        return "\n".join(text for kind, text in cells(page) if kind == "markdown")
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def cells(notebook: Path) -> list[tuple[str, str]]:
    """Kind and text of every cell of a notebook."""
    stored = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return [(cell["cell_type"], "".join(cell["source"])) for cell in stored]


def code_blocks(page: Path, language: str) -> list[str]:
    """Blocks of code in a language; of a notebook, its cells of Python."""
    if page.suffix == ".ipynb":
        return [text for kind, text in cells(page) if kind == "code" and language == "python"]
    found = _FENCE.findall(page.read_text(encoding="utf-8"))
    return [text for kind, text in found if kind == language]


def links(page: Path) -> list[str]:
    """Targets of all links and pictures, other sites' left out."""
    return [target for target in _LINK.findall(prose(page)) if "://" not in target]


def anchors(page: Path) -> set[str]:
    """What a link can lead to within a page: its headings, as GitHub and MkDocs make them into identifiers."""
    headings = re.findall(r"^#+ +(.+)$", prose(page), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def table_names(page: Path, heading: str) -> list[str]:
    """The names in code type in the first column of the first table under a heading."""
    section = page.read_text(encoding="utf-8").split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    rows = re.search(r"(?:^\|.*\n)+", section, re.M)[0].splitlines()[2:]
    return [re.match(r"\| `(\w+)` \|", row)[1] for row in rows]


def commands(page: Path) -> list[str]:
    """Every command of this program that a page names, in blocks of shell code and in code type."""
    shell = "\n".join(code_blocks(page, "bash")).replace("\\\n", " ")
    inline = re.findall(r"`([^`\n]+)`", prose(page))
    lines = [*shell.splitlines(), *inline]
    pattern = re.compile(r"(?:python -m PolyPoseLib|(?<![\w./-])polypose)\s+([^&|;<>]*)")
    return [match[1].split("#")[0].strip() for line in lines for match in pattern.finditer(line)]
