"""How a failed command ends: with one message or one JSON document, and an exit status."""

import contextlib
import errno
import itertools
import os
import signal
import sys
import threading
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from armwright.cli.commands import NAME, Group
from armwright.cli.options import usage_error
from armwright.cli.output import print_json
from armwright.cli.terminal import cleaned
from armwright.errors import ArmwrightError, CheckFailedError, DoubtfulError, ExitStatus, FileFormatError, shortened
from armwright.files.output import WRITTEN

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

# An environment variable; where it is set, internal errors are printed with a traceback.
DEBUG = "ARMWRIGHT_DEBUG"
# The base class of Typer's errors of usage; the module that defines it depends on Typer's version.
_CallError: type[Exception] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
_OUTPUTS = ("-o", "--output")
# Errors of a standard output that cannot be written; they name no file.
_UNWRITABLE = {errno.EPIPE, errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF, errno.ENXIO, errno.EINVAL}
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# Delay after which a signal that was lost is sent again [s].
_AGAIN = 0.02


class Interrupted(BaseException):
    """A signal interrupts the command; a class of our own, since Typer handles KeyboardInterrupt itself."""

    def __init__(self, number: int) -> None:
        """Store the number of the signal."""
        self.number = number
        super().__init__(number)


class _Raised(BaseException):
    """Wraps an error that Typer would handle itself."""

    def __init__(self, error: Exception) -> None:
        self.error = error


