"""SECURITY.md names, for every promise, tests that exist."""

import re

from pages import ROOT

PAGE = (ROOT / "SECURITY.md").read_text(encoding="utf-8")


def test_every_promise_names_tests_that_exist():
    rows = [line for line in PAGE.splitlines() if line.startswith("| ")][1:]
    assert len(rows) > 5
    for row in rows:
        promise, watched = row.strip("| ").split(" | ")
        if set(promise) == {"-"}:
            continue
        names = re.findall(r"`(Testing/[\w/.]+)::(\w+)`", watched)
        assert names, promise
        for file, test in names:
            text = (ROOT / file).read_text(encoding="utf-8")
            assert re.search(rf"^def {test}\(", text, re.M), f"{file}::{test}"


def test_the_workflow_that_the_page_names_exists():
    for path in re.findall(r"`(\.github/[\w/.-]+)`", PAGE):
        assert (ROOT / path).is_file()
