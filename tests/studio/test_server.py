"""The server of a studio, at the end of a socket: who is let in, how long a jog lasts, how it ends."""

import asyncio
import contextlib
import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest

from armwright.arm.load import load_arm
from armwright.cell.model import Cell, CellArm
from armwright.studio.project import Project
from armwright.studio.server import Server
from armwright.studio.studio import Studio
from armwright.studio.workbench import Workbench
from cli_calls import armwright

sync = pytest.importorskip("websockets.sync.client")


class Running:
    """A server in a thread of its own."""

    def __init__(self) -> None:
        """Start it."""
        arm = load_arm("puma560")
        cell = Cell(name="bench", arms={"ARM_1": CellArm(arm=arm, start=[0.0, -0.5, 0.6, 0.1, 0.7, 0.0])})
        self.studio = Studio(Project(Workbench(cell)))
        self.studio.workbench.warm_up()
        self.server = Server(self.studio)
        self._ready, self._stopped = threading.Event(), asyncio.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self._ready.wait(10)
        url = urlsplit(self.server.address)
        assert url.port is not None
        self.port, self.token = url.port, url.query.removeprefix("token=")

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self.server.run(lambda _: self._ready.set(), self._stopped))
            self._loop.run_until_complete(self._loop.shutdown_default_executor())
        finally:
            self._loop.close()

    def stop(self) -> float:
        """End it; return how long that takes [s]."""
        start = time.monotonic()
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stopped.set)
        self._thread.join(10)
        assert not self._thread.is_alive()
        return time.monotonic() - start

    def get(self, path: str, **headers: str) -> tuple[http.client.HTTPResponse, str]:
        """Ask for a page; return the answer and its text."""
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)) as connection:
            connection.putrequest("GET", path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name, value)
            connection.endheaders()
            response = connection.getresponse()
            return response, response.read().decode()

    def connect(self, *, token: str | None = None, origin: str | None = None, host: str = "127.0.0.1") -> Any:
        """Connect as its page does, but for what is given."""
        return sync.connect(
            f"ws://127.0.0.1:{self.port}/live",
            origin=f"http://{host}:{self.port}" if origin is None else origin,
            subprotocols=[f"armwright.{self.token if token is None else token}"],
            compression=None,
            open_timeout=5,
            close_timeout=1,
        )


@pytest.fixture
def running() -> Iterator[Running]:
    server = Running()
    yield server
    server.stop()


def test_the_page(running: Running) -> None:
    """The page comes for the token alone, with headers that keep it to itself."""
    response, body = running.get(f"/?token={running.token}")

    assert response.status == 200
    assert response.headers["Cache-Control"] == "no-store"
    assert response.headers["Referrer-Policy"] == "no-referrer"
    assert response.headers["X-Frame-Options"] == "DENY"
    policy = response.headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none';")
    assert f"connect-src http://127.0.0.1:{running.port} ws://127.0.0.1:{running.port};" in policy
    assert "frame-ancestors 'none'" in policy
    assert len(body) < 150_000
    for word in ("http://", "https://"):
        links = [part.split('"')[0] for part in body.split(word)[1:]]
        assert all(link.startswith(("127.0.0.1", "www.w3.org", "${")) for link in links), links


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {}, 403),
        ("/?token=", {}, 403),
        ("/?token=wrong", {}, 403),
        ("/?token={token}x", {}, 403),
        ("/?token={token}", {"Host": "evil.example"}, 421),
        ("/?token={token}", {"Host": "evil.example:{port}"}, 421),
        ("/?token={token}", {"Host": "127.0.0.1"}, 421),
        ("/other?token={token}", {}, 404),
        ("/../etc/passwd?token={token}", {}, 404),
        ("/live", {"Origin": "http://evil.example"}, 403),
        ("/live", {"Origin": "null"}, 403),
    ],
)
def test_who_is_turned_away(running: Running, path: str, headers: dict[str, str], status: int) -> None:
    """Without the token, under another name, or from another page, nothing is to be had."""
    facts = {"token": running.token, "port": running.port}
    given = {name: text.format(**facts) for name, text in headers.items()}
    response, text = running.get(path.format(**facts), **given)
    assert response.status == status
    assert running.token not in text


