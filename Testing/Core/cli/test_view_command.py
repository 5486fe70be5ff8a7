"""polypose view: what it serves and to whom, how it ends, and what it says of input that is wrong."""

import asyncio
import importlib
import json
import shutil
import socket
import struct
import sys
import urllib.error
import urllib.request
from http.cookiejar import CookieJar
from pathlib import Path

import pytest
from view_case import write_case
from viewing import viewing

from PolyPoseLib.__main__ import main

aiohttp = pytest.importorskip("aiohttp")
pytest.importorskip("trame.widgets.vtk")
pytest.importorskip("vtkmodules")


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> Path:
    return write_case(tmp_path_factory.mktemp("view") / "case")


@pytest.fixture(scope="module")
def shown(result):
    """The page of the case with its study and points."""
    case = result.parent
    arguments = (result, "--study", case / "study.json", "--points", case / "points.csv")
    with viewing(*arguments, TRAME_ARGS="--host 0.0.0.0", TRAME_DEFAULT_HOST="0.0.0.0") as running:
        yield running


def opener(shown=None):
    """Fetches as a browser does, with the cookie that the address gives."""
    fetch = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
    if shown is not None:
        fetch.open(shown.address, timeout=20).read()
    return fetch


def status_of(fetch, url, data=None):
    try:
        with fetch.open(urllib.request.Request(url, data=data), timeout=60) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


FILES = (
    "",
    "index.html",
    "vue.global.js",
    "slices/axial/3/after.png",
    "xrays/0/xray.png",
    "ws",
    "no-such-file",
)


def test_without_the_token_nothing_is_served(shown):
    base = f"http://127.0.0.1:{shown.port}/"
    stranger = opener()
    for path in FILES:
        status, body = status_of(stranger, base + path)
        assert status == 403, path
        assert b"token" in body
    assert status_of(stranger, base + "paraview/", b"{}")[0] == 403
    known = opener(shown)
    assert status_of(known, base + "vue.global.js")[0] == 200


def test_the_websocket_is_refused_without_the_token_and_with_the_secret_that_everybody_knows(shown):
    url = f"http://127.0.0.1:{shown.port}"

    async def visit():
        async with aiohttp.ClientSession() as stranger:
            with pytest.raises(aiohttp.WSServerHandshakeError) as error:
                await stranger.ws_connect(url + "/ws")
            assert error.value.status == 403
        async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as known:
            await (await known.get(shown.address)).read()
            secret = (await (await known.post(url + "/paraview/")).json())["secret"]
            return [await hello(known, url, each) for each in ("wslink-secret", "", secret)]

    assert asyncio.run(visit()) == [False, False, True]


async def hello(session, url, secret):
    """Whether wslink takes a secret."""
    import msgpack

    async with session.ws_connect(url + "/ws") as websocket:
        message = {
            "wslink": "1.0", "id": "system:c0:0", "method": "wslink.hello", "args": [{"secret": secret}], "kwargs": {},
        }  # fmt: skip
        packed = msgpack.packb(message)
        # A chunk has an identifier, the place of its content in the message, and the message's length.
        await websocket.send_bytes(struct.pack("<III", 7, 0, len(packed)) + packed)
        answer = await websocket.receive(timeout=20)
    return answer.type == aiohttp.WSMsgType.BINARY and b"clientID" in answer.data


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs Linux's list of sockets")
def test_it_listens_on_the_loopback_alone_whatever_the_environment_says(shown):
    listening = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            address, state = line.split()[1], line.split()[3]
            if state == "0A" and int(address.split(":")[1], 16) == shown.port:
                listening.add(address.split(":")[0])
    assert listening == {"0100007F"}


@pytest.mark.parametrize(
    ("path", "begins"),
    [
        ("slices/axial/8/before.png?window=bone", b"\x89PNG"),
        ("slices/coronal/8/after.png?window=lung", b"\x89PNG"),
        ("slices/sagittal/999999/after.png", b"\x89PNG"),
        ("slices/axial/8/map.png?of=displacement", b"\x89PNG"),
        ("slices/axial/8/map.png?of=jacobian", b"\x89PNG"),
        ("slices/axial/8/map.png?of=weight-1", b"\x89PNG"),
        ("slices/axial/8/outlines-before.svg", b"<svg"),
        ("slices/axial/28/outlines-after.svg", b"<svg"),
        ("slices/axial/8/points-after.svg", b"<svg"),
        ("xrays/1/xray.png", b"\x89PNG"),
        ("xrays/1/rendering.png", b"\x89PNG"),
        ("xrays/0/colours.png", b"\x89PNG"),
        ("xrays/0/outlines-after.svg", b"<svg"),
        ("xrays/0/outlines-before.svg", b"<svg"),
        ("xrays/0/points.svg", b"<svg"),
    ],
)
def test_pictures_are_served(shown, path, begins):
    status, body = status_of(opener(shown), f"http://127.0.0.1:{shown.port}/{path}")
    assert (status, body[: len(begins)]) == (200, begins)
    if path.endswith("outlines-after.svg"):
        assert b"<path" in body


