"""Brings the translation files of the Slicer module up to date, and puts translations into them.

python Testing/Slicer/translations.py [TRANSLATIONS.json] > missing.json

Qt's lupdate does it once `_("text")` has become `translate("context", "text")`, as in Slicer's update_translations.py.
TRANSLATIONS.json holds {language: {text: translation}}. What is missing is printed in the same form, to be filled in.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from pathlib import Path

import PySide6

COMMAND = "python Testing/Slicer/translations.py"
LANGUAGES = ("de", "es", "fr", "ja")
"""As Slicer names its own files, without a region: Slicer_de.ts. One that names a region would hide them."""

MODULE = Path(__file__).resolve().parents[2] / "PolyPose"
FOLDER = MODULE / "Resources" / "Translations"
UI = MODULE / "Resources" / "UI" / "PolyPose.ui"
_OPTIONS = ("-silent", "-no-obsolete", "-locations", "none", "-disable-heuristic", "similartext")


def context_of(path: Path) -> str:
    """The context in which `slicer.i18n.tr` looks for the texts of a Python file, as its getContext makes it."""
    package = f"{path.parent.name}." if (path.parent / "__init__.py").is_file() else ""
    return package + path.stem


def python_texts(module: Path = MODULE) -> Iterator[tuple[Path, str]]:
    """(file, text) of every `_("text")`; texts of `translate` belong to Slicer, which translates them itself."""
    for path in sorted(module.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "_":
                text = node.args[0] if len(node.args) == 1 else None
                if not (isinstance(text, ast.Constant) and isinstance(text.value, str)):
                    raise ValueError(f"{path}:{node.lineno}: _() needs one literal text, or it has no entry")
                yield path, text.value


def path_of(language: str, folder: Path = FOLDER) -> Path:
    """The translation file of a language."""
    return folder / f"PolyPose_{language}.ts"


def entries(path: Path) -> Iterator[tuple[str, str, str, bool]]:
    """(context, text, translation, finished) of every entry of a translation file."""
    for context in ElementTree.parse(path).iter("context"):
        for message in context.iter("message"):
            translation = message.find("translation")
            text, finished = translation.text or "", translation.get("type") is None
            yield context.findtext("name"), message.findtext("source"), text, finished


def tool(name: str, *arguments: str | Path) -> None:
    """Run one of Qt's tools that come with PySide6."""
    program = Path(PySide6.__file__).parent / (name + ".exe" * (sys.platform == "win32"))
    subprocess.run([str(program), *map(str, arguments)], check=True, stdout=sys.stderr)


def update(given: Mapping[str, Mapping[str, str]], folder: Path = FOLDER) -> dict[str, dict[str, str]]:
    """Bring the files up to date, put the given translations in, and return what is missing."""
    with tempfile.TemporaryDirectory() as temporary:
        sources = Path(temporary) / "sources.py"
        with sources.open("w", encoding="utf-8") as file:
            for path, text in python_texts():
                literal = json.dumps(text, ensure_ascii=False)
                file.write(f'translate("{context_of(path)}", {literal})\n')
        missing = {}
        for language in LANGUAGES:
            path = path_of(language, folder)
            languages = ("-source-language", "en", "-target-language", language)
            lupdate = ("lupdate", *_OPTIONS, *languages, sources, UI, "-ts", path)
            tool(*lupdate)
            if _put(path, given.get(language, {})):
                tool(*lupdate)  # writes the file in Qt's own form again
            missing[language] = {text: done for _, text, done, finished in entries(path) if not finished}
    return missing


def _put(path: Path, given: Mapping[str, str]) -> bool:
    """Fill in unfinished entries; whether there were any."""
    tree = ElementTree.parse(path)
    filled = False
    for message in tree.iter("message"):
        translation = message.find("translation")
        text = given.get(message.findtext("source"), "")
        if text and translation.get("type") == "unfinished":
            translation.text, filled = text, True
            del translation.attrib["type"]
    if filled:
        tree.write(path, encoding="utf-8", xml_declaration=True)
    return filled


if __name__ == "__main__":
    read = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")) if len(sys.argv) > 1 else {}
    print(json.dumps(update(read), ensure_ascii=False, indent=1))
