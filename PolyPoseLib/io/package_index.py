"""One file of a package index, fetched as data: nothing of the package is built, imported or run.

``pip download`` runs the build script of a source archive to learn its metadata. Here the index's page is read (the
simple API: HTML or JSON), with pip's own settings for indexes, proxy and certificates, and one file is taken from it
by its SHA256.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import errno
import hashlib
import http.client
import importlib
import json
import netrc
import os
import re
import ssl
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag, urljoin, urlsplit, urlunsplit

DEFAULT_INDEX = "https://pypi.org/simple"

_ACCEPT = "application/vnd.pypi.simple.v1+json, application/vnd.pypi.simple.v1+html;q=0.2, text/html;q=0.1, */*;q=0.01"
_ANSWER_SECONDS = 60
_FETCH_SECONDS = 900
_LARGEST_PAGE = 64 << 20
_LARGEST_FILE = 1 << 30
_BLOCK = 1 << 20
_DISK_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
_FAILURES = (OSError, http.client.HTTPException, ValueError)  # URLError and ssl.SSLError are OSErrors


class FetchError(Exception):
    """Why a file could not be fetched, in a few words, without addresses that may hold a password."""


@dataclass(frozen=True)
class IndexSettings:
    """What pip is configured to use: indexes and pages or folders of links, proxy, certificates."""

    indexes: Sequence[str] = (DEFAULT_INDEX,)
    links: Sequence[str] = ()
    proxy: str = ""
    certificates: str = ""
    client_certificate: str = ""
    trusted_hosts: Sequence[str] = ()


@dataclass(frozen=True)
class _Link:
    """A file that a page offers; sha256 is empty where the page does not say."""

    name: str
    url: str
    sha256: str


def pip_settings() -> IndexSettings:
    """Settings of pip's files and PIP_* variables, as pip itself lists them."""
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "config", "list"]
    try:
        listed = subprocess.run(command, capture_output=True, text=True, timeout=_ANSWER_SECONDS, check=False)
        lines = listed.stdout.splitlines() if listed.returncode == 0 else []
    except (OSError, ValueError, subprocess.TimeoutExpired):
        lines = []
    return settings_of(lines, os.environ)


def settings_of(lines: Sequence[str], environment: Mapping[str, str]) -> IndexSettings:
    """Settings from the lines of ``pip config list`` and from the environment, which wins."""
    found: dict[str, str] = {}
    for section in ("global", "download"):
        for line in lines:
            name, _, value = line.partition("=")
            if name.startswith(f"{section}."):
                with contextlib.suppress(ValueError, SyntaxError):
                    found[name.removeprefix(f"{section}.")] = str(ast.literal_eval(value))
    for name, value in environment.items():
        if name.startswith("PIP_"):
            found[name.removeprefix("PIP_").lower().replace("_", "-")] = value
    alone = found.get("no-index", "").lower() in ("1", "true", "yes", "on")
    indexes = [found.get("index-url") or DEFAULT_INDEX, *found.get("extra-index-url", "").split()]
    return IndexSettings(
        indexes=() if alone else tuple(indexes),
        links=tuple(found.get("find-links", "").split()),
        proxy=found.get("proxy", ""),
        certificates=found.get("cert") or environment.get("REQUESTS_CA_BUNDLE", ""),
        client_certificate=found.get("client-cert", ""),
        trusted_hosts=tuple(found.get("trusted-host", "").split()),
    )


def fetch_file(package: str, name: str, sha256: str, folder: Path, settings: IndexSettings) -> Path:
    """Fetch one file of a package.

    Parameters
    ----------
    package, name : str
        The package, and the file's name, used where an index does not say what its files' hashes are.
    sha256 : str
        What the file must be, in hexadecimal.
    folder : Path
        Where the file is written, under ``name``.
    settings : IndexSettings
        Which indexes, and how to reach them.

    Returns
    -------
    Path
        The file, whose SHA256 is the given one.

    Raises
    ------
    FetchError
        No index has it, or none can be reached.
    OSError
        The disk is full.

    """
    reason = "pip is configured to use no index"
    target = folder / name
    for page in _pages(package, settings):
        try:
            for link in _links(page, settings):
                if link.sha256 == sha256 or (not link.sha256 and link.name == name):
                    _copy(link.url, target, settings)
                    if _sha256(target) == sha256:
                        return target
                    reason = f"the SHA256 of {name} is not the expected one"
                    break
            else:
                reason = f"{_place(page)} does not have {name}"
        except _FAILURES as error:
            if getattr(error, "errno", None) in _DISK_FULL:
                raise
            reason = f"{_place(page)}: {_words(error)}"
    target.unlink(missing_ok=True)
    raise FetchError(reason)


def _pages(package: str, settings: IndexSettings) -> Iterator[str]:
    """Addresses of the pages that may offer a package: folders and pages of links first, as they are near."""
    for link in settings.links:
        yield link if re.match(r"[a-z]+://", link) else Path(link).expanduser().absolute().as_uri()
    normalised = re.sub(r"[-_.]+", "-", package).lower()
    for index in settings.indexes:
        yield f"{index.rstrip('/')}/{normalised}/"


