"""What the site needs beyond its pages, which GitHub shows as they are.

- Pictures that lie elsewhere in the repository (Resources/Screenshots, Testing/Benchmarks/results) are taken along.
- Links to other files outside docs/ lead to the repository on GitHub.
- The comment ``<!-- arguments: register -->`` is replaced by a table of that subcommand's arguments.
"""

from __future__ import annotations

import argparse
import posixpath
import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ("Resources/PolyPose.png", "Resources/Screenshots/*.png", "Testing/Benchmarks/results/*.png")

_LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s#]+)((?:#[^)\s]*)?\))")
_ARGUMENTS = re.compile(r"<!-- arguments: (\w+) -->")


def on_files(files: Files, config: Any) -> Files:
    """Add the pictures under their path in the repository."""
    for pattern in PICTURES:
        for picture in sorted(ROOT.glob(pattern)):
            name = picture.relative_to(ROOT).as_posix()
            files.append(File.generated(config, name, abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Page, config: Any, files: Files) -> str:
    """Replace links that leave docs/, and the comments that stand for tables of arguments."""
    folder = posixpath.dirname(page.file.src_uri)
    markdown = _LINK.sub(lambda link: _inside(link, folder, config.repo_url), markdown)
    return _ARGUMENTS.sub(lambda comment: arguments_table(comment[1]), markdown)


def arguments_table(command: str) -> str:
    """A Markdown table of a subcommand's arguments, as its parser has them."""
    rows = ["| argument | meaning |", "| --- | --- |"]
    for action in _subparsers()[command]._actions:
        if isinstance(action, argparse._HelpAction) or action.help == argparse.SUPPRESS:
            continue
        value = action.metavar or (action.dest.upper() if action.nargs != 0 else "")
        if action.choices:
            value = ", ".join(str(choice) for choice in action.choices)
        names = ", ".join(action.option_strings) or str(action.metavar or action.dest)
        shown = f"`{names} {value}`" if action.option_strings and value else f"`{names}`"
        required = " (required)" if action.option_strings and action.required else ""
        meaning = (action.help or "").replace("%%", "%").replace("|", "\\|")
        rows.append(f"| {shown} | {meaning}{required} |")
    return "\n".join(rows)


def _subparsers() -> dict[str, argparse.ArgumentParser]:
    """Every subcommand's parser by its name."""
    sys.path.insert(0, str(ROOT))
    from PolyPoseLib.__main__ import build_parser

    actions = build_parser()._actions
    return next(a.choices for a in actions if isinstance(a, argparse._SubParsersAction))


def _inside(link: re.Match[str], folder: str, repository: str) -> str:
    """A link as the site needs it; those within docs/ and to other sites stay as they are."""
    opening, target, closing = link.groups()
    if "://" in target or target.startswith(("/", "mailto:")):
        return link[0]
    path = posixpath.normpath(posixpath.join("docs", folder, target))
    if path.startswith("docs/") or path.startswith(".."):
        return link[0]
    if any(Path(path).match(pattern) for pattern in PICTURES):
        return opening + posixpath.relpath(path, folder or ".") + closing
    kind = "tree" if (ROOT / path).is_dir() else "blob"
    return f"{opening}{repository}/{kind}/main/{path}{closing}"