@pytest.mark.parametrize(
    "path",
    [
        "slices/oblique/8/after.png", "slices/axial/8/x.png", "slices/axial/8/map.png?of=weight-7", "xrays/9/xray.png",
        "slices/axial/8/map.png", "slices/axial/-1/after.png", "xrays/0/..%2f..%2fetc%2fpasswd", "..%2f..%2fetc/passwd",
        "slices/axial/99999999999/after.png",
    ],
)  # fmt: skip
def test_other_addresses_are_not_found(shown, path):
    status, body = status_of(opener(shown), f"http://127.0.0.1:{shown.port}/{path}")
    assert status in (400, 403, 404)
    assert b"root:" not in body


@pytest.mark.parametrize("study", [True, False])
def test_it_says_how_to_reach_it_and_ends_quietly_on_an_interrupt(result, study):
    more = ("--study", result.parent / "study.json") if study else ()
    with viewing(result, *more, SSH_CONNECTION="10.0.0.9 5000 10.0.0.7 22") as running:
        status, said = running.end()
    assert status == 0
    assert f"ssh -N -L {running.port}:127.0.0.1:{running.port} " in said
    assert "@10.0.0.7" in said
    assert "Traceback" not in said
    assert running.address not in said


def refused(capsys, *arguments):
    """The sentence of a command that ends with exit status 2."""
    capsys.readouterr()
    status = main(["view", *map(str, arguments), "--no-browser"])
    out, err = capsys.readouterr()
    assert (status, out) == (2, ""), err
    lines = [line for line in err.splitlines() if not line.startswith(("INFO", "WARNING"))]
    assert len(lines) == 1, err
    return lines[0]


def test_what_is_missing_or_damaged_is_said_in_one_sentence(result, tmp_path, capsys):
    assert "no-such" in refused(capsys, tmp_path / "no-such")
    copied = tmp_path / "result"
    shutil.copytree(result, copied)
    (copied / "warped_ct.nii.gz").write_bytes(b"no image")
    assert "warped_ct.nii.gz" in refused(capsys, copied)
    (copied / "result.json").write_text("{")
    assert "result.json" in refused(capsys, copied)
    assert "nothing.csv" in refused(capsys, result, "--points", tmp_path / "nothing.csv")
    (tmp_path / "points.csv").write_text("label,x,y,z\na,1,2,north\n")
    assert "line 2" in refused(capsys, result, "--points", tmp_path / "points.csv")
    assert "--port" in refused(capsys, result, "--port", "70000")


def test_the_study_of_another_result_is_refused(result, tmp_path, capsys):
    from small_study import write_small_study

    assert "another study" in refused(capsys, result, "--study", write_small_study(tmp_path / "s"))


def test_a_port_in_use_is_said(result, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert f"Port {port}" in refused(capsys, result, "--port", port)


def test_missing_packages_are_named_with_what_installs_them(result, capsys, monkeypatch):
    import trame

    monkeypatch.setitem(sys.modules, "trame.app", None)
    monkeypatch.delattr(trame, "app", raising=False)
    assert "pip install 'polypose[view]'" in refused(capsys, result)


def test_the_command_line_starts_without_the_pages_packages():
    module = importlib.import_module("PolyPoseLib.cli.view")
    assert not {"trame", "aiohttp", "vtkmodules"} & set(vars(module))


def test_a_study_with_its_xrays_in_another_order_is_refused(tmp_path, capsys):
    result = write_case(tmp_path / "case")
    path = result.parent / "study.json"
    study = json.loads(path.read_text())
    study["xrays"].reverse()
    path.write_text(json.dumps(study))
    assert "in the same order" in refused(capsys, result, "--study", path)
