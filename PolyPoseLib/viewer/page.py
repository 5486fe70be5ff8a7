"""The page itself: sections, sliders and tables, laid out with trame."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
from trame.ui.html import DivLayout
from trame.widgets import client, html, vtk

from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.io.report.words import CAUTION, CELLS_MEAN, INTERVALS, facts, headline, notes
from PolyPoseLib.viewer import scene, tables
from PolyPoseLib.viewer.content import Content
from PolyPoseLib.viewer.maps import Maps
from PolyPoseLib.viewer.pictures import FOLD_COLOUR
from PolyPoseLib.viewer.planes import PLANES, Plane, SliceStack, ends_text, position_text, sides
from PolyPoseLib.viewer.routes import WINDOWS
from PolyPoseLib.viewer.widgets import actor, check, literal, slider, table

STYLE = Path(__file__).with_name("page.css")
_BONE = {"ambient": 0.15, "diffuse": 0.85, "specular": 0.1}


class Page:
    """Builds the page of one result on a trame server and answers what people do on it.

    Parameters
    ----------
    server
        Not started.
    content
        What is shown.
    maps
        Of the transform.
    stack
        Gives the slices' number and size.

    """

    def __init__(self, server: Any, content: Content, maps: Maps, stack: SliceStack) -> None:
        self._server, self._content, self._maps, self._stack = server, content, maps, stack
        self._state = server.state
        self._looks = {"overview": scene.overview(content), **scene.looks(content)}
        self._set_state()
        self._tasks: set[asyncio.Task[None]] = set()
        self._state.change("moved")(self._move)
        self._state.change("map_key")(self._choose_map)
        for plane in PLANES:
            self._state.change(plane)(self._place)
        self._build()

    def _set_state(self) -> None:
        state, content = self._state, self._content
        state.trame__title = f"PolyPose: {facts(content.result)}"
        state.update({plane: self._stack.count(plane) // 2 for plane in PLANES})
        state.update(
            {
                "blend": 100, "outlines_after": True, "outlines_before": False, "window": "bone", "map_key": "",
                "map_opacity": 55, "map_shown": "", "map_text": "", "map_css": "", "map_ticks": ["", "", ""],
                "view": 0, "view_blend": 50, "view_colours": False, "view_after": True, "view_before": False,
                "moved": 100, "rest_shown": content.at_rest_known, "arms_shown": True,
                "opacity": 100 if content.points is None else 45,  # points lie inside bones
                "points_shown": content.points is not None, "map_folds": False,
            }
        )  # fmt: skip
        for n, bone in enumerate(content.bones):
            state[f"bone_{n}"] = scene.bone_mesh(bone)
        for n, view in enumerate(content.views):
            depth = scene.detector_depth(view, content)
            state[f"detector_{n}"] = scene.detector_mesh(view, depth, len(content.views))
            state[f"beam_{n}"] = scene.beam_mesh(view, depth)
            state[f"source_{n}"] = scene.source_mesh(view)
        low, high = scene.bounds_of(content.bones)
        state.letters = scene.letters_mesh(low, high)
        if content.points is not None:
            carried = content.points.carried
            state.points_ct = scene.points_mesh(content.points.in_ct, 1.5)
            state.points_xray = scene.points_mesh(carried.points, 1.5)
            state.ellipsoids = scene.ellipsoids_mesh(carried.points, carried.covariances)
        self._move()
        self._place()

    def _move(self, **_state: Any) -> None:
        """Bones between the CT's posture and that of the X-rays."""
        share = float(self._state.moved) / 100
        self._state.poses = [scene.pose_between(bone, share) for bone in self._content.bones]

    def _place(self, **_state: Any) -> None:
        """Where the slices lie, in words."""
        for plane in PLANES:
            frame = self._stack.frame(plane, int(self._state[plane]))
            self._state[f"{plane}_text"] = position_text(plane, frame.position)

    def _choose_map(self, map_key: str, **_state: Any) -> None:
        """Compute and describe the map that was chosen, without holding up the page."""
        self._state.map_shown = ""  # until it is there
        self._state.map_text = "computing ..." if map_key in self._maps else ""
        if map_key in self._maps:
            task = asyncio.get_running_loop().create_task(self._describe(map_key))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _describe(self, key: str) -> None:
        state = self._state
        try:
            chosen = await asyncio.to_thread(self._maps.__getitem__, key)
        except PolyPoseError as error:
            with state:
                state.map_text = str(error)
            return
        if state.map_key != key:
            return
        with state:
            state.map_text, state.map_ticks = f"{chosen.title}; as X-rayed", list(chosen.ticks)
            state.map_folds, state.map_css, state.map_shown = chosen.folds, chosen.scale.css(), key

    def _look_from(self, name: str) -> None:
        if name in self._looks:
            self._server.js_call("scene", "setCamera", self._looks[name])

    async def _first_look(self) -> None:
        """The view chooses a camera of its own as it appears, and once more a little later."""
        await asyncio.sleep(0.6)
        self._look_from("overview")

    def _build(self) -> None:
        with DivLayout(self._server) as layout:
            client.Style(STYLE.read_text(encoding="utf-8"))
            self._header()
            with html.Div(classes="columns"):
                with html.Section(classes="panel"):
                    self._scene()
                with html.Section(classes="panel"):
                    self._xrays()
            with html.Section(classes="panel"):
                self._slices()
            with html.Section(classes="panel"):
                self._motions()
            if self._content.points is not None:
                with html.Section(classes="panel"):
                    self._points()
            self._footer()
            client.ClientTriggers(mounted=self._first_look)
        self.layout = layout

    def _header(self) -> None:
        content = self._content
        verdict = headline(content.result)
        with html.Header():
            html.H1("PolyPose")
            html.P(literal(verdict.text), classes=f"verdict {verdict.tone}")
        html.P(literal(facts(content.result)), classes="hint")
        for note in content.notes:
            html.P(literal(note), classes="note")

    def _scene(self) -> None:
        content = self._content
        html.H2("Bones and C-arms")
        with html.Div(classes="bar"):
            for name in self._looks:
                label = name if not name.startswith("xray-") else f"through {self._view_name(int(name[5:]))}"
                html.Button(literal(label), click=(self._look_from, f"['{name}']"))
        with html.Div(classes="scene"):
            html.P("This part needs WebGL 2, which this browser does not give.", classes="behind")
            with vtk.VtkView(ref="scene", background=("[0.09, 0.11, 0.14]",)):
                self._actors()
        with html.Div(classes="bar"):
            if content.at_rest_known:
                slider("moved", 100, "CT's posture", "as X-rayed", "motion")
                check("rest_shown", "bones at rest, translucent")
            slider("opacity", 100, "clear", "solid", "opacity")
            check("arms_shown", "C-arms")
            if content.points is not None:
                check("points_shown", "points: orange in the CT, white as X-rayed")
        html.P(
            "Letters name the patient's right, left, front (A), back (P), head (S) and feet (I). Drag to turn, Alt and "
            "drag to shift, wheel to zoom.",
            classes="hint",
        )

    def _actors(self) -> None:
        content = self._content
        for n, bone in enumerate(content.bones):
            red, green, blue = _parts(bone.colour)
            colour = f"[{red}, {green}, {blue}]"
            shine = ", ".join(f"{name}: {value}" for name, value in _BONE.items())
            actor(
                f"bone_{n}",
                f"{{ color: {colour}, opacity: Math.max(0.05, opacity / 100), {shine} }}",
                f"{{ userMatrix: poses[{n}] }}",
            )
            if content.at_rest_known:
                actor(
                    f"bone_{n}", "{ color: [0.75, 0.8, 0.85], opacity: 0.22 }", "{ visibility: rest_shown }"
                )
        for n in range(len(content.views)):
            seen = "{ visibility: arms_shown }"
            actor(f"detector_{n}", "{ lighting: false }", seen)
            actor(f"beam_{n}", "{ color: [0.95, 0.8, 0.3], lighting: false, opacity: 0.8 }", seen)
            actor(f"source_{n}", "{ color: [0.95, 0.8, 0.3] }", seen)
        actor("letters", "{ color: [0.62, 0.7, 0.78], lighting: false }", "{}")
        if content.points is not None:
            seen = "{ visibility: points_shown }"
            actor("points_ct", "{ color: [1, 0.6, 0.2] }", seen)
            actor("points_xray", "{ color: [1, 1, 1] }", seen)
            actor("ellipsoids", "{ color: [1, 1, 1], opacity: 0.35 }", seen)

    def _view_name(self, number: int) -> str:
        return self._content.views[number].camera.name or f"X-ray {number + 1}"

    def _xrays(self) -> None:
        content = self._content
        known = any(view.xray is not None for view in content.views)
        html.H2("X-rays and the CT rendered as found")
        with html.Div(classes="bar"):
            for n in range(len(content.views)):
                html.Button(
                    literal(self._view_name(n)),
                    click=f"view = {n}",
                    classes=(f"view === {n} ? 'chosen' : ''",),
                )
        for n, view in enumerate(content.views):
            camera, base = view.camera, f"xrays/{n}"
            ratio = f"aspect-ratio: {camera.width} / {camera.height}"
            with html.Div(v_if=f"view === {n}"):
                with html.Div(classes="stack xray", style=ratio):
                    if view.xray is not None:
                        html.Img(src=f"{base}/xray.png", alt="X-ray")
                    shown = "{ opacity: view_blend / 100 }" if view.xray is not None else "{}"
                    html.Img(
                        src=f"{base}/rendering.png", alt="CT rendered", style=(shown,), classes="rendering"
                    )
                    if view.xray is not None:
                        html.Img(v_if="view_colours", src=f"{base}/colours.png", alt="both in colours")
                    html.Img(v_if="view_before", src=f"{base}/outlines-before.svg", alt="")
                    html.Img(v_if="view_after", src=f"{base}/outlines-after.svg", alt="")
                    if content.points is not None:
                        html.Img(v_if="points_shown", src=f"{base}/points.svg", alt="")
                html.P(literal(f"similarity {camera.similarity:.3f} (1 is perfect)"), classes="hint")
        with html.Div(v_if=str(known or content.at_rest_known).lower(), classes="bar"):
            if known:
                slider("view_blend", 100, "X-ray", "rendering", "X-ray or rendering")
                check(
                    "view_colours",
                    "in colours: X-ray magenta, rendering green, both gray, black where not compared",
                )
            if content.at_rest_known:
                check("view_after", "bones as found")
                check("view_before", "bones as in the CT (dashed)")
        html.P("Seen from the source; bone is bright.", classes="hint")

    def _slices(self) -> None:
        content = self._content
        html.H2("Slices before and after")
        with html.Div(classes="bar"):
            slider("blend", 100, "before: CT at rest", "after: as X-rayed", "before or after")
            with html.Label("window"), html.Select(v_model="window"):
                for name in WINDOWS:
                    html.Option(name, value=name)
            check("outlines_after", "bones as X-rayed" if content.at_rest_known else "labels as X-rayed")
            if content.at_rest_known:
                check("outlines_before", "bones at rest (dashed)")
        html.P(literal(f"Before: {content.before_text}."), classes="hint")
        with html.Div(classes="bar"):
            with html.Label("map of the transform"), html.Select(v_model="map_key"):
                for key, name in self._maps.choices:
                    html.Option(literal(name), value=key)
            with html.Template(v_if="map_shown"):
                slider("map_opacity", 100, "faint", "strong", "opacity of the map")
        self._colour_bar()
        with html.Div(classes="planes"):
            for plane in PLANES:
                self._plane(plane)
        html.P(
            "Radiological convention: in axial and coronal slices the patient's right is on the left of the picture. "
            "Coordinates are LPS: x grows to the patient's left, y to the back, z to the head.",
            classes="hint",
        )

    def _colour_bar(self) -> None:
        html.P("{{ map_text }}", v_if="map_text", classes="map-text")
        with html.Div(v_if="map_shown", classes="colours"):
            html.Div(classes="colour-bar", style=("{ background: map_css }",))
            with html.Div(classes="ticks"):
                for n in range(3):
                    html.Span(f"{{{{ map_ticks[{n}] }}}}")
            html.Span("folded", v_if="map_folds", classes="folds", style=f"color: {FOLD_COLOUR}")

    def _plane(self, plane: Plane) -> None:
        content, frame = self._content, self._stack.frame(plane, 0)
        base = f"`slices/{plane}/${{{plane}}}/"
        with html.Figure(classes="plane"):
            html.Figcaption(f"{plane.capitalize()}, {{{{ {plane}_text }}}}")
            with html.Div(
                classes="stack", style=f"aspect-ratio: {frame.width:.2f} / {frame.height:.2f}", id=plane
            ):
                html.Img(src=(base + "before.png?window=${window}`",), alt=f"{plane} slice before")
                html.Img(
                    src=(base + "after.png?window=${window}`",),
                    alt=f"{plane} slice after",
                    style=("{ opacity: blend / 100 }",),
                )
                html.Img(
                    v_if="map_shown",
                    src=(base + "map.png?of=${map_shown}`",),
                    alt="",
                    style=("{ opacity: map_opacity / 100 }",),
                )
                if content.at_rest_known:
                    html.Img(v_if="outlines_before", src=(base + "outlines-before.svg`",), alt="")
                html.Img(v_if="outlines_after", src=(base + "outlines-after.svg`",), alt="")
                if content.points is not None:
                    html.Img(v_if="points_shown && blend < 50", src=(base + "points-before.svg`",), alt="")
                    html.Img(v_if="points_shown && blend >= 50", src=(base + "points-after.svg`",), alt="")
                for letter, side in zip(sides(plane), ("left", "right", "top", "bottom"), strict=True):
                    html.Span(letter, classes=f"side {side}")
            slider(plane, self._stack.count(plane) - 1, *ends_text(plane), f"{plane} slice")

    def _motions(self) -> None:
        html.H2("Motion of every structure from the CT to the X-rays")
        colours = [bone.colour for bone in self._content.bones] if self._content.at_rest_known else []
        table(tables.MOTION_HEADER, tables.motion_rows(self._content.result), colours)
        html.P(literal(f"{INTERVALS} {CELLS_MEAN}"), classes="hint")

    def _points(self) -> None:
        assert self._content.points is not None
        html.H2("Carried points")
        table(tables.POINT_HEADER, tables.point_rows(self._content.points), [])
        html.P("LPS mm. Half axes are those of the 95 % ellipsoid, the longest first.", classes="hint")

    def _footer(self) -> None:
        said = notes(self._content.result)
        if said:
            with html.Section(classes="panel"):
                html.H2("Reasons and warnings of the registration")
                with html.Ul():
                    for text, tone in said:
                        html.Li(literal(text), classes="bad" if tone == "bad" else "")
        html.P(CAUTION, classes="hint")


def _parts(colour: str) -> list[float]:
    """Red, green and blue of "#rrggbb", 0 to 1."""
    return np.round([int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)], 3).tolist()
