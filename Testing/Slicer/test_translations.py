"""The translation files: complete, in the contexts that the application asks for, and read by Qt."""

from __future__ import annotations

import json
import random
import re
import shutil
import string
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

import scenes
from panel_case import PanelCase, emit, module
from slicer_case import INSIDE_SLICER, SlicerTestCase

# isort: split
import qt
import slicer.i18n
from PolyPoseSlicer.panel.steps import SECTIONS

if not INSIDE_SLICER:
    import translations
    from PySide6 import QtCore

COMPLETE = ("de", "fr")
WIDEST = 450
"""Pixels that the panel may take of a screen, as in English."""

_KEPT = re.compile(r"\[[^\]]*\]|\(\*[^)]*\)|&[A-Za-z]|<[^>]*>|Ctrl\+[\w+]+|\n")
"""Units of columns, patterns of files, mnemonics, tags, shortcuts and line breaks."""

_NAMES = ("SlicerParameterName", "settingKey", "nodeTypes")
"""Properties of the .ui file that hold names and not words."""


def ui_texts() -> list[str]:
    """What QUiLoader translates, in the context of the file's class."""
    texts = []
    for element in ElementTree.parse(translations.UI).iter():
        if element.tag in ("property", "attribute") and element.get("name") not in _NAMES:
            texts += [
                each.text for each in element.iter("string") if each.get("notr") != "true" and each.text
            ]
    return texts


def expected() -> set[tuple[str, str]]:
    """(context, text) of everything that has to be translated."""
    context = ElementTree.parse(translations.UI).findtext("class")
    texts = {(translations.context_of(path), text) for path, text in translations.python_texts()}
    return texts | {(context, text) for text in ui_texts()}


def placeholders(text: str) -> Counter:
    """The fields of a text for str.format."""
    return Counter(
        (name, form, how) for _, name, form, how in string.Formatter().parse(text) if name is not None
    )


def translate_in(path: Path, text: str) -> str:
    """What `_(text)` gives in a file of the module: the context comes from the file of the caller."""
    code = compile(f"_({text!r})", str(path), "eval")
    return eval(code, {"_": slicer.i18n.tr})


class _Translated:
    """Compiles a language's file by lrelease, and installs it as the application does."""

    def __init__(self, language: str) -> None:
        self._language = language

    def __enter__(self) -> None:
        self._folder, self._translator = tempfile.TemporaryDirectory(), QtCore.QTranslator()
        compiled = Path(self._folder.name) / f"PolyPose_{self._language}.qm"
        translations.tool("lrelease", "-silent", translations.path_of(self._language), "-qm", compiled)
        if not self._translator.load(str(compiled)):
            raise AssertionError(f"Qt cannot load {compiled.name}")
        QtCore.QCoreApplication.installTranslator(self._translator)

    def __exit__(self, *_: object) -> None:
        QtCore.QCoreApplication.removeTranslator(self._translator)
        self._translator = None  # closes the file
        self._folder.cleanup()


