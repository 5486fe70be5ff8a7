"""Serve the page on the loopback until it is ended."""

from __future__ import annotations

import asyncio
import errno
import getpass
import os
import socket
import sys
import webbrowser
from threading import Thread
from typing import Any

from PolyPoseLib.errors import InputError
from PolyPoseLib.viewer.content import Content

HOST = "127.0.0.1"
"""The only address that is listened on; there is no option for another."""


def require_packages() -> None:
    """Raise InputError where the packages of the extra `view` are missing."""
    try:
        import aiohttp
        import trame.app
        import trame.widgets.vtk
        import vtkmodules.vtkCommonCore
    except ImportError as error:
        raise InputError(
            f"The page needs packages that are not installed ({error}): pip install 'polypose[view]'."
        ) from error
    del aiohttp, trame, vtkmodules


def serve(content: Content, port: int = 0, browser: bool = True) -> None:
    """Show a page until the process is interrupted.

    Parameters
    ----------
    content : Content
        What it shows.
    port : int
        Of the loopback; 0 takes a free one.
    browser : bool
        Whether to open it in the user's browser, where there is a screen.

    Raises
    ------
    InputError
        Packages are missing, or the port is in use.
    KeyboardInterrupt
        When the user ends it.

    """
    require_packages()
    try:
        asyncio.run(_serve(content, port, browser))
    except OSError as error:
        if error.errno in (errno.EADDRINUSE, errno.EACCES):
            raise InputError(
                f"Port {port} cannot be used ({error.strerror}): give another --port, or none."
            ) from error
        raise


async def _serve(content: Content, port: int, browser: bool) -> None:
    from trame.app import get_server

    from PolyPoseLib.viewer.guard import Guard
    from PolyPoseLib.viewer.maps import Maps
    from PolyPoseLib.viewer.page import Page
    from PolyPoseLib.viewer.routes import Pictures

    # trame reads the command line and variables of its own, by which it could be told to listen elsewhere.
    os.environ["TRAME_ARGS"] = ""
    guard = Guard()
    server: Any = get_server("polypose-view", client_type="vue3")
    server.cli.set_defaults(authKey=guard.token)
    maps = Maps(content)
    pictures = Pictures(content, maps)
    Page(server, content, maps, pictures.after)

    def bind(webserver: Any) -> None:
        guard.protect(webserver.app)
        webserver.app.router.add_routes(pictures.routes())

    server.controller.on_server_bind.add(bind)
    server.controller.on_server_ready.add(lambda **_: _announce(server.port, guard, browser))
    await server.start(
        port=port, host=HOST, exec_mode="coroutine", backend="aiohttp", thread=True, timeout=0, open_browser=False,
        show_connection_info=False, disable_logging=True,
    )  # fmt: skip


def _announce(port: int, guard: Any, browser: bool) -> None:
    """Print the address, open the browser or say how to reach the page from elsewhere."""
    from PolyPoseLib.viewer.guard import TOKEN_FIELD

    start, screen = f"http://{HOST}:{port}/?{TOKEN_FIELD}=", has_screen()
    said = "Whoever on this computer has the address below can see the page. Ctrl+C ends it."
    if not screen:
        said += (
            f"\nNo screen here: run this on your own computer, and open the address there.\n  {tunnel(port)}"
        )
    print(said, file=sys.stderr, flush=True)
    print(f"{start}{guard.token}", flush=True)
    if screen and browser:
        # Some browsers' starters return only when the browser ends.
        Thread(target=webbrowser.open, args=(f"{start}{guard.ticket}",), daemon=True).start()


def has_screen() -> bool:
    """Whether a browser that is started here would be seen by the user."""
    if os.environ.get("SSH_CONNECTION"):
        return False
    if sys.platform.startswith(("win", "darwin")):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def tunnel(port: int) -> str:
    """The command by which the user's computer reaches the page on this one."""
    connection = os.environ.get("SSH_CONNECTION", "").split()
    host = connection[2] if len(connection) == 4 else socket.gethostname()
    try:
        user = getpass.getuser()
    except (OSError, KeyError):  # a user without a name
        user = "USER"
    return f"ssh -N -L {port}:{HOST}:{port} {user}@{host}"
