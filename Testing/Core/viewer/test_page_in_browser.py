"""The page in a real browser: it loads, controls do what they say, nothing fails and nothing leaves this machine."""

import io
import itertools
import shutil
from urllib.parse import urlsplit

import numpy as np
import pytest
from matplotlib import image
from view_case import write_case
from viewing import viewing

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install playwright")
pytest.importorskip("trame.widgets.vtk", reason="needs trame and trame-vtk")
pytest.importorskip("vtkmodules", reason="needs vtk")

BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))),
    None,
)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs Chromium: apt-get install chromium")

ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
LOAD_MS = 60_000


class Watched:
    """A page of the browser, and what it asked for and complained of."""

    def __init__(self, context):
        self.page = context.new_page()
        self.errors, self.hosts = [], set()
        self.page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self._asked(request.url))
        self.page.on("websocket", lambda socket: self._asked(socket.url))
        self.page.on(
            "response", lambda answer: self.errors.append(answer.url) if answer.status >= 400 else None
        )

    def _asked(self, url):
        if urlsplit(url).scheme not in ("data", "blob"):
            self.hosts.add(urlsplit(url).netloc)

    def settle(self):
        """Wait until every picture that is shown is there."""
        shown = "[...document.images].every(each => each.complete && each.naturalWidth > 0)"
        self.page.wait_for_function(shown, timeout=LOAD_MS)
        self.page.wait_for_timeout(150)

    def looks(self, selector):
        """What a part of the page looks like: pixels (H, W, 3) in [0, 1]."""
        self.settle()
        picture = self.page.locator(selector).first.screenshot()
        return image.imread(io.BytesIO(picture), format="png")[..., :3]

    def drag(self, slider, share):
        """Drag a slider's thumb to a share of its way by the mouse, from where it is."""
        place = self.page.locator(f"#slider-{slider}")
        place.scroll_into_view_if_needed()
        box, most = place.bounding_box(), float(place.get_attribute("max"))
        thumb, y = 8.0, box["y"] + box["height"] / 2

        def x_of(part):
            return box["x"] + thumb + part * (box["width"] - 2 * thumb)

        self.page.mouse.move(x_of(float(place.input_value()) / most), y)
        self.page.mouse.down()
        self.page.mouse.move(x_of(share), y, steps=4)
        self.page.mouse.up()
        assert float(place.input_value()) == pytest.approx(share * most, abs=0.06 * most + 1)


def differs(first, second):
    """Whether more than a few pixels of two pictures differ; sizes may by a pixel, as places on a page are rounded."""
    height, width = np.minimum(first.shape[:2], second.shape[:2])
    assert np.ptp([first.shape, second.shape], axis=0).max() <= 1
    return (
        float((np.abs(first[:height, :width] - second[:height, :width]).max(axis=-1) > 0.04).mean()) > 0.001
    )


def all_differ(pictures):
    return all(differs(*pair) for pair in itertools.combinations(pictures, 2))


@pytest.fixture(scope="module")
def context():
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=BROWSER, args=ARGUMENTS)
        yield browser.new_context(viewport={"width": 1000, "height": 700})
        browser.close()


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return write_case(tmp_path_factory.mktemp("browser") / "case")


@pytest.fixture(scope="module")
def shown(case):
    with viewing(
        case, "--study", case.parent / "study.json", "--points", case.parent / "points.csv"
    ) as running:
        yield running


@pytest.fixture(scope="module")
def watched(context, shown):
    """The loaded page."""
    watched = Watched(context)
    watched.page.goto(shown.address)
    watched.page.wait_for_selector("#axial", timeout=LOAD_MS)
    watched.settle()
    watched.page.wait_for_timeout(1500)  # the scene has its first look
    return watched


@pytest.fixture(autouse=True)
def nothing_fails(watched, shown):
    """Whatever a test does: no error, and no request that leaves this machine."""
    yield
    errors, watched.errors = watched.errors, []
    assert errors == []
    assert watched.hosts == {f"127.0.0.1:{shown.port}"}


def test_the_page_loads_and_the_token_leaves_the_address(watched):
    assert watched.page.title().startswith("PolyPose: 2 X-rays up to ")
    assert urlsplit(watched.page.url).path == "/index.html"
    assert "token" not in watched.page.url
    for words in (
        "Bones and C-arms",
        "Slices before and after",
        "Motion of every structure",
        "Carried points",
    ):
        assert watched.page.get_by_role("heading", name=words).is_visible()


