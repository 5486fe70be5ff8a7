"""report.html as a parser sees it: complete, escaped, and without any other file."""

import dataclasses
import re
import shutil
import subprocess
from html.parser import HTMLParser

import pytest
from report_case import seen_result

from PolyPoseLib.io.report import page_of, summary_of

VOID = {"meta", "input", "br", "img"}
SVG_LEAVES = {"image", "use", "line", "polyline", "circle", "fefuncr", "fefuncg", "fefuncb"}


class Page(HTMLParser):
    """Collects the elements with their attributes, and texts; whatever is opened must be closed in order."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.texts, self.open = [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        assert len(attrs) == len(dict(attrs))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        assert tag in SVG_LEAVES, tag
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] not in ("script", "style"):
            self.texts.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]

    def text(self):
        return " ".join(self.texts)


def page(result):
    return Page(page_of(summary_of(result)))


def test_every_picture_has_a_text_and_every_view_its_outlines():
    result = seen_result(views=3)
    read = page(result)
    pictures = [each for each in read.all("svg") if each.get("class") != "store"]
    assert all(each["role"] == "img" and each["aria-label"].strip() for each in pictures)
    assert all(each["alt"].strip() for each in read.all("img")) and len(read.all("img")) == 6
    labels = [each["aria-label"] for each in pictures]
    for n in range(1, 4):
        assert f"view {n}, before: bones as in the CT" in labels
        assert f"view {n}, after: bones as found" in labels
        assert f"femur in view {n}, close up: outlines before and after" in labels
    kinds = [each["class"] for each in read.all("path")]
    assert kinds.count("before") == kinds.count("after") == 6 and kinds.count("anchor") == 6
    assert len(read.all("image")) == 9  # each once, however often it is shown
    stored = {each["id"] for each in read.all("image")}
    assert {each["href"][1:] for each in read.all("use")} == stored
    assert [name for name, _ in read.elements if re.fullmatch("h[1-6]", name)][:2] == ["h1", "h2"]
    assert "through the cameras that were found" in read.text()


def test_the_page_needs_no_other_file_and_allows_none():
    text = page_of(summary_of(seen_result()))
    read = Page(text)
    for name, attributes in read.elements:
        for key in ("src", "href", "data", "action", "srcset"):
            if key in attributes:
                assert re.match(r"data:image/jpeg;base64,|#[a-z]+-\d+$", attributes[key]), (
                    name,
                    attributes[key][:40],
                )
    assert (
        "url(" not in re.sub(r"url\(#xray-\d+-\d+\)", "", text)
        and "@import" not in text
        and "//" not in re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    )
    (policy,) = (each["content"] for each in read.all("meta") if "http-equiv" in each)
    assert "default-src 'none'" in policy and "unsafe-inline'; script-src 'sha256-" in policy
    assert len(text) < 3e6


HOSTILE = "<script>alert(1)</script>\"' onload=alert(2) & \ud800 \x1b \x00 \u2028"


def test_names_and_warnings_are_text_whatever_they_hold():
    result = seen_result()
    femur = dataclasses.replace(result.structures["femur"], doubts=(HOSTILE,))
    result.structures = {"pelvis": result.structures["pelvis"], HOSTILE: femur}
    result.cameras[0] = dataclasses.replace(result.cameras[0], name=HOSTILE)
    result.history[0]["stage"] = HOSTILE
    result.warnings, result.device, result.versions = [HOSTILE], HOSTILE, {"polypose": HOSTILE}
    result.distrust = (HOSTILE,)
    text = page_of(summary_of(result))
    text.encode("utf-8")
    read = Page(text)
    assert len(read.all("script")) == 1 and "<script>alert" not in text
    assert not any(key.startswith("on") for _, attributes in read.elements for key in attributes)
    assert read.text().count("<script>alert(1)</script>") > 8 and "\x00" not in text and "\x1b" not in text
    assert any("<script>" in each.get("aria-label", "") for each in read.all("svg"))


@pytest.mark.parametrize("lacks", ["labels", "xrays", "renderings", "everything"])
def test_the_page_shows_what_is_there(lacks):
    result = seen_result()
    if lacks in ("labels", "everything"):
        result.structure_labels = None
    if lacks in ("xrays", "everything"):
        result.xray_images, result.renderings_before = [], []
    if lacks in ("renderings", "everything"):
        result.renderings_before = []
    if lacks == "everything":
        result.history, result.warnings, result.structures = [], [], {}
    read = page(result)
    assert ("No outlines" in read.text()) == (lacks in ("labels", "everything"))
    assert bool(read.all("img")) == (lacks in ("labels", "renderings"))
    stored = {each["id"] for each in read.all("image")}
    assert stored and {each["href"][1:] for each in read.all("use")} <= stored


def test_a_reason_and_a_minus_zero_do_and_do_not_appear():
    result = seen_result(views=1)
    result.structures["femur"] = dataclasses.replace(
        result.structures["femur"], translation_mm=[-0.01, -0.02, 5]
    )
    result.distrust = ("The similarity did not rise.",)
    read = page(result)
    assert "The similarity did not rise." in read.text() and not re.search(r"-0\.0\b", read.text())
    assert any("bad" in each.get("class", "") for each in read.all("p"))
    assert not any("good" in each.get("class", "") for each in read.all("p"))


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs the browser Chromium")
def test_in_a_browser_the_pages_own_script_runs_and_no_other(tmp_path):
    result = seen_result()
    hostile = '<img src=x onerror="document.title=1"><script>document.title="2"</script>'
    result.structures = {"pelvis": result.structures["pelvis"], hostile: result.structures["femur"]}
    (tmp_path / "report.html").write_text(page_of(summary_of(result)), encoding="utf-8")
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={tmp_path / 'profile'}",
        "--dump-dom",
    ]
    command = ["chromium", *options, "--enable-logging=stderr", (tmp_path / "report.html").as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    read = Page(done.stdout)
    (bar,) = (each for each in read.all("div") if each.get("class") == "controls")
    assert "hidden" not in bar  # the script shows it
    assert read.text().count("<script>document.title") > 2 and "<title>PolyPose report</title>" in done.stdout
    assert "CONSOLE" not in done.stderr, done.stderr
