"""A benchmark's processes reach no other machine, and this machine all the same."""

import subprocess
import sys

SCRIPT = """
import socket, socketserver, threading, urllib.request
from PolyPoseLib.benchmark.no_network import refuse_network
from PolyPoseLib.errors import InputError

refuse_network()
for attempt in (
    lambda: urllib.request.urlopen("http://polypose.invalid/weights.pt", timeout=1),
    lambda: socket.create_connection(("192.0.2.1", 80), 1),
    lambda: socket.socket().connect(("192.0.2.1", 80)),
    lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"x", ("192.0.2.1", 80)),
    lambda: socket.gethostbyname("polypose.invalid"),
):
    try:
        attempt()
    except InputError as error:
        print(error)

server = socketserver.TCPServer(("127.0.0.1", 0), socketserver.BaseRequestHandler)
threading.Thread(target=server.handle_request).start()
socket.create_connection(("localhost", server.server_address[1]), 5).close()
socket.getaddrinfo("::1", 80)
first, second = socket.socketpair()
first.sendall(b"x")
print(second.recv(1), bool(socket.getaddrinfo(None, 0)))
"""


def test_another_machine_cannot_be_reached_and_this_one_can():
    ended = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=100)
    hosts = ["polypose.invalid", "192.0.2.1", "192.0.2.1", "192.0.2.1", "polypose.invalid"]
    lines = ended.stdout.splitlines()
    assert len(lines) == 6 and lines[5] == "b'x' True", ended.stderr
    for line, host in zip(lines, hosts, strict=False):
        assert line.startswith(
            f'It tried to reach "{host}", and a benchmark uses no network: give files of weights'
        )
