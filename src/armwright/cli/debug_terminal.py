"""The debugger on a terminal: a line of command, an answer."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from armwright.cli.repl_lines import Script
from armwright.errors import ArmwrightError, ExitStatus, shortened

if TYPE_CHECKING:
    from armwright.program.debugger.dap_session import Loaded
    from armwright.program.debugger.debugger import Command
    from armwright.program.debugger.history import Path
    from armwright.program.debugger.stop_reason import Stop

_HELP = """\
n         next statement, over procedures         back      back to the statement before
s         next statement, into procedures         tback     back by one servo tick
o         out of the procedure                    rc        back to the last breakpoint
g         next stage of a MOVE                    c         on to the next breakpoint
t [N]     on by N servo ticks                     b LINE [if CONDITION]   stop at a line
d FRAME   stop when it moves or changes           x N       forget breakpoint N
p EXPR    a value                                 set NAME = EXPR         another value
frames    the tree of frames                      vars      all variables
where     where all processes are                 list      the program around here
th N      look at process N                       q         leave
Whole words do as well: next, step, out, stage, continue, break, print, quit.
An empty line repeats the last step. Ctrl-C stops a program that runs."""
# What users of other debuggers type.
_WHOLE_WORDS = {
    "next": "n",
    "step": "s",
    "out": "o",
    "stage": "g",
    "continue": "c",
    "tick": "t",
    "break": "b",
    "print": "p",
    "delete": "x",
}
# Lines shown around the present one.
_AROUND = 5
_SLICE = 0.05
_PROMPT = "(rlo) "
# No count, and no number of a breakpoint or process, has more.
_MOST_DIGITS = 15
_ALL_OF_IT = "`armwright run -o FOLDER` keeps all in events.jsonl"


class Terminal:
    """A session on a terminal."""

    def __init__(self, loaded: "Loaded") -> None:
        """Load the program."""
        from armwright.program.debugger.debugger import Debugger

        self._loaded = loaded
        self._debugger = Debugger(loaded.code, loaded.cell)
        self._path: Path = ()
        self._last, self._script = "", Script()
        self._interrupted = False
        self._commands: dict[str, Callable[[str], None]] = {
            **{word: self._going(command) for word, command in _STEPS.items()},
            "t": self._ticks,
            "b": self._break,
            "d": self._watch,
            "x": self._forget,
            "p": self._print,
            "set": self._set,
            "frames": lambda _: self._show("frames"),
            "vars": self._variables,
            "where": self._where,
            "list": self._list,
            "th": self._thread,
            "help": lambda _: print(_HELP),
        }

    def run(self) -> ExitStatus:
        """Read commands until the user leaves; return how the program has ended, or that it has not."""
        self._debugger.begin()
        self._finish()
        while True:
            try:
                line = self._line().strip()
            except EOFError:
                break
            if line in {"q", "quit", "exit"}:
                break
            self._do(line or self._last)
        return ExitStatus.DONE if self._debugger.stop is None else self._debugger.stop.status

    def _line(self) -> str:
        if sys.stdin.isatty():
            return input(_PROMPT)
        print(_PROMPT, end="", flush=True)
        line = self._script.line(_PROMPT)
        if line is None:
            raise EOFError
        return line

    def _do(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        word = _WHOLE_WORDS.get(word, word)
        command = self._commands.get(word)
        if command is None:
            if line:
                print(f"no command `{word}`; `help` lists them")
            return
        self._last = line if word in {*_STEPS, "t"} else ""
        try:
            command(rest.strip())
        except ArmwrightError as error:
            print(error)

    # ---- going on --------------------------------------------------------------------------------------------------

    def _going(self, command: "Command") -> Callable[[str], None]:
        def go(_: str) -> None:
            self._debugger.resume(command, self._path)
            self._finish()

        return go

    def _ticks(self, count: str) -> None:
        for _ in range(_number(count) if count else 1):
            self._debugger.resume("tick", self._path)
            stop = self._work()
            if stop.reason != "step":
                break
        self._tell()

    def _finish(self) -> None:
        self._work()
        self._tell()

    def _work(self) -> "Stop":
        from armwright.program.vm.excerpt import ON_A_TERMINAL, listed

        debugger = self._debugger
        with self._interruptible():
            while True:
                stop = debugger.work(_SLICE)
                news = [one for one in debugger.news() if one.kind not in {"PLACE", "LOCK"}]
                for text in listed([f"{one.t1:9.3f} s  {one.text}" for one in news], ON_A_TERMINAL, _ALL_OF_IT):
                    print(text)
                if self._interrupted and debugger.running:
                    stop = debugger.pause()
                if stop is not None and not debugger.running:
                    return stop

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Let Ctrl-C stop the program, not the debugger."""

        def interrupt(_signal: int, _frame: object) -> None:
            self._interrupted = True

        self._interrupted = False
        before = signal.signal(signal.SIGINT, interrupt)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _tell(self) -> None:
        from armwright.program.diagnostics.render import render

        debugger, stop = self._debugger, self._debugger.stop
        assert stop is not None  # noqa: S101 - it stands still
        source = self._loaded.code.source
        if stop.diagnostic is not None:
            print(render([stop.diagnostic], source), end="")
        self._path = stop.path if any(one.path == stop.path for one in debugger.processes) else ()
        reasons = {"step": "", "entry": ""}
        why = stop.text or reasons.get(stop.reason, stop.reason)
        if stop.over:
            print(f"{debugger.time:9.3f} s  the program is over; it can still be taken back")
            return
        frame = debugger.stack(self._path)[0]
        line = source.line(frame.span.start)
        print(f"{debugger.time:9.3f} s  {frame.title}, line {line}{': ' + why if why else ''}")
        print(f"{line:>5}  {source.line_text(line)}")

    # ---- breakpoints -----------------------------------------------------------------------------------------------

    def _break(self, rest: str) -> None:
        line, _, condition = rest.partition(" if ")
        found = self._debugger.break_at(_number(line), condition=condition.strip())
        if found.start is None:
            print(found.message)
            self._debugger.forget(found.number)
        else:
            print(f"breakpoint {found.number} in line {found.start.line}")

    def _watch(self, name: str) -> None:
        kept = self._debugger.evaluate(name, self._path).kept
        watch = self._debugger.watch(kept or name)
        print(f"breakpoint {watch.number}: when {name} changes")

    def _forget(self, number: str) -> None:
        if not self._debugger.forget(_number(number)):
            print(f"there is no breakpoint {number}")

    # ---- looking ---------------------------------------------------------------------------------------------------

    def _print(self, text: str) -> None:
        self._show(text)

    def _show(self, text: str) -> None:
        shown = self._debugger.evaluate(text, self._path)
        print(f"{shown.value}  {shown.type}".rstrip())

    def _set(self, rest: str) -> None:
        name, _, text = rest.partition("=")
        kept = self._debugger.evaluate(name.strip(), self._path).kept
        if kept is None:
            print(f"`{name.strip()}` cannot be given a value")
            return
        print(self._debugger.assign(kept, text.strip(), self._path).value)

    def _variables(self, _: str) -> None:
        for scope in self._debugger.scopes(self._path):
            print(scope.name)
            for shown in scope.inside() if scope.inside else ():
                print(f"  {shown.name} = {shown.value}  {shown.type}".rstrip())

    def _where(self, _: str) -> None:
        source = self._loaded.code.source
        for number, process in enumerate(self._debugger.processes, 1):
            mark = "*" if process.path == self._path else " "
            for frame in self._debugger.stack(process.path):
                line = source.line(frame.span.start)
                print(f"{mark}{number}  {frame.title}, line {line}: {source.line_text(line).strip()}")

    def _list(self, _: str) -> None:
        source = self._loaded.code.source
        here = source.line(self._debugger.stack(self._path)[0].span.start)
        for line in range(max(1, here - _AROUND), min(len(source.line_starts), here + _AROUND) + 1):
            print(f"{'>' if line == here else ' '}{line:>4}  {source.line_text(line)}")

    def _thread(self, number: str) -> None:
        processes = self._debugger.processes
        at = _number(number)
        if not 1 <= at <= len(processes):
            print(f"expected 1 to {len(processes)}, the number of a process")
            return
        self._path = processes[at - 1].path
        self._where("")


_STEPS: "dict[str, Command]" = {
    "n": "next",
    "s": "in",
    "o": "out",
    "g": "stage",
    "c": "continue",
    "back": "back",
    "tback": "tick back",
    "rc": "reverse",
}


class _NumberError(ArmwrightError, ValueError):
    """A number was expected."""


def _number(text: str) -> int:
    number = text.strip()
    if not number.isdecimal() or len(number) > _MOST_DIGITS:
        raise _NumberError(f"expected a whole number, got `{shortened(number)}`")
    return int(number)
