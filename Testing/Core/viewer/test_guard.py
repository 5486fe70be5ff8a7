"""The guard: without the token nothing is served, over HTTP or the websocket, and not to other sites' pages."""

import asyncio

import pytest

aiohttp = pytest.importorskip("aiohttp")
pytest.importorskip("trame")

from aiohttp import web  # noqa: E402
from aiohttp.test_utils import TestClient, TestServer  # noqa: E402

from PolyPoseLib.viewer.guard import LAUNCHER, TOKEN_FIELD, Guard  # noqa: E402

PATHS = ("/", "/index.html", "/slices/axial/1/after.png", "/no/such/path", LAUNCHER)


def guarded(visit):
    """Run a coroutine function with the guard and a client that follows no redirect and keeps cookies."""

    async def main():
        guard, app = Guard(), web.Application()

        async def page(_request):
            return web.Response(text="the patient")

        async def socket(request):
            response = web.WebSocketResponse()
            await response.prepare(request)
            await response.send_str("the patient")
            await response.close()
            return response

        guard.protect(app)
        app.router.add_get("/ws", socket)
        app.router.add_get("/index.html", page)
        app.router.add_get("/slices/{rest:.*}", page)
        async with TestClient(TestServer(app)) as client:
            return await visit(guard, client)

    return asyncio.run(main())


async def refused(client, path, **arguments):
    answer = await client.get(path, allow_redirects=False, **arguments)
    body = await answer.text()
    return answer.status == 403 and "patient" not in body and not answer.cookies


@pytest.mark.parametrize("given", ["", "?token=", "?token=x", "?token=%ff%fe", "?secret=wslink-secret"])
def test_nothing_is_served_without_the_token(given):
    async def visit(guard, client):
        assert [await refused(client, path + given) for path in PATHS] == [True] * len(PATHS)
        assert (await client.post(LAUNCHER)).status == 403
        with pytest.raises(aiohttp.WSServerHandshakeError) as error:
            await client.ws_connect("/ws" + given)
        assert error.value.status == 403

    guarded(visit)


def test_the_token_opens_everything_and_leaves_the_address():
    async def visit(guard, client):
        answer = await client.get(f"/?{TOKEN_FIELD}={guard.token}", allow_redirects=False)
        assert (answer.status, answer.headers["Location"]) == (302, "/index.html")
        cookie = next(iter(answer.cookies.values()))
        assert cookie["httponly"]
        assert cookie["samesite"] == "Lax"
        for path in ("/index.html", "/slices/x"):
            assert await (await client.get(path)).text() == "the patient"
        launched = await (await client.post(LAUNCHER)).json()
        assert launched["secret"] == guard.token
        assert launched["sessionURL"].startswith("ws://127.0.0.1:")
        async with client.ws_connect("/ws") as socket:
            assert await socket.receive_str() == "the patient"

    guarded(visit)


def test_the_ticket_works_once():
    async def visit(guard, client):
        assert (await client.get(f"/?{TOKEN_FIELD}={guard.ticket}", allow_redirects=False)).status == 302
        client.session.cookie_jar.clear()
        assert await refused(client, f"/?{TOKEN_FIELD}={guard.ticket}")

    guarded(visit)


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1.evil.example"},
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
    ],
)
def test_other_sites_are_refused_even_with_the_token(headers):
    async def visit(guard, client):
        assert await refused(client, f"/?{TOKEN_FIELD}={guard.token}", headers=headers)
        await client.get(f"/?{TOKEN_FIELD}={guard.token}")
        assert await refused(client, "/slices/x", headers=headers)
        with pytest.raises(aiohttp.WSServerHandshakeError):
            await client.ws_connect("/ws", headers=headers)

    guarded(visit)


def test_answers_forbid_the_browser_to_look_elsewhere_or_to_keep_anything():
    async def visit(guard, client):
        await client.get(f"/?{TOKEN_FIELD}={guard.token}")
        for path in ("/index.html", "/slices/x"):
            headers = (await client.get(path)).headers
            assert headers["Cache-Control"] == "no-store"
            assert headers["Referrer-Policy"] == "no-referrer"
            policy = headers["Content-Security-Policy"]
            assert "default-src 'self'" in policy
            assert "http:" not in policy
            assert "*;" not in policy.replace("ws://127.0.0.1:*", "").replace("ws://localhost:*", "")

    guarded(visit)


def test_tokens_differ():
    assert len({Guard().token for _ in range(50)}) == 50
