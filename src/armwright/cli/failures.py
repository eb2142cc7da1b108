"""How a command ends that could not do what was asked: one message, or one JSON document, and its exit status."""

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
from armwright.cli.output import print_json
from armwright.cli.terminal import cleaned
from armwright.errors import ArmwrightError, CheckFailedError, DoubtfulError, ExitStatus, FileFormatError, shortened
from armwright.files.output import WRITTEN

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

# Set to anything, an error of our own shows where it arose.
DEBUG = "ARMWRIGHT_DEBUG"
# What a wrong call raises: a base of all such errors of Typer, whose place depends on its version.
_CallError: type[Exception] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
_OUTPUTS = ("-o", "--output")
# How an output answers that cannot be written; such errors name no file.
_OUTPUT_FAILS = {
    errno.EPIPE,
    errno.ENOSPC,
    errno.EDQUOT,
    errno.EFBIG,
    errno.EIO,
    errno.EBADF,
    errno.ENXIO,
    errno.EINVAL,
}
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
# How long a signal waits that nobody has heard [s].
_AGAIN = 0.02


class Interrupted(BaseException):
    """A signal asks the command to end; an exception of our own, since Typer takes KeyboardInterrupt for itself."""

    def __init__(self, number: int) -> None:
        """Keep the number of the signal."""
        self.number = number
        super().__init__(number)


class _Raised(BaseException):
    """Carries past Typer an error that it would end on by itself."""

    def __init__(self, error: Exception) -> None:
        self.error = error