def _links(page: str, settings: IndexSettings) -> list[_Link]:
    """The files that a page offers; a folder on this machine offers what is in it."""
    if urlsplit(page).scheme == "file":
        folder = Path(urllib.request.url2pathname(urlsplit(page).path))
        if folder.is_dir() and not (folder / "index.html").is_file():
            return [_Link(path.name, path.as_uri(), "") for path in sorted(folder.iterdir())]
        page = (folder / "index.html").as_uri() if folder.is_dir() else page
    with _open(page, settings) as answer:
        base, kind = answer.geturl(), answer.headers.get_content_type()
        content = answer.read(_LARGEST_PAGE + 1)
    if len(content) > _LARGEST_PAGE:
        raise ValueError("its page is too long")
    text = content.decode("utf-8", errors="replace")
    links = _json_links(text, base) if kind.endswith("+json") else _html_links(text, base)
    local = urlsplit(base).scheme == "file"
    return [link for link in links if local or urlsplit(link.url).scheme in ("http", "https")]


def _json_links(text: str, base: str) -> list[_Link]:
    """Files of a page in JSON."""
    try:
        files = json.loads(text)["files"]
        return [
            _Link(str(each["filename"]), urljoin(base, each["url"]), str(each["hashes"].get("sha256", "")))
            for each in files
        ]
    except (KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("its page is no list of files") from error


def _html_links(text: str, base: str) -> list[_Link]:
    """Files of a page in HTML: the SHA256 stands behind the address."""
    parser = _Anchors()
    parser.feed(text)
    found = []
    for anchor in parser.addresses:
        url, fragment = urldefrag(urljoin(base, anchor))
        name = unquote(urlsplit(url).path).rsplit("/", 1)[-1]
        found.append(
            _Link(name, url, fragment.removeprefix("sha256=") if fragment.startswith("sha256=") else "")
        )
    return found


class _Anchors(HTMLParser):
    """Collects what a page links to."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "a":
            self.addresses += [value for name, value in attrs if name == "href" and value]


def _copy(url: str, target: Path, settings: IndexSettings) -> None:
    """Write what an address holds into a file, within limits of size and time."""
    end = time.monotonic() + _FETCH_SECONDS
    size = 0
    with _open(url, settings) as answer, target.open("wb") as written:
        while block := answer.read(_BLOCK):
            size += len(block)
            if size > _LARGEST_FILE:
                raise ValueError("its file is too large")
            if time.monotonic() > end:
                raise ValueError(f"its file did not arrive within {_FETCH_SECONDS} s")
            written.write(block)


def _open(url: str, settings: IndexSettings) -> Any:
    """Open an address; its own name and password, or those of ~/.netrc, go to its host alone."""
    parts = urlsplit(url)
    plain = urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))
    request = urllib.request.Request(plain, headers={"Accept": _ACCEPT})
    name, password = parts.username, parts.password or ""
    if name is None and parts.scheme in ("http", "https"):
        name, password = _netrc_login(parts.hostname or "")
    if name is not None:
        login = base64.b64encode(f"{unquote(name)}:{unquote(password)}".encode()).decode()
        request.add_unredirected_header("Authorization", f"Basic {login}")
    proxies = {"http": settings.proxy, "https": settings.proxy} if settings.proxy else None
    handlers = [
        urllib.request.ProxyHandler(proxies),
        urllib.request.HTTPSHandler(context=_context(parts, settings)),
    ]
    return urllib.request.build_opener(*handlers).open(request, timeout=_ANSWER_SECONDS)


def _context(parts: Any, settings: IndexSettings) -> ssl.SSLContext:
    """Which certificates to trust: those that pip was given, else the system's, else those that came with pip."""
    context = ssl.create_default_context(cafile=settings.certificates or None)
    if not settings.certificates and not context.cert_store_stats()["x509_ca"]:
        for module in ("certifi", "pip._vendor.certifi"):
            with contextlib.suppress(ImportError, AttributeError, OSError):
                context.load_verify_locations(importlib.import_module(module).where())
                break
    if settings.client_certificate:
        context.load_cert_chain(settings.client_certificate)
    host = parts.netloc.rpartition("@")[2]
    if host in settings.trusted_hosts or parts.hostname in settings.trusted_hosts:
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
    return context


def _netrc_login(host: str) -> tuple[str | None, str]:
    """Name and password that ~/.netrc, or the file that NETRC names, holds for a host."""
    try:
        entry = netrc.netrc(os.environ.get("NETRC") or None).authenticators(host)
    except (OSError, ValueError, netrc.NetrcParseError, RuntimeError):
        entry = None
    return (entry[0], entry[2] or "") if entry else (None, "")


def _sha256(path: Path) -> str:
    """The SHA256 of a file."""
    found = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK):
            found.update(block)
    return found.hexdigest()


def _place(page: str) -> str:
    """A page's host, or its folder: what may be shown of an address."""
    parts = urlsplit(page)
    return parts.hostname or urllib.request.url2pathname(parts.path)


def _words(error: Exception) -> str:
    """An error in a few words."""
    if isinstance(error, urllib.error.HTTPError):
        return f"HTTP status {error.code}"
    reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or error
    return " ".join(str(reason).split())[:200] or type(error).__name__
