"""Files of a package index: read as data, taken by their hash, with pip's settings."""

import base64
import hashlib
import io
import json
import tarfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from PolyPoseLib.io.package_index import FetchError, IndexSettings, fetch_file, pip_settings, settings_of

CONTENT = b"an archive"
SHA256 = hashlib.sha256(CONTENT).hexdigest()
NAME = "my_pkg-1.tar.gz"


class Server:
    """Answers from a table of paths: (status, headers, body); keeps what was asked, and with which login."""

    def __init__(self):
        self.table = {}
        self.asked = []
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                server.asked.append((self.path, self.headers.get("Authorization")))
                status, headers, body = server.table.get(self.path, (404, {}, b""))
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                pass

        self.http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.place = f"127.0.0.1:{self.http.server_port}"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def html(self, path, text):
        self.table[path] = (200, {"Content-Type": "text/html"}, text.encode())

    def file(self, path, content=CONTENT):
        self.table[path] = (200, {"Content-Type": "application/octet-stream"}, content)


@pytest.fixture
def server(monkeypatch, tmp_path):
    for name in ("http_proxy", "https_proxy", "all_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    made = Server()
    yield made
    made.http.shutdown()
    made.http.server_close()


def fetch(tmp_path, *indexes, **settings):
    return fetch_file("My.Pkg", NAME, SHA256, tmp_path, IndexSettings(indexes=indexes, **settings))


def test_a_page_in_html_names_the_file_by_its_hash(server, tmp_path):
    server.html("/simple/my-pkg/", f'<a href="../../files/any%20name.gz#sha256={SHA256}">x</a><a>y</a>')
    server.file("/files/any%20name.gz")
    assert fetch(tmp_path, f"http://{server.place}/simple").read_bytes() == CONTENT


def test_a_page_in_json_does_too(server, tmp_path):
    files = [
        {"filename": NAME, "url": "wrong.gz", "hashes": {"sha256": "00"}},
        {"filename": "other", "url": "right.gz", "hashes": {"sha256": SHA256}},
    ]
    kind = {"Content-Type": "application/vnd.pypi.simple.v1+json"}
    server.table["/simple/my-pkg/"] = (200, kind, json.dumps({"files": files}).encode())
    server.file("/simple/my-pkg/right.gz")
    assert fetch(tmp_path, f"http://{server.place}/simple/").read_bytes() == CONTENT


def test_folders_and_later_indexes_are_looked_at_too(server, tmp_path):
    links = tmp_path / "links"
    links.mkdir()
    server.html("/simple/my-pkg/", "nothing")
    (tmp_path / "local" / "my-pkg").mkdir(parents=True)
    (tmp_path / "local" / "my-pkg" / NAME).write_bytes(CONTENT)
    indexes = (
        f"http://{server.place}/absent",
        f"http://{server.place}/simple",
        (tmp_path / "local").as_uri(),
    )
    assert fetch(tmp_path, *indexes, links=(str(links),)).read_bytes() == CONTENT
    assert len(server.asked) == 2
    (links / NAME).write_bytes(CONTENT)
    assert fetch(tmp_path, *indexes, links=(str(links),)).read_bytes() == CONTENT
    assert len(server.asked) == 2


def test_a_login_goes_to_its_host_alone_and_into_no_message(server, tmp_path):
    other = Server()
    server.html("/simple/my-pkg/", f'<a href="/moved#sha256={SHA256}">x</a>')
    server.table["/moved"] = (302, {"Location": f"http://localhost:{other.http.server_port}/file"}, b"")
    other.file("/file")
    index = f"http://me:se%40cret@{server.place}/simple"
    assert fetch(tmp_path, index).read_bytes() == CONTENT
    login = "Basic " + base64.b64encode(b"me:se@cret").decode()
    assert server.asked[0] == ("/simple/my-pkg/", login)
    assert other.asked == [("/file", None)]
    server.table.clear()
    with pytest.raises(FetchError) as caught:
        fetch(tmp_path, index)
    assert str(caught.value) == "127.0.0.1: HTTP status 404"
    other.http.shutdown()
    other.http.server_close()


def test_logins_of_netrc_are_used(server, tmp_path):
    (tmp_path / "netrc").write_text("machine 127.0.0.1 login me password secret\n")
    server.html("/simple/my-pkg/", f'<a href="/file#sha256={SHA256}">x</a>')
    server.file("/file")
    fetch(tmp_path, f"http://{server.place}/simple")
    login = "Basic " + base64.b64encode(b"me:secret").decode()
    assert server.asked == [("/simple/my-pkg/", login), ("/file", login)]


def test_a_page_cannot_name_files_of_this_machine(server, tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(CONTENT)
    server.html("/simple/my-pkg/", f'<a href="{secret.as_uri()}#sha256={SHA256}">x</a>')
    with pytest.raises(FetchError, match="does not have"):
        fetch(tmp_path, f"http://{server.place}/simple")


@pytest.mark.parametrize(
    ("kind", "page"),
    [("html", b"\xff<a href='http://['>"), ("json", b"[1]"), ("json", b"{"), ("json", b'{"files": [1]}')],
)
def test_a_page_that_makes_no_sense_is_one_sentence(server, tmp_path, kind, page):
    kind = "text/html" if kind == "html" else "application/vnd.pypi.simple.v1+json"
    server.table["/simple/my-pkg/"] = (200, {"Content-Type": kind}, page)
    with pytest.raises(FetchError, match=r"^127\.0\.0\.1"):
        fetch(tmp_path, f"http://{server.place}/simple")


def test_a_forged_file_is_removed(server, tmp_path):
    server.html("/simple/my-pkg/", f'<a href="/file#sha256={SHA256}">x</a>')
    server.file("/file", b"forged")
    with pytest.raises(FetchError, match="SHA256"):
        fetch(tmp_path, f"http://{server.place}/simple")
    assert not (tmp_path / NAME).exists()


def test_nothing_of_a_source_archive_is_run(tmp_path):
    """pip download runs setup.py of such an archive."""
    ran = tmp_path / "ran"
    members = {"setup.py": f"open({str(ran)!r}, 'w').close()", "PKG-INFO": "Name: my-pkg\nVersion: 1\n"}
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as opened:
        for name, text in members.items():
            entry = tarfile.TarInfo(f"my_pkg-1/{name}")
            entry.size = len(text)
            opened.addfile(entry, io.BytesIO(text.encode()))
    page = tmp_path / "index" / "my-pkg"
    page.mkdir(parents=True)
    (page / NAME).write_bytes(stream.getvalue())
    digest = hashlib.sha256(stream.getvalue()).hexdigest()
    settings = IndexSettings(indexes=((tmp_path / "index").as_uri(),))
    assert fetch_file("my-pkg", NAME, digest, tmp_path, settings) == tmp_path / NAME
    assert not ran.exists()


def test_pips_settings_are_followed(tmp_path):
    lines = [
        "global.index-url='https://one.example/simple'",
        "global.extra-index-url='\\nhttps://two.example/simple\\nhttps://three.example'",
        "global.trusted-host='one.example two.example'",
        "download.proxy='http://proxy.example:8080'",
        "global.proxy='http://other.example'",
        "install.cert='/not/for/us'",
        "nonsense",
    ]
    found = settings_of(lines, {"PIP_CERT": "/ca.pem", "PIP_INDEX_URL": "https://env.example/simple"})
    assert found.indexes == (
        "https://env.example/simple",
        "https://two.example/simple",
        "https://three.example",
    )
    assert found.trusted_hosts == ("one.example", "two.example")
    assert (found.proxy, found.certificates) == ("http://proxy.example:8080", "/ca.pem")
    assert settings_of(lines, {"PIP_NO_INDEX": "1"}).indexes == ()
    assert settings_of([], {}) == IndexSettings()


def test_pip_is_asked_for_its_settings(tmp_path, monkeypatch):
    (tmp_path / "pip.conf").write_text("[global]\nindex-url = https://file.example/simple\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    monkeypatch.delenv("PIP_INDEX_URL", raising=False)
    assert pip_settings().indexes[0] == "https://file.example/simple"
