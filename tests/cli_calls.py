"""Calling the command line as a user does."""

import contextlib
import io
import os
import signal
import subprocess
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from armwright.cli.app import main
from armwright.files import inputs

# What the interpreter does with warnings when nobody says otherwise: those for developers are not shown.
_FOR_DEVELOPERS = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)


def armwright(
    *arguments: str | Path,
    columns: int = 80,
    cwd: Path | None = None,
    fed: str | bytes = "",
    environment: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Call it within this process, as in a terminal of that width that nobody watches: no interpreter has to start.

    Args:
        arguments: behind the name of the program.
        columns: of the terminal.
        cwd: the folder in which it is called.
        fed: its standard input.
        environment: variables to set for it.
    """
    command = [str(argument) for argument in arguments]
    output, errors = (io.TextIOWrapper(io.BytesIO(), "utf-8", "backslashreplace", "") for _ in range(2))
    with _as_started(["armwright", *command], columns, cwd, environment or {}), _streams(fed, output, errors):
        status = _status()
    return subprocess.CompletedProcess(command, status, _text(output), _text(errors))


def armwright_process(
    *arguments: str | Path, columns: int = 80, cwd: Path | None = None, before: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    """Call it in a process of its own; ``before`` runs in that first."""
    return subprocess.run(
        [sys.executable, "-m", "armwright", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        preexec_fn=before,
        env={**os.environ, "COLUMNS": str(columns), "NO_COLOR": "1"},
        timeout=300,
    )


def fed_to(
    command: str, path: str, folder: Path, *options: str, typed: str = "", piped: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Call a command with a program that somebody types, or writes once into a pipe of that name."""
    if piped is None:
        return armwright(command, path, *options, cwd=folder, fed=typed)
    os.mkfifo(folder / path)
    with subprocess.Popen(["sh", "-c", 'printf %s "$0" > "$1"', piped, folder / path]) as writer:
        result = armwright(command, path, *options, cwd=folder)
        writer.kill()
    (folder / path).unlink()
    return result


def _status() -> int:
    """Run the command and return its exit status, as the interpreter does."""
    try:
        main()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:  # noqa: BLE001 - the interpreter prints whatever comes
        traceback.print_exc()
        return 1
    return 0


@contextlib.contextmanager
def _as_started(argv: list[str], columns: int, cwd: Path | None, environment: Mapping[str, str]) -> Iterator[None]:
    """Let this process look like one that has just started, and put everything back afterwards."""
    before = sys.argv, dict(os.environ), Path.cwd(), warnings.showwarning
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    sys.argv = argv
    os.environ |= {"COLUMNS": str(columns), "NO_COLOR": "1", **environment}
    os.chdir(cwd or before[2])
    inputs.forget_read_files()
    try:
        with warnings.catch_warnings():
            warnings.resetwarnings()
            for category in _FOR_DEVELOPERS:
                warnings.simplefilter("ignore", category)
            yield
    finally:
        os.chdir(before[2])
        os.environ.clear()
        os.environ.update(before[1])
        sys.argv, warnings.showwarning = before[0], before[3]
        for number, handler in handlers.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _streams(fed: str | bytes, output: io.TextIOWrapper, errors: io.TextIOWrapper) -> Iterator[None]:
    before = sys.stdin, sys.stdout, sys.stderr
    typed = io.BytesIO(fed.encode() if isinstance(fed, str) else fed)
    sys.stdin, sys.stdout, sys.stderr = io.TextIOWrapper(typed, "utf-8"), output, errors
    try:
        yield
    finally:
        sys.stdin, sys.stdout, sys.stderr = before


def _text(stream: io.TextIOWrapper) -> str:
    stream.flush()
    written = stream.buffer
    assert isinstance(written, io.BytesIO)
    return written.getvalue().decode()


def check_mistake(*arguments: str | Path, said: str, folder: Path) -> None:
    """Check that a mistake gets one message that says what to do, no traceback, and leaves nothing in its folder."""
    done = armwright(*arguments, cwd=folder)

    assert done.returncode in (2, 3, 4)
    assert said in " ".join(done.stderr.replace("│", " ").split())
    assert "Traceback" not in done.stderr
    assert not list(folder.iterdir())
