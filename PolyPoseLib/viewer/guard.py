"""Who may see the page: only a browser that was given the token, and only by the names of this machine itself.

The page shows a patient. It listens on the loopback alone, but other users of the machine reach the loopback too, and
so do pages of other sites in the user's browser. Hence every request, that for the websocket included, must bring the
token: in the address at first, in a cookie from then on.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from hmac import compare_digest
from typing import Any
from urllib.parse import urlsplit

from aiohttp import web

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

TOKEN_FIELD = "token"
"""Of the address."""

LAUNCHER = "/paraview/"
"""Where trame's client asks for the websocket's address and its secret."""

LOCAL_NAMES = ("127.0.0.1", "localhost")
"""Another name for this address is another site's, pointed here to get at the page (DNS rebinding)."""

_PAGE = "/index.html"
_START = ("/", _PAGE)

_REFUSED = "The token is missing: open the whole address that 'polypose view' printed, or run it again.\n"

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; form-action 'none'; "
        "connect-src 'self' ws://127.0.0.1:* ws://localhost:*; frame-ancestors 'none'; object-src 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""Of every answer: the browser itself refuses to fetch anything from elsewhere, and keeps nothing on its disk."""


class Guard:
    """Lets in who has the token.

    Attributes
    ----------
    token
        Of the address that people are shown.
    ticket
        Works once, in place of the token: the command line of a browser that is started is visible to other users.

    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(32)
        self.ticket = secrets.token_urlsafe(32)
        self._ticket_left = True
        self._cookie = f"polypose-{secrets.token_hex(4)}"  # cookies of one machine's ports are shared

    def protect(self, app: web.Application) -> None:
        """Check every request of an application that has not started."""
        app.middlewares.append(self._middleware())
        app.on_response_prepare.append(_add_headers)
        app.router.add_post(LAUNCHER, self._launch)

    def _middleware(self) -> Any:
        @web.middleware
        async def check(request: web.Request, handler: Handler) -> web.StreamResponse:
            if not _is_ours(request):
                return web.Response(status=403, text=_REFUSED)
            if request.path in _START:
                return await self._start(request, handler)
            if not self._has_cookie(request):
                return web.Response(status=403, text=_REFUSED)
            return await handler(request)

        return check

    async def _start(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """The page for the cookie; the cookie, and an address without the token, for the token or the ticket."""
        given = request.query.get(TOKEN_FIELD, "")
        if _equal(given, self.token) or self._is_ticket(given):
            response = web.Response(status=302, headers={"Location": _PAGE})
            # Lax: a link in a notebook or a message may lead here, but no other site's page can load anything.
            response.set_cookie(self._cookie, self.token, httponly=True, samesite="Lax", path="/")
            return response
        if self._has_cookie(request):
            return await handler(request)
        return web.Response(status=403, text=_REFUSED)

    async def _launch(self, request: web.Request) -> web.Response:
        """The websocket has the token as its secret, too, in place of the one that everybody knows."""
        return web.json_response({"sessionURL": f"ws://{request.host}/ws", "secret": self.token})

    def _has_cookie(self, request: web.Request) -> bool:
        return _equal(request.cookies.get(self._cookie, ""), self.token)

    def _is_ticket(self, given: str) -> bool:
        if self._ticket_left and _equal(given, self.ticket):
            self._ticket_left = False
            return True
        return False


async def _add_headers(_request: web.Request, response: web.StreamResponse) -> None:
    for name, value in HEADERS.items():
        response.headers[name] = value


def _is_ours(request: web.Request) -> bool:
    """Whether the request names this machine, and comes from no other site's page."""
    host = urlsplit(f"//{request.host}")
    if host.hostname not in LOCAL_NAMES:
        return False
    origin = request.headers.get("Origin")
    return origin is None or urlsplit(origin).netloc == request.host


def _equal(given: str, wanted: str) -> bool:
    return compare_digest(given.encode("utf-8", "replace"), wanted.encode())