class Commands(Group):
    """All commands; what they raise arrives in ``main`` whatever it is."""

    def make_context(self, *arguments: Any, **settings: Any) -> Any:
        """Read the options before the command."""
        try:
            _refuse_nameless_output(sys.argv[1:])
            return super().make_context(*arguments, **settings)
        except _CallError as error:
            raise _harmless(error) from None

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write what can be asked for, without Rich, which takes longer than all else."""
        self.format_usage(ctx, formatter)
        for paragraph in (self.help or "").split("\n\n"):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(paragraph.replace("**", "").replace("`", ""))
        self.format_options(ctx, formatter)

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write the commands, each with the whole of its first sentence."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, (self.commands[name].help or "").split("\n\n")[0]) for name in self.commands])

    def invoke(self, ctx: Any) -> Any:
        """Call the command that was asked for."""
        try:
            return super().invoke(ctx)
        except _CallError as error:
            raise _harmless(error) from None
        except (EOFError, OSError) as error:
            raise _Raised(error) from error


def _refuse_nameless_output(words: list[str]) -> None:
    """Refuse an output without a name, which a path would take for the current folder: a variable was not set."""
    for word, after in itertools.pairwise([*words, "-"]):
        if (word in _OUTPUTS and not after) or word in {f"{option}=" for option in _OUTPUTS}:
            raise typer.BadParameter("expected a path, got an empty text", param_hint=word.rstrip("="))


def _harmless(error: Exception) -> Exception:
    """Return what is said of a wrong call without what a terminal would obey: Typer shows it in colours by itself."""
    for name, value in vars(error).items():
        if isinstance(value, str):
            setattr(error, name, cleaned(value))
        elif isinstance(value, list | tuple) and all(isinstance(one, str) for one in value):
            setattr(error, name, [cleaned(one) for one in value])
    return error


def run_and_exit(app: "Callable[..., Any]") -> None:
    """Run the command line and end with its status; an error becomes a message, under ``--json`` a document."""
    as_json = _read_by_a_program(sys.argv[1:])
    try:
        status = _status(app, as_json=as_json)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader of our output has gone (as in `armwright show ur5 | head`): nothing is left to say.
        _forget_output()
        status = ExitStatus.BROKEN_PIPE
    except OSError as error:
        _forget_output()
        print(f"armwright: cannot write the output: {error.strerror or error}", file=sys.stderr)
        status = ExitStatus.FILE
    sys.exit(status)


def _read_by_a_program(words: list[str]) -> bool:
    """Whether JSON is asked for."""
    return "--json" in words or "--format=json" in words or ("--format", "json") in itertools.pairwise(words)


def _status(app: "Callable[..., Any]", *, as_json: bool) -> int:
    """Run the command line; return its exit status, what is wrong having been told.

    Raises:
        OSError: the output cannot be written; a ``BrokenPipeError``: nobody reads it any more.
    """
    try:
        # Typer shows a wrong call itself, with the usage of the command, unless a program reads along.
        with _interruptible():
            return int(app(standalone_mode=not as_json, prog_name=NAME) or ExitStatus.DONE)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):
            # Rich has met it, and ended with a status of its own.
            raise end.__context__ from None
        return end.code if isinstance(end.code, int) else ExitStatus.DONE
    except _Raised as raised:
        error: BaseException = raised.error
    except (Exception, Interrupted) as other:  # noqa: BLE001 - all that is not foreseen is our fault, and told as such
        error = other
    if isinstance(error, OSError) and error.filename is None and error.errno in _OUTPUT_FAILS:
        raise error
    status, message = _judged(error)
    # Of a check that failed, and of a doubtful result, the document is printed already: what was found.
    if as_json and not isinstance(error, CheckFailedError | DoubtfulError):
        print_json(failure_data(status, error, message))
    else:
        print(f"armwright: {message}", file=sys.stderr)
    return status


def _judged(error: BaseException) -> tuple[int, str]:
    """Return with which status an error ends a command, and what is said."""
    match error:
        case ArmwrightError():
            return error.exit_status, str(error)
        case _CallError():
            return ExitStatus.USAGE, error.format_message()  # type: ignore[attr-defined]
        case Interrupted():
            # A command that leaves something behind says so in a note.
            written = ", ".join(f"'{folder}'" for folder in WRITTEN)
            said = f"the results are written: {written}" if written else "nothing was written"
            notes = getattr(error, "__notes__", [said])
            return 128 + error.number, "; ".join(["interrupted", *notes])
        case OSError():
            gone = "the current folder" if error.errno == errno.ENOENT else "a file"
            what = gone if error.filename is None else f"'{error.filename}'"
            return ExitStatus.FILE, f"cannot read or write {what}: {error.strerror or error}"
        case MemoryError():
            return ExitStatus.INFEASIBLE, "this takes more memory than there is"
        case _:
            return ExitStatus.INTERNAL_ERROR, _our_fault(error)


def failure_data(status: int, error: BaseException, message: str) -> dict[str, Any]:
    """Return an error as the document that ``--json`` prints.

    Args:
        status: the exit status.
        error: what was raised.
        message: what is said of it.
    """
    details: dict[str, Any] = {"class": type(error).__name__, "message": message}
    if isinstance(error, FileFormatError):
        details |= {"file": str(error.path), "line": error.line, "key": shortened(error.key) or None}
    return {"exit_status": int(status), "error": details}


def outcome(error: ArmwrightError | None) -> dict[str, Any]:
    """Return how a command ends that prints a result as JSON: its status, and what is wrong with the result."""
    if error is None:
        return {"exit_status": int(ExitStatus.DONE)}
    return failure_data(error.exit_status, error, str(error))


def _our_fault(error: BaseException) -> str:
    """Say where a defect of armwright showed, and what its user can do; with the traceback where it is asked for."""
    if os.environ.get(DEBUG):
        traceback.print_exception(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    said = f"{type(error).__name__}: {text}" if text else type(error).__name__
    return (
        f"a defect of armwright, not of what was given: {said} (in {last.name}, {Path(last.filename).name}:"
        f"{last.lineno}); please report it with the command and its files; {DEBUG}=1 shows more"
    )


@contextlib.contextmanager
def _interruptible() -> "Iterator[None]":
    """Let signals interrupt a command; before and after it there is nothing to clear up, and they end the process."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    # What `nohup` made deaf stays so.
    heard = [number for number in _SIGNALS if number is not signal.SIGHUP or before[number] is not signal.SIG_IGN]
    for number in heard:
        signal.signal(number, _interrupt)
    unraisable, sys.unraisablehook = sys.unraisablehook, _interrupt_again
    try:
        yield
    finally:
        sys.unraisablehook = unraisable
        for number in heard:
            signal.signal(number, before[number] or signal.SIG_DFL)


def _interrupt(number: int, _frame: "FrameType | None") -> None:
    raise Interrupted(number)


def _interrupt_again(lost: "sys.UnraisableHookArgs") -> None:
    """Send a signal once more that came while an object was cleared away, where exceptions go nowhere."""
    if isinstance(lost.exc_value, Interrupted):
        threading.Timer(_AGAIN, os.kill, (os.getpid(), lost.exc_value.number)).start()
    else:
        sys.__unraisablehook__(lost)


def _forget_output() -> None:
    """Keep the interpreter from writing at its end what cannot be written."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
