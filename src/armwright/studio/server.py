"""The server of a studio: one page and its connection, on the loopback interface, for who knows the token."""

from __future__ import annotations

import asyncio
import contextlib
import http
import json
import logging
import secrets
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.parse import SplitResult, parse_qs, urlsplit

import attrs

from armwright.extras import import_extra
from armwright.studio.messages import MAX_MESSAGE
from armwright.studio.page import studio_page
from armwright.studio.studio import Studio

HOST = "127.0.0.1"
# Bytes of the secret in the address.
_TOKEN_BYTES = 24
# A page that has not taken a state for so long is sent the next one anyway [s].
_PATIENCE = 1.0
# Jogging goes on in steps of this [s].
_TICK = 1 / 60
# After a longer pause of the machine it does not leap [s].
_LONGEST_TICK = 0.1
# What is being computed at the end has so long to end by itself [s].
_LAST_WAIT = 0.25
_THREADS = "studio"
# Pages at once at most.
_MOST_PAGES = 8
_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:; "
    "media-src blob:; connect-src {origin} {socket}; base-uri 'none'; form-action 'none'"
)


@attrs.define(eq=False)
class _Page:
    """A connected page.

    Attributes:
        socket: its connection.
        number: of the page, from 1.
        waiting: set when there is a state that it has not been sent.
        may_send: set when it has taken the latest state.
    """

    socket: Any
    number: int
    waiting: asyncio.Event = attrs.field(factory=asyncio.Event)
    may_send: asyncio.Event = attrs.field(factory=asyncio.Event)


