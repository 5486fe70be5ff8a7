"""The pictures of the page, each at an address of its own; the browser asks for those that it shows."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from aiohttp import web

from PolyPoseLib.data.volume import AIR_HU
from PolyPoseLib.errors import PolyPoseError
from PolyPoseLib.viewer import drawings, xray_pictures
from PolyPoseLib.viewer.content import Content
from PolyPoseLib.viewer.maps import Maps
from PolyPoseLib.viewer.pictures import png, windowed
from PolyPoseLib.viewer.planes import PLANES, Frame, Plane, SliceStack

WINDOWS = {"bone": (-300.0, 1200.0), "soft tissue": (-160.0, 240.0), "lung": (-1350.0, 150.0)}
"""HU from black to white."""

Answer = tuple[bytes, str]
"""A picture and its media type."""


class Pictures:
    """Makes the pictures of one result.

    Attributes
    ----------
    before, after
        The CT at rest, and warped to the patient as X-rayed.

    """

    def __init__(self, content: Content, maps: Maps) -> None:
        self._content, self._maps = content, maps
        self.before = SliceStack.from_volume(content.before, AIR_HU)
        self.after = SliceStack.from_volume(content.result.warped_ct, AIR_HU)

    def routes(self) -> list[web.RouteDef]:
        """Addresses and what answers them."""
        return [
            web.get("/slices/{plane}/{index:[0-9]{1,6}}/{layer}", self._answer(self._slice)),
            web.get("/xrays/{number:[0-9]{1,6}}/{layer}", self._answer(self._view)),
        ]

    def _answer(
        self, make: Callable[[web.Request], Answer | None]
    ) -> Callable[[web.Request], Awaitable[web.Response]]:
        async def respond(request: web.Request) -> web.Response:
            try:
                made = await asyncio.to_thread(make, request)  # a map takes seconds the first time
            except PolyPoseError as error:
                return web.Response(status=409, text=str(error))
            if made is None:
                return web.Response(status=404, text="There is no such picture.\n")
            body, kind = made
            return web.Response(body=body, content_type=kind)

        return respond

    def _slice(self, request: web.Request) -> Answer | None:
        plane, layer = request.match_info["plane"], request.match_info["layer"]
        known: Plane | None = next((each for each in PLANES if each == plane), None)
        return None if known is None else self._layer(known, int(request.match_info["index"]), layer, request)

    def _layer(self, plane: Plane, index: int, layer: str, request: web.Request) -> Answer | None:
        content, frame = self._content, self.after.frame(plane, index)
        if layer in ("before.png", "after.png"):
            stack = self.before if layer == "before.png" else self.after
            low, high = WINDOWS.get(request.query.get("window", ""), WINDOWS["bone"])
            return png(windowed(stack.picture(frame), low, high)), "image/png"
        if layer == "map.png" and request.query.get("of", "") in self._maps:
            return self._map(frame, request.query["of"])
        if layer in ("outlines-before.svg", "outlines-after.svg"):
            return _svg(drawings.slice_outlines(content.bones, frame, layer == "outlines-after.svg"))
        if layer in ("points-before.svg", "points-after.svg") and content.points is not None:
            return _svg(drawings.slice_points(content.points, frame, layer == "points-after.svg"))
        return None

    def _map(self, frame: Frame, key: str) -> Answer:
        return png(self._maps[key].picture(self.after.points(frame))), "image/png"

    def _view(self, request: web.Request) -> Answer | None:
        number, layer = int(request.match_info["number"]), request.match_info["layer"]
        if number >= len(self._content.views):
            return None
        view, bones = self._content.views[number], self._content.bones
        if layer == "xray.png" and view.xray is not None:
            return png(xray_pictures.gray(view.xray, view.mask)), "image/png"
        if layer == "rendering.png":
            return png(xray_pictures.gray(view.rendering)), "image/png"
        if layer == "colours.png" and view.xray is not None:
            return png(xray_pictures.compared(view.xray, view.rendering, view.mask)), "image/png"
        if layer == "outlines-after.svg":
            return _svg(drawings.view_outlines(view.outlines, bones, view.camera.camera, dashed=False))
        if layer == "outlines-before.svg":
            return _svg(drawings.view_outlines(view.outlines_before, bones, view.camera.camera, dashed=True))
        if layer == "points.svg" and self._content.points is not None:
            return _svg(drawings.view_points(self._content.points, view.camera.camera))
        return None


def _svg(text: str) -> Answer:
    return text.encode("utf-8", "replace"), "image/svg+xml"
