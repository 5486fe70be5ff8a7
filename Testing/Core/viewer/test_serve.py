"""How the address reaches the user: in the browser where there is a screen, through a tunnel elsewhere."""

import sys
import threading

import pytest

pytest.importorskip("aiohttp")
pytest.importorskip("trame")

from PolyPoseLib.viewer import serve
from PolyPoseLib.viewer.guard import Guard


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser was given; the thread that gives them has ended when the list is read."""
    given = []
    monkeypatch.setattr(serve.webbrowser, "open", given.append)

    def read():
        for thread in threading.enumerate():
            if thread.daemon and thread is not threading.current_thread():
                thread.join(2)
        return given

    return read


def test_the_browser_gets_the_ticket_and_not_the_token(monkeypatch, opened, capsys):
    monkeypatch.setattr(serve, "has_screen", lambda: True)
    guard = Guard()
    serve._announce(4000, guard, browser=True)
    assert opened() == [f"http://127.0.0.1:4000/?token={guard.ticket}"]
    out, err = capsys.readouterr()
    assert out == f"http://127.0.0.1:4000/?token={guard.token}\n"
    assert "ssh" not in err
    serve._announce(4000, guard, browser=False)
    assert len(opened()) == 1


def test_without_a_screen_no_browser_is_started(monkeypatch, opened, capsys):
    monkeypatch.setattr(serve, "has_screen", lambda: False)
    serve._announce(4000, Guard(), browser=True)
    assert opened() == []
    assert "ssh -N -L 4000:127.0.0.1:4000 " in capsys.readouterr().err


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about Linux's variables")
@pytest.mark.parametrize(
    ("variables", "screen"),
    [
        ({}, False),
        ({"DISPLAY": ":0"}, True),
        ({"WAYLAND_DISPLAY": "wayland-0"}, True),
        ({"DISPLAY": "localhost:10.0", "SSH_CONNECTION": "10.0.0.9 5000 10.0.0.7 22"}, False),
    ],
)
def test_a_screen_is_told_from_a_server(monkeypatch, variables, screen):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert serve.has_screen() is screen