class Commands(Group):
    """All commands; every error that they raise reaches ``run_and_exit``."""

    def make_context(self, *arguments: Any, **settings: Any) -> Any:
        """Read the options before the command."""
        try:
            _refuse_empty_output(sys.argv[1:])
            return super().make_context(*arguments, **settings)
        except _CallError as error:
            raise _escaped(error) from None

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help text without Rich, whose import takes longer than everything else."""
        self.format_usage(ctx, formatter)
        for paragraph in (self.help or "").split("\n\n"):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(paragraph.replace("**", "").replace("`", ""))
        self.format_options(ctx, formatter)

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write the commands, each with the complete first sentence of its help."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, (self.commands[name].help or "").split("\n\n")[0]) for name in self.commands])

    def invoke(self, ctx: Any) -> Any:
        """Call the requested command."""
        try:
            return super().invoke(ctx)
        except _CallError as error:
            raise _escaped(error) from None
        except (EOFError, OSError) as error:
            raise _Raised(error) from error


def _refuse_empty_output(words: list[str]) -> None:
    """Refuse an empty output path, from a variable that is not set: it would denote the current folder."""
    for word, after in itertools.pairwise([*words, "-"]):
        if (word in _OUTPUTS and not after) or word in {f"{option}=" for option in _OUTPUTS}:
            raise usage_error(word.rstrip("="), "expected a path, got an empty text")


def _escaped(error: Exception) -> Exception:
    """Return an error of usage with control characters escaped, as Typer prints such errors itself."""
    for name, value in vars(error).items():
        if isinstance(value, str):
            setattr(error, name, cleaned(value))
        elif isinstance(value, list | tuple) and all(isinstance(text, str) for text in value):
            setattr(error, name, [cleaned(text) for text in value])
    return error


def run_and_exit(app: "Callable[..., Any]") -> None:
    """Run the command line and end with its status; an error becomes a message, under ``--json`` a document."""
    as_json = _json_requested(sys.argv[1:])
    try:
        status = _status(app, as_json=as_json)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of our output has ended, as in `armwright show ur5 | head`.
        _forget_output()
        status = ExitStatus.BROKEN_PIPE
    except OSError as error:
        _forget_output()
        print(f"armwright: cannot write the output: {error.strerror or error}", file=sys.stderr)
        status = ExitStatus.FILE
    sys.exit(status)


def _json_requested(words: list[str]) -> bool:
    """Whether the arguments of the command line request JSON."""
    return "--json" in words or "--format=json" in words or ("--format", "json") in itertools.pairwise(words)


def _status(app: "Callable[..., Any]", *, as_json: bool) -> int:
    """Run the command line, print the message of an error, and return the exit status.

    Raises:
        OSError: the output cannot be written; ``BrokenPipeError``: its reader has ended.
    """
    try:
        # Typer prints an error of usage itself, with the usage of the command, unless JSON is requested.
        with _interruptible():
            return int(app(standalone_mode=not as_json, prog_name=NAME) or ExitStatus.DONE)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):
            # Rich caught it, and exited with a status of its own.
            raise end.__context__ from None
        return end.code if isinstance(end.code, int) else ExitStatus.DONE
    except _Raised as raised:
        error: BaseException = raised.error
    except (Exception, Interrupted) as other:  # noqa: BLE001 - unforeseen errors are reported as defects
        error = other
    if isinstance(error, OSError) and error.filename is None and error.errno in _UNWRITABLE:
        raise error
    status, message = _status_and_message(error)
    # The document of a failed check or a doubtful result has been printed with its result.
    if as_json and not isinstance(error, CheckFailedError | DoubtfulError):
        print_json(failure_data(status, error, message))
    else:
        print(f"armwright: {message}", file=sys.stderr)
    return status


def _status_and_message(error: BaseException) -> tuple[int, str]:
    """Return the exit status and the message of an error."""
    match error:
        case ArmwrightError():
            return error.exit_status, str(error)
        case _CallError():
            return ExitStatus.USAGE, error.format_message()  # type: ignore[attr-defined]
        case Interrupted():
            # A command that has stored results adds a note to the exception.
            written = ", ".join(f"'{folder}'" for folder in WRITTEN)
            results = f"the results are written: {written}" if written else "nothing was written"
            notes = getattr(error, "__notes__", [results])
            return 128 + error.number, "; ".join(["interrupted", *notes])
        case OSError():
            unnamed = "the current folder" if error.errno == errno.ENOENT else "a file"
            file = unnamed if error.filename is None else f"'{error.filename}'"
            return ExitStatus.FILE, f"cannot read or write {file}: {error.strerror or error}"
        case MemoryError():
            return ExitStatus.INFEASIBLE, "this needs more memory than is available"
        case _:
            return ExitStatus.INTERNAL_ERROR, _defect_message(error)


def failure_data(status: int, error: BaseException, message: str) -> dict[str, Any]:
    """Return an error as the document that ``--json`` prints.

    Args:
        status: the exit status.
        error: the exception.
        message: its text.
    """
    details: dict[str, Any] = {"class": type(error).__name__, "message": message}
    if isinstance(error, FileFormatError):
        details |= {"file": str(error.path), "line": error.line, "key": shortened(error.key) or None}
    return {"exit_status": int(status), "error": details}


def outcome(error: ArmwrightError | None) -> dict[str, Any]:
    """Return the exit status, and the error if there is one, for the JSON document of a result."""
    if error is None:
        return {"exit_status": int(ExitStatus.DONE)}
    return failure_data(error.exit_status, error, str(error))


def _defect_message(error: BaseException) -> str:
    """Return a message that locates a defect of armwright and asks for a report; print a traceback where it is set."""
    if os.environ.get(DEBUG):
        traceback.print_exception(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    description = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return (
        f"a defect of armwright, not of its inputs: {description} (in {last.name}, {Path(last.filename).name}:"
        f"{last.lineno}); please report it with the command and its files; {DEBUG}=1 prints a traceback"
    )


@contextlib.contextmanager
def _interruptible() -> "Iterator[None]":
    """Turn signals into exceptions during a command; before and after it they end the process."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    # A hang-up that `nohup` ignores stays ignored.
    handled = [number for number in _SIGNALS if number is not signal.SIGHUP or before[number] is not signal.SIG_IGN]
    for number in handled:
        signal.signal(number, _interrupt)
    unraisable, sys.unraisablehook = sys.unraisablehook, _interrupt_again
    try:
        yield
    finally:
        sys.unraisablehook = unraisable
        for number in handled:
            signal.signal(number, before[number] or signal.SIG_DFL)


def _interrupt(number: int, _frame: "FrameType | None") -> None:
    raise Interrupted(number)


def _interrupt_again(lost: "sys.UnraisableHookArgs") -> None:
    """Send a signal again that arrived in a destructor, where exceptions are lost."""
    if isinstance(lost.exc_value, Interrupted):
        threading.Timer(_AGAIN, os.kill, (os.getpid(), lost.exc_value.number)).start()
    else:
        sys.__unraisablehook__(lost)


def _forget_output() -> None:
    """Redirect the output to the null device, so that the interpreter does not flush it at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
