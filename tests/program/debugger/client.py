"""An editor's side of the Debug Adapter Protocol, with time limits, for tests."""

import json
import os
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from program.running import CORPUS

# A request that is not answered by then never is [s].
PATIENCE = 300.0


class Client:
    """``armwright debug`` in a process of its own, and what it has said."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "armwright", "debug"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, "NO_COLOR": "1"},
        )
        self._sent = 0
        self._incoming: queue.Queue[dict[str, Any]] = queue.Queue()
        self.events: list[dict[str, Any]] = []
        threading.Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            assert pipe is not None
            pipe.close()

    def _listen(self) -> None:
        stream = self._process.stdout
        assert stream is not None
        while True:
            line = stream.readline()
            if not line:
                return
            length = int(line.split(b":")[1])
            assert stream.readline() == b"\r\n"
            self._incoming.put(json.loads(stream.read(length)))

    # ---- sending ---------------------------------------------------------------------------------------------------

    def raw(self, data: bytes) -> None:
        """Send what may be no message at all."""
        stream = self._process.stdin
        assert stream is not None
        stream.write(data)
        stream.flush()

    def hang_up(self) -> None:
        """Close the stream of requests."""
        stream = self._process.stdin
        assert stream is not None
        stream.close()

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
        """Return the exit status of the debugger, which is about to end."""
        return self._process.wait(timeout=PATIENCE)

    def errors(self) -> str:
        """Return what it wrote to its error output, once it has ended."""
        stream = self._process.stderr
        assert stream is not None
        return stream.read().decode()

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