@pytest.mark.parametrize("plane", ["axial", "coronal", "sagittal"])
def test_dragging_a_slices_slider_shows_another_slice(watched, plane):
    caption = watched.page.locator("figure", has=watched.page.locator(f"#{plane}")).locator("figcaption")
    pictures, captions = [watched.looks(f"#{plane}")], [caption.inner_text()]
    for share in (0.75, 0.3):
        watched.drag(plane, share)
        watched.page.wait_for_timeout(400)
        pictures.append(watched.looks(f"#{plane}"))
        captions.append(caption.inner_text())
    assert all_differ(pictures)
    assert len(set(captions)) == 3
    assert all(each.startswith(plane.capitalize()) and each.endswith(" mm") for each in captions)


def test_dragging_the_blend_goes_from_after_to_before(watched):
    pictures = []
    for share in (1.0, 0.5, 0.0):
        watched.drag("blend", share)
        pictures.append(watched.looks("#axial"))
    assert all_differ(pictures)
    watched.drag("blend", 1.0)
    assert not differs(pictures[0], watched.looks("#axial"))


def test_outlines_window_and_maps_change_the_slices(watched):
    page = watched.page
    watched.drag("coronal", 0.5)  # where there are bones
    pictures = [watched.looks("#coronal")]
    for change in (
        lambda: page.uncheck("#check-outlines_after"),
        lambda: page.check("#check-outlines_before"),
        lambda: page.select_option("select >> nth=0", "lung"),
    ):
        change()
        page.wait_for_timeout(300)
        pictures.append(watched.looks("#coronal"))
    for key, words in (("displacement", "mm"), ("jacobian", "Jacobian"), ("weight-1", "motion of femur")):
        page.select_option("select >> nth=1", key)
        page.locator(".map-text", has_text=words).wait_for(timeout=LOAD_MS)
        page.wait_for_selector(".colour-bar")
        pictures.append(watched.looks("#coronal"))
    assert all_differ(pictures)
    page.select_option("select >> nth=1", "")
    page.wait_for_selector(".colour-bar", state="detached")


def canvas(watched):
    """The scene, once it is drawn."""
    watched.page.wait_for_timeout(700)
    return watched.looks(".scene")


def test_the_scene_shows_bones_and_c_arms_from_every_side(watched):
    if not watched.page.evaluate("!!document.createElement('canvas').getContext('webgl2')"):
        pytest.skip("this browser has no WebGL 2, not even in software")
    pictures = {}
    for name in ("overview", "front", "left", "head", "through view 1"):
        watched.page.get_by_role("button", name=name, exact=True).click()
        pictures[name] = canvas(watched)
        bright = float((pictures[name].max(axis=-1) > 0.5).mean())
        assert bright > 0.005, f"{name}: nothing is seen"
    assert all_differ(pictures.values())


def test_dragging_the_motion_moves_the_bones(watched):
    watched.page.get_by_role("button", name="front", exact=True).click()
    watched.page.uncheck("#check-rest_shown")
    after = canvas(watched)
    watched.drag("moved", 0.0)
    before = canvas(watched)
    assert differs(after, before)
    watched.drag("moved", 1.0)
    assert not differs(after, canvas(watched))
    watched.page.uncheck("#check-arms_shown")
    assert differs(after, canvas(watched))
    watched.page.check("#check-arms_shown")


def test_x_rays_blend_and_compare(watched):
    pictures = [watched.looks(".xray:visible")]
    for change in (
        lambda: watched.drag("view_blend", 0.0),
        lambda: watched.drag("view_blend", 1.0),
        lambda: watched.page.check("#check-view_colours"),
        lambda: watched.page.check("#check-view_before"),
        lambda: watched.page.uncheck("#check-view_after"),
        lambda: watched.page.get_by_role("button", name="view 2", exact=True).click(),
    ):
        change()
        watched.page.wait_for_timeout(300)
        pictures.append(watched.looks(".xray:visible"))
    assert all_differ(pictures)


def test_names_are_shown_as_they_are(watched):
    assert watched.page.get_by_role("cell", name="<b>{{ target }}</b>", exact=True).is_visible()
    assert watched.page.locator("td b").count() == 0


def test_a_page_loaded_anew_needs_no_token_but_another_browser_does(watched, shown, context):
    watched.page.reload()
    watched.page.wait_for_selector("#axial", timeout=LOAD_MS)
    watched.settle()
    stranger = context.browser.new_context()
    page = stranger.new_page()
    assert page.goto(f"http://127.0.0.1:{shown.port}/index.html").status == 403
    assert "token" in page.inner_text("body")
    stranger.close()


def test_a_result_alone_says_what_is_missing(context, case):
    with viewing(case) as running:
        alone = Watched(context)
        alone.page.goto(running.address)
        alone.page.wait_for_selector("#axial", timeout=LOAD_MS)
        alone.settle()
        note = alone.page.locator(".note").first.inner_text()
        assert "--study study.json" in note
        assert "the CT" in note
        assert alone.errors == []
        alone.page.close()