@pytest.mark.parametrize(
    "changed",
    [
        {"token": "wrong"},
        {"token": ""},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1"},
        {"host": "127.0.0.2"},
    ],
)
def test_whose_connection_is_refused(running: Running, changed: dict[str, str]) -> None:
    """Another page, and one without the token, cannot connect."""
    from websockets.exceptions import InvalidHandshake

    with pytest.raises(InvalidHandshake):
        running.connect(**changed)


def test_only_the_loopback_listens(running: Running) -> None:
    """No other interface of the machine answers."""
    for name in {socket.gethostbyname(socket.gethostname()), "127.0.0.2"} - {"127.0.0.1"}:
        with pytest.raises(OSError), socket.create_connection((name, running.port), timeout=1):  # noqa: PT011
            pass


def test_round_trips(running: Running) -> None:
    """A command is answered by the state that it leads to."""
    with running.connect() as page:
        state = json.loads(page.recv(5))
        for k in range(20):
            page.send(json.dumps({"do": "joint", "arm": "ARM_1", "joint": 1, "value": 0.01 * k}))
            state = json.loads(page.recv(5))
            assert state["arms"]["ARM_1"]["q"][0] == pytest.approx(0.01 * k)
        assert state["refusal"] == ""


def test_two_pages_see_one_state(running: Running) -> None:
    """What one page does another one sees."""
    with running.connect() as one, running.connect() as other:
        one.recv(5)
        other.recv(5)
        other.send('{"do": "got"}')
        one.send('{"do": "joint", "arm": "ARM_1", "joint": 2, "value": -0.25}')
        assert json.loads(one.recv(5))["arms"]["ARM_1"]["q"][1] == -0.25
        seen = json.loads(other.recv(5))
        while seen["arms"]["ARM_1"]["q"][1] != -0.25:
            other.send('{"do": "got"}')
            seen = json.loads(other.recv(5))
        assert not seen["control"]["mine"]


@pytest.mark.parametrize("end", ["close", "cut"])
def test_a_lost_page_stops_its_jog(running: Running, end: str) -> None:
    """When a page is closed, or its connection is cut, the arm stands."""
    arm = running.studio.workbench.arms["ARM_1"]
    with contextlib.suppress(OSError), running.connect() as page:
        page.recv(5)
        page.send('{"do": "jog", "arm": "ARM_1", "frame": "JOINT", "axis": 0, "sign": 1, "share": 0.5}')
        page.recv(5)
        time.sleep(0.1)
        if end == "cut":
            page.socket.shutdown(socket.SHUT_RDWR)
    time.sleep(0.4)
    at = arm.q.copy()
    time.sleep(0.3)
    assert (arm.q == at).all()
    assert 0 < at[0] < 0.4 * 0.8


def test_bad_messages(running: Running) -> None:
    """What is no command is told, and the connection goes on; what is too long ends it, and the server goes on."""
    from websockets.exceptions import ConnectionClosed

    with running.connect() as page:
        page.recv(5)
        for message in ("", "{", '{"do": "jump"}', b"\0\1", '{"do": "joint"}'):
            page.send(message)
            assert json.loads(page.recv(5))["refusal"] != ""
        page.send(json.dumps({"do": "text", "text": "x" * (1 << 21), "version": 0}))
        with pytest.raises(ConnectionClosed):
            list(iter(lambda: page.recv(5), None))
    with running.connect() as page:
        assert json.loads(page.recv(5))["arms"]


def test_silent_connections(running: Running, capfd: pytest.CaptureFixture[str]) -> None:
    """Ports are probed by connections that say nothing, or nonsense: no word about it, and the server goes on."""
    with socket.create_connection(("127.0.0.1", running.port)):
        pass
    with socket.create_connection(("127.0.0.1", running.port)) as probe:
        probe.sendall(b"\x16\x03\x01nonsense\r\n\r\n")
        probe.settimeout(5)
        probe.recv(1000)
    assert running.get(f"/?token={running.token}")[0].status == 200
    assert capfd.readouterr() == ("", "")


def test_its_end(running: Running) -> None:
    """With pages open it ends within a second."""
    with contextlib.ExitStack() as opened:
        pages = [opened.enter_context(running.connect()) for _ in range(3)]
        for page in pages:
            page.recv(5)
        # Not a timing, but a bound of how long it may hang.
        assert running.stop() < 5.0


def test_a_port_that_is_taken() -> None:
    """A port of another program is told in one line."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        result = armwright("studio", "puma560", "--port", port)
    assert result.returncode == 2
    assert f"port {port}" in result.stderr
    assert "Traceback" not in result.stderr