class Server:
    """Serves a studio to the pages of one user."""

    def __init__(self, studio: Studio, port: int = 0) -> None:
        """Take a studio.

        Args:
            studio: what the pages show.
            port: to listen on; 0 for any that is free.
        """
        self.studio, self._port = studio, port
        self._token = secrets.token_urlsafe(_TOKEN_BYTES)
        self._pages: dict[int, _Page] = {}
        self._count = 0
        self._sending: set[asyncio.Task[None]] = set()
        # One thread makes all that is asked for, for pictures have to be taken by one; another one compiles what moving
        # needs, and then computes runs.
        self._jobs, self._runs = (ThreadPoolExecutor(1, f"{_THREADS}-{name}") for name in ("jobs", "runs"))
        studio.project.executor = self._runs

    @property
    def address(self) -> str:
        """Where the page is; whoever knows it may command the studio."""
        return f"http://{HOST}:{self._port}/?token={self._token}"

    # ---- the door ------------------------------------------------------------------------------------------------

    def _answer(self, connection: Any, request: Any) -> Any:
        """Return the page, a refusal, or None to let a connection of the page in."""
        from websockets.datastructures import Headers  # noqa: PLC0415 - of the extra
        from websockets.http11 import Response  # noqa: PLC0415

        refusal = self._refusal(request)
        if refusal is not None:
            status, text = refusal
            return connection.respond(status, text + "\n")
        if _url(request.path).path == "/live":
            return None
        host = request.headers["Host"]
        policy = _POLICY.format(origin=f"http://{host}", socket=f"ws://{host}")
        body = studio_page(self.studio.workbench, self._token, policy).encode()
        headers = Headers(
            {
                "Content-Type": "text/html; charset=utf-8",
                "Content-Length": str(len(body)),
                "Content-Security-Policy": policy + "; frame-ancestors 'none'",
                "Cache-Control": "no-store",
                "Referrer-Policy": "no-referrer",
                "X-Content-Type-Options": "nosniff",
                "X-Frame-Options": "DENY",
            }
        )
        return Response(http.HTTPStatus.OK, "OK", headers, body)

    def _refusal(self, request: Any) -> tuple[http.HTTPStatus, str] | None:
        """Return why a request is refused; None where it is not."""
        hosts = {f"{HOST}:{self._port}", f"localhost:{self._port}"}
        url, headers = _url(request.path), request.headers
        # A page of another name that leads here would be of another origin, and yet read the answer.
        if headers.get_all("Host") not in [[host] for host in hosts]:
            return http.HTTPStatus.MISDIRECTED_REQUEST, "this server answers under its own address only"
        if url.path == "/live":
            offered = ",".join(headers.get_all("Sec-WebSocket-Protocol")).split(",")
            if headers.get_all("Origin") not in [[f"http://{host}"] for host in hosts]:
                return http.HTTPStatus.FORBIDDEN, "only the page of this server may connect"
            if not any(self._knows(name.strip().removeprefix("armwright.")) for name in offered):
                return http.HTTPStatus.FORBIDDEN, "the token is not that of this server"
        elif url.path != "/":
            return http.HTTPStatus.NOT_FOUND, "there is nothing here"
        elif not self._knows(parse_qs(url.query).get("token", [""])[0]):
            return http.HTTPStatus.FORBIDDEN, "open the address that armwright printed"
        return None

    def _knows(self, token: str) -> bool:
        return secrets.compare_digest(token.encode(), self._token.encode())

    # ---- pages ---------------------------------------------------------------------------------------------------

    async def _live(self, socket: Any) -> None:
        """Serve a page until it is closed."""
        if len(self._pages) >= _MOST_PAGES:
            await socket.close(code=1013, reason=f"{_MOST_PAGES} pages are open")
            return
        self._count += 1
        page = _Page(socket, self._count)
        page.may_send.set()
        page.waiting.set()
        self._pages[page.number] = page
        self.studio.page_opened(page.number)
        self._changed()
        tasks = {asyncio.create_task(self._send_states(page)), asyncio.create_task(self._receive_all(page))}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
            del self._pages[page.number]
            self.studio.page_closed(page.number)
            self._changed()

    async def _receive_all(self, page: _Page) -> None:
        """Do what a page asks for until it is closed, or its connection is cut."""
        from websockets.exceptions import ConnectionClosed  # noqa: PLC0415 - of the extra

        with contextlib.suppress(ConnectionClosed):
            async for text in page.socket:
                self._receive(page, text)

    def _receive(self, page: _Page, text: str | bytes) -> None:
        """Do what a page asks for."""
        page.may_send.set()
        if self.studio.receive(text, page.number, time.monotonic()):
            self._changed()
        for number, job in self.studio.take_jobs():
            task = asyncio.create_task(self._send_answer(number, job))
            self._sending.add(task)
            task.add_done_callback(self._sending.discard)

    async def _send_answer(self, number: int, job: Callable[[], dict[str, Any] | None]) -> None:
        """Make a message beside all else, and send it to the page that has asked for it."""
        from websockets.exceptions import ConnectionClosed  # noqa: PLC0415 - of the extra

        made = await asyncio.get_running_loop().run_in_executor(self._jobs, job)
        page = self._pages.get(number)
        if made is None:
            self._changed()
        elif page is not None:
            with contextlib.suppress(ConnectionClosed):
                await page.socket.send(json.dumps(made))

    def _changed(self) -> None:
        for page in self._pages.values():
            page.waiting.set()

    async def _send_states(self, page: _Page) -> None:
        """Send a page the newest state whenever there is one and it has taken the one before."""
        from websockets.exceptions import ConnectionClosed  # noqa: PLC0415 - of the extra

        with contextlib.suppress(ConnectionClosed):
            while True:
                await page.waiting.wait()
                if not page.may_send.is_set():
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(_PATIENCE):
                            await page.may_send.wait()
                page.waiting.clear()
                page.may_send.clear()
                await page.socket.send(self._state_text(page))

    def _state_text(self, page: _Page) -> str:
        state = self.studio.state(page.number)
        return json.dumps(state, separators=(",", ":"), allow_nan=False)

    async def _tick(self) -> None:
        """Let what moves by itself go on."""
        before = due = time.monotonic()
        while True:
            # As often as that, whatever a tick takes; what has been missed is not made up for.
            due = max(due + _TICK, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            now = time.monotonic()
            if self.studio.tick(now, min(now - before, _LONGEST_TICK)):
                self._changed()
            before = now

    # ---- running -------------------------------------------------------------------------------------------------

    async def run(self, announce: Callable[[str], None], stopped: asyncio.Event | None = None) -> None:
        """Serve until Ctrl-C, or until an event is set.

        Args:
            announce: called with the address as soon as the page can be had.
            stopped: ends the server.

        Raises:
            MissingExtraError: websockets is not installed.
            OSError: the port is taken.
        """
        websockets = import_extra("websockets.asyncio.server", "the studio", "studio", "websockets")
        quiet = logging.getLogger("armwright.studio.server")
        quiet.addHandler(logging.NullHandler())
        quiet.propagate = False
        stopped = stopped or asyncio.Event()
        loop = asyncio.get_running_loop()
        with contextlib.suppress(ValueError, NotImplementedError, RuntimeError):
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                # Who ignores one of them, as nohup does, has a reason.
                if signal.getsignal(number) != signal.SIG_IGN:
                    loop.add_signal_handler(number, stopped.set)
        serving = websockets.serve(
            self._live,
            HOST,
            self._port,
            process_request=self._answer,
            select_subprotocol=lambda _, offered: offered[0] if offered else None,
            compression=None,
            max_size=MAX_MESSAGE,
            open_timeout=2,
            ping_interval=2,
            ping_timeout=4,
            close_timeout=0.5,
            server_header=None,
            logger=quiet,
        )
        async with serving as server:
            self._port = server.sockets[0].getsockname()[1]
            announce(self.address)
            warm = loop.run_in_executor(self._runs, self.studio.workbench.warm_up)
            ticking = asyncio.create_task(self._tick())
            warm.add_done_callback(lambda _: self._changed())
            waiting = asyncio.create_task(stopped.wait())
            try:
                await asyncio.wait({waiting, ticking}, return_when=asyncio.FIRST_COMPLETED)
                if ticking.done():
                    ticking.result()
            finally:
                waiting.cancel()
                ticking.cancel()
                self.studio.has_ended = True
                for executor in (self._jobs, self._runs):
                    executor.shutdown(wait=False, cancel_futures=True)


def _url(path: str) -> SplitResult:
    """Return the parts of a path; nothing of one that has none."""
    try:
        return urlsplit(path)
    except ValueError:
        return urlsplit("")


def serve(studio: Studio, announce: Callable[[str], None], port: int = 0) -> bool:
    """Serve a studio until Ctrl-C; return whether all that it computed has ended too.

    Args:
        studio: what the pages show.
        announce: called with the address as soon as the page can be had.
        port: to listen on; 0 for any that is free.
    """
    asyncio.run(Server(studio, port).run(announce))
    threads = [it for it in threading.enumerate() if it.name.startswith(_THREADS)]
    for thread in threads:
        thread.join(_LAST_WAIT)
    return not any(it.is_alive() for it in threads)
