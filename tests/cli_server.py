"""A process that calls the command line in children of its own: each call is as alone as a new process, and as quick.

It reads calls as lines of JSON and answers each with one: ``{"status": 0, "out": "...", "err": "..."}``. The status is
negative for the signal that killed a call, and ``null`` for one that did not end in its time.
"""

import json
import os
import resource
import signal
import sys
import time
from pathlib import Path
from typing import Any

# A call that takes more processor time, or longer, hangs [s]; one that takes more memory is killed [bytes].
_PROCESSOR, _PATIENCE = 120, 900
_MEMORY = 8 << 30


def answer(call: dict[str, Any]) -> dict[str, Any]:
    """Do one call: its arguments, and the folder in which it is made."""
    folder = Path(call["folder"])
    out, err = (folder.parents[1] / name for name in ("out.txt", "err.txt"))
    child = os.fork()
    if not child:
        _be_the_command(call["arguments"], folder, out, err)
    status = _ended(child)
    said = {name: path.read_text(encoding="utf-8", errors="replace") for name, path in (("out", out), ("err", err))}
    return {"status": status, **said}


def _be_the_command(arguments: list[str], folder: Path, out: Path, err: Path) -> None:
    """Become the program: its streams, its folder, its arguments."""
    from armwright.cli.app import main

    for number, stream in ((0, os.open(os.devnull, os.O_RDONLY)), (1, _new(out)), (2, _new(err))):
        os.dup2(stream, number)
    sys.__stdout__ = sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.__stderr__ = sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
    resource.setrlimit(resource.RLIMIT_CPU, (_PROCESSOR, _PROCESSOR))
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    os.environ["HOME"] = str(folder)
    os.chdir(folder)
    sys.argv = ["armwright", *arguments]
    status = 1
    try:
        main()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001 - as the interpreter would
        sys.excepthook(*sys.exc_info())
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


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


def _load() -> None:
    """Load what most commands need, once for all of them."""
    import importlib

    for name in ("armwright.cli.app", "armwright.arm.load", "armwright.program.api", "armwright.cell.reader",
                 "armwright.program.vm.interpreter", "armwright.report.files", "armwright.motion.moves",
                 "armwright.clearance.reader", "armwright.compiled.arm", "rich.markdown"):  # fmt: skip
        importlib.import_module(name)


if __name__ == "__main__":
    _load()
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)  # noqa: T201