@unittest.skipIf(INSIDE_SLICER, "the application brings no tools of Qt")
class TranslationsTest(SlicerTestCase):
    def test_every_text_has_an_entry_in_every_language(self) -> None:
        wanted = expected()
        self.assertGreater(len(wanted), 300)
        for language in translations.LANGUAGES:
            found = {entry[:2] for entry in translations.entries(translations.path_of(language))}
            name, advice = translations.path_of(language).name, f"run {translations.COMMAND}"
            self.assertEqual(sorted(wanted - found), [], f"not in {name}: {advice}")
            self.assertEqual(sorted(found - wanted), [], f"in {name}, but not in the module: {advice}")

    def test_german_and_french_are_complete(self) -> None:
        for language in COMPLETE:
            missing = [
                text for _, text, _, done in translations.entries(translations.path_of(language)) if not done
            ]
            advice = (
                f"{translations.COMMAND} prints what is missing; docs/developers.md says how to put it in"
            )
            self.assertEqual(missing, [], f"{language}: {advice}")

    def test_translations_keep_what_programs_read(self) -> None:
        for language in translations.LANGUAGES:
            for context, text, translation, _ in translations.entries(translations.path_of(language)):
                if not translation:
                    continue
                where = f"{language}, {context}: {text}"
                self.assertEqual(placeholders(translation), placeholders(text), where)
                self.assertEqual(Counter(_KEPT.findall(translation)), Counter(_KEPT.findall(text)), where)
                self.assertEqual(translation[:1].isspace(), text[:1].isspace(), where)
                self.assertEqual(translation.endswith("..."), text.endswith("..."), where)

    def test_names_of_parameters_settings_and_classes_are_not_translatable(self) -> None:
        for element in ElementTree.parse(translations.UI).iter("property"):
            if element.get("name") in _NAMES:
                for value in (*element.findall("string"), *element.findall("stringlist")):
                    self.assertEqual(value.get("notr"), "true", ElementTree.tostring(element, "unicode"))

    def test_slicer_loads_its_own_files_beside_ours(self) -> None:
        """For de_DE it takes all *_de.qm only when there is no *_de_DE.qm, which would leave Slicer in English."""
        files = list(translations.FOLDER.glob("*.ts"))
        self.assertEqual(
            {path.name for path in files}, {f"PolyPose_{each}.ts" for each in translations.LANGUAGES}
        )
        for path in files:
            # The module Language Tools renames a file by the language that stands in it.
            language = ElementTree.parse(path).getroot().get("language")
            self.assertEqual(path.name, f"PolyPose_{language}.ts")
            self.assertRegex(str(language), "^[a-z]{2}$")

    def test_qt_finds_texts_in_the_context_of_the_file_that_asks(self) -> None:
        texts = sorted(set(translations.python_texts()))
        for language in translations.LANGUAGES:
            entries = translations.entries(translations.path_of(language))
            known = {entry[:2]: entry[2] for entry in entries if entry[3]}
            with _Translated(language):
                for path, text in random.Random(0).sample(texts, 100):
                    wanted = known.get((translations.context_of(path), text), text)
                    self.assertEqual(translate_in(path, text), wanted, path)
        self.assertEqual(translate_in(*texts[0]), texts[0][1])

    def test_every_file_of_the_module_asks_in_a_context_of_its_own(self) -> None:
        paths = {path for path, _ in translations.python_texts()}
        contexts = Counter(map(translations.context_of, paths))
        self.assertEqual([each for each, count in contexts.items() if count > 1], [])

    def test_new_texts_are_printed_and_taken_back(self) -> None:
        for language in translations.LANGUAGES:
            shutil.copy(translations.path_of(language), self.folder)
        german = translations.path_of("de", self.folder)
        text = german.read_text(encoding="utf-8")
        source = "<source>1. CT and bones</source>"
        self.assertIn(source, text)
        german.write_text(text.replace(source, "<source>1. Anything else</source>"), encoding="utf-8")
        missing = translations.update({}, self.folder)
        self.assertEqual(missing["de"], {"1. CT and bones": ""})
        self.assertNotIn("Anything else", german.read_text(encoding="utf-8"))
        given = json.loads(json.dumps({"de": {"1. CT and bones": "1. CT & Knochen"}}))
        self.assertEqual(translations.update(given, self.folder)["de"], {})
        self.assertIn("1. CT &amp; Knochen</translation>", german.read_text(encoding="utf-8"))
        self.assertEqual(translations.update({}, self.folder)["de"], {})


@unittest.skipIf(INSIDE_SLICER, "the application brings no tools of Qt")
class GermanPanelTest(PanelCase):
    language = "de"

    def setUp(self) -> None:
        entries = translations.entries(translations.path_of(self.language))
        self.words = {text: translation for _, text, translation, _ in entries if translation}
        module()  # its description stays English for other tests
        translated = _Translated(self.language)
        translated.__enter__()
        self.addCleanup(translated.__exit__)
        super().setUp()

    def assert_no_english(self) -> None:
        """Nothing that is shown is a text that has another wording in the language."""
        english = {text for text, translation in self.words.items() if translation != text}
        seen = set()
        for widget in self.ui.PolyPose.findChildren(qt.QWidget):
            for name in ("text", "toolTip", "title", "placeholderText", "suffix", "specialValueText"):
                if isinstance(getattr(widget, name, None), str):
                    seen.add(getattr(widget, name))
        self.assertGreater(len(seen & set(self.words.values())), 100)
        self.assertEqual(sorted(seen & english), [])

    def test_the_panel_is_translated_from_the_form_to_the_result_and_stays_narrow(self) -> None:
        self.assertEqual(self.ui.presetSelector.currentText, self.words["Default"])
        self.assert_no_english()
        self.fill()
        self.assertIs(self.panel.parameters.ct, self.ct)
        self.panel.review.load_result(str(scenes.save_result(self.folder / "given")))
        self.assert_no_english()
        headings = [self.ui.motionsTable.horizontalHeaderItem(column).text() for column in range(2)]
        self.assertEqual(headings, [self.words["Structure"], self.words["Rotation [deg]"]])
        form = self.ui.stepsArea.parentWidget()
        for name in SECTIONS:
            getattr(self.ui, name).collapsed = False
            emit(self.ui.stepsArea.verticalScrollBar().valueChanged, 0)
            slicer.app.processEvents()
            advice = f"shorten the translation of a button or label of {name}"
            self.assertLessEqual(form.minimumSizeHint.width(), WIDEST, advice)


class SpanishPanelTest(GermanPanelTest):
    LONG = True
    language = "es"


class FrenchPanelTest(GermanPanelTest):
    language = "fr"


class JapanesePanelTest(GermanPanelTest):
    LONG = True
    language = "ja"


if __name__ == "__main__":
    unittest.main()
