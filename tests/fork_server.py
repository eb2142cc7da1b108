"""A process that runs each call in a child of its own: as alone as a new process, and as quick as a function.

It reads calls as lines of JSON and answers each with one: ``{"status": 0, "out": "...", "err": "..."}``. The status is
negative for the signal that killed a call, and ``null`` for one that did not end in its time. A call has ``arguments``
of the command line, or ``code``; the ``folder`` in which it is made, and a ``scratch`` folder for its output; it may
have an ``environment``, which replaces that of the server, a ``file_size`` that no file may exceed [bytes], and be
``terminated`` after a time [s], as whoever stops a server does.

What most calls need is named in the arguments, and loaded once for all of them.
"""

import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

# A call that takes more processor time, or longer, hangs [s]; one that takes more memory is killed [bytes].
_PROCESSOR, _PATIENCE = 120, 900
_MEMORY = 8 << 30


class ForkServer:
    """The side of the tests: sends calls, one at a time, and returns what came of them."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def call(self, folder: Path, scratch: Path, **what: Any) -> dict[str, Any]:
        """Make one call; the keywords are those of the module's docstring."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        request = {"folder": str(folder), "scratch": str(scratch), **what}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return dict(json.loads(self._process.stdout.readline()))


@contextmanager
def fork_server(modules: Sequence[str], environment: Mapping[str, str]) -> Iterator[ForkServer]:
    """Start a server that has loaded some modules."""
    command = [sys.executable, str(Path(__file__)), *modules]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=dict(environment)
    ) as process:
        yield ForkServer(process)
        assert process.stdin is not None
        process.stdin.close()


def answer(call: dict[str, Any]) -> dict[str, Any]:
    """Do one call."""
    out, err = (Path(call["scratch"], name) for name in ("out.txt", "err.txt"))
    child = os.fork()
    if not child:
        _be_the_command(call, out, err)
    status = _ended(child)
    said = {name: path.read_text(encoding="utf-8", errors="replace") for name, path in (("out", out), ("err", err))}
    return {"status": status, **said}


def _be_the_command(call: dict[str, Any], out: Path, err: Path) -> None:
    """Become the program: its streams, its folder, its arguments."""
    for number, stream in ((0, os.open(os.devnull, os.O_RDONLY)), (1, _new(out)), (2, _new(err))):
        os.dup2(stream, number)
    sys.__stdout__ = sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.__stderr__ = sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
    resource.setrlimit(resource.RLIMIT_CPU, (_PROCESSOR, _PROCESSOR))
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    if (seconds := call.get("terminated")) is not None:
        signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        signal.setitimer(signal.ITIMER_REAL, seconds)
    if (size := call.get("file_size")) is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    if (environment := call.get("environment")) is not None:
        os.environ.clear()
        os.environ.update(environment)
    os.environ["HOME"] = call["folder"]
    os.chdir(call["folder"])
    status = 1
    try:
        _run(call)
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001 - as the interpreter would
        sys.excepthook(*sys.exc_info())
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def _run(call: dict[str, Any]) -> None:
    if (code := call.get("code")) is not None:
        exec(compile(code, "<call>", "exec"), {"__name__": "__main__"})
        return
    from armwright.cli.app import main

    sys.argv = ["armwright", *call["arguments"]]
    main()


def _new(path: Path) -> int:
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)


def _ended(child: int) -> int | None:
    """Wait for a call to end; what hangs is killed."""
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.003)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


if __name__ == "__main__":
    for name in sys.argv[1:]:
        importlib.import_module(name)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)  # noqa: T201
