"""An editor's side of the Debug Adapter Protocol, with time limits, for tests."""

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from armwright.cli.debug import load, save
from armwright.program.debugger.dap_server import serve
from program.running import CORPUS

# A request that is not answered by then never is [s].
PATIENCE = 300.0


class Client:
    """An editor connected to a debug adapter, and what it has said.

    The adapter runs in a thread of this process, with what ``armwright debug`` reads programs and writes results with;
    ``process=True`` starts that command in a process of its own.
    """

    def __init__(self, *, process: bool = False) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._other_threads = set(threading.enumerate())
        if process:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "armwright", "debug"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env={**os.environ, "NO_COLOR": "1"},
            )
            assert self._process.stdin is not None
            assert self._process.stdout is not None
            self._requests, self._answers = self._process.stdin, self._process.stdout
        else:
            (read_requests, write_requests), (read_answers, write_answers) = os.pipe(), os.pipe()
            self._requests, self._answers = os.fdopen(write_requests, "wb"), os.fdopen(read_answers, "rb")
            streams = os.fdopen(read_requests, "rb", buffering=0), os.fdopen(write_answers, "wb")
            self._streams = streams
            threading.Thread(target=self._serve, args=streams, daemon=True).start()
        self._sent = 0
        self._incoming: queue.Queue[dict[str, Any]] = queue.Queue()
        self.events: list[dict[str, Any]] = []
        threading.Thread(target=self._listen, daemon=True).start()

    @staticmethod
    def _serve(incoming: BinaryIO, outgoing: BinaryIO) -> None:
        with outgoing:
            serve(incoming, outgoing, load, save)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            assert self._process.stderr is not None
            self._process.stderr.close()
        with contextlib.suppress(BrokenPipeError):
            self._requests.close()
        # At the end of the requests the adapter ends, and with the answers what listens to them.
        for thread in set(threading.enumerate()) - self._other_threads:
            thread.join(PATIENCE)
        self._answers.close()
        if self._process is None:
            self._streams[0].close()

    def _listen(self) -> None:
        while line := self._answers.readline():
            length = int(line.split(b":")[1])
            assert self._answers.readline() == b"\r\n"
            self._incoming.put(json.loads(self._answers.read(length)))

    # ---- sending ---------------------------------------------------------------------------------------------------

    def raw(self, data: bytes) -> None:
        """Send what may be no message at all."""
        self._requests.write(data)
        self._requests.flush()

    def hang_up(self) -> None:
        """Close the stream of requests."""
        self._requests.close()

    def send(self, command: str, **arguments: Any) -> int:
        """Send a request without waiting; return its number."""
        self._sent += 1
        body = json.dumps({"seq": self._sent, "type": "request", "command": command, "arguments": arguments}).encode()
        self.raw(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        return self._sent

    def answer(self, number: int) -> dict[str, Any]:
        """Wait for the answer to a request; events that come before are kept."""
        while True:
            message = self._next()
            if message["type"] == "response" and message["request_seq"] == number:
                return message

    def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """Send a request that succeeds; return what its answer says."""
        answer = self.answer(self.send(command, **arguments))
        assert answer["success"], answer
        return answer.get("body", {})

    def refused(self, command: str, **arguments: Any) -> str:
        """Send a request that does not succeed; return why."""
        answer = self.answer(self.send(command, **arguments))
        assert not answer["success"], answer
        return str(answer["message"])

    def _next(self) -> dict[str, Any]:
        message = self._incoming.get(timeout=PATIENCE)
        if message["type"] == "event":
            self.events.append(message)
        return message

    def wait(self, event: str) -> dict[str, Any]:
        """Return the next event of a kind; those that came before have been used up with it."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            for at, one in enumerate(self.events):
                if one["event"] == event:
                    del self.events[at]
                    return dict(one["body"])
            self._next()
        raise AssertionError(f"no event {event}: {self.events}")

    def status(self) -> int:
        """Return the exit status of the process, which is about to end."""
        assert self._process is not None
        return self._process.wait(timeout=PATIENCE)

    def errors(self) -> str:
        """Return what the process wrote to its error output, once it has ended."""
        assert self._process is not None
        assert self._process.stderr is not None
        return self._process.stderr.read().decode()

    # ---- what editors do -------------------------------------------------------------------------------------------

    def launch(self, program: Path, cell: str | Path = "cell1", *, lines: tuple[int, ...] = (), **more: Any) -> None:
        """Open a program, set breakpoints, and let it begin."""
        cell = CORPUS / f"{cell}.json" if isinstance(cell, str) else cell
        self.ask("initialize", adapterID="rlo", linesStartAt1=True, columnsStartAt1=True)
        self.ask("launch", program=str(program), cell=str(cell), **more)
        self.wait("initialized")
        if lines:
            asked = [{"line": line} for line in lines]
            bound = self.ask("setBreakpoints", source={"path": str(program)}, breakpoints=asked)
            assert all(one["verified"] for one in bound["breakpoints"]), bound
        self.ask("configurationDone")

    def step(self, command: str, thread: int = 1, **more: Any) -> dict[str, Any]:
        """Make a step; return the stop at its end."""
        self.ask(command, threadId=thread, **more)
        return self.wait("stopped")

    def line(self, thread: int = 1) -> int:
        """Return the line that a thread is in."""
        return int(self.stack(thread)[0]["line"])

    def stack(self, thread: int = 1) -> list[dict[str, Any]]:
        """Return the stack of a thread."""
        return list(self.ask("stackTrace", threadId=thread)["stackFrames"])

    def scope(self, name: str, thread: int = 1) -> dict[str, dict[str, Any]]:
        """Return what is in a scope of the innermost stack frame, by name."""
        frame = self.stack(thread)[0]["id"]
        (one,) = (one for one in self.ask("scopes", frameId=frame)["scopes"] if one["name"] == name)
        return self.inside(one)

    def inside(self, shown: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """Return what is inside of something, by name."""
        listed = self.ask("variables", variablesReference=shown["variablesReference"])["variables"]
        return {one["name"]: one for one in listed}

    def value(self, expression: str) -> str:
        """Return the value of an expression."""
        return str(self.ask("evaluate", expression=expression)["result"])
