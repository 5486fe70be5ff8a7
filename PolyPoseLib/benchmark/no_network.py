"""A process that reaches no other machine: systems bring packages that would fetch weights by themselves."""

from __future__ import annotations

import ipaddress
import sys
from typing import Any

from PolyPoseLib.errors import InputError

_HERE = ("", "localhost")


def refuse_network() -> None:
    """Let every attempt to reach another machine raise InputError, for as long as this process lives.

    Python's own sockets and name look-ups are watched, and so whatever is built on them; other programs that a system
    starts, and sockets of native code, are not.
    """
    sys.addaudithook(_refuse)


def _refuse(event: str, arguments: tuple[Any, ...]) -> None:
    if event in ("socket.getaddrinfo", "socket.gethostbyname"):
        host = arguments[0]
    elif event in ("socket.connect", "socket.sendto"):
        address = arguments[1]
        host = address[0] if isinstance(address, tuple) else ""  # a socket of this machine has a path
    else:
        return
    if isinstance(host, bytes):
        host = host.decode("ascii", "replace")
    if host is not None and not _is_here(str(host)):
        raise InputError(
            f'It tried to reach "{host}", and a benchmark uses no network: give files of weights by --weights, and '
            "fetch what else it needs before."
        )


def _is_here(host: str) -> bool:
    if host in _HERE:
        return True
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return False
    return address.is_loopback or address.is_unspecified
