"""The debugger on a terminal: reads commands line by line and prints their results."""

import functools
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from armwright.cli.repl_lines import Script
from armwright.errors import ArmwrightError, ExitStatus, shortened

if TYPE_CHECKING:
    from armwright.program.api import LoadedProgram
    from armwright.program.debugger.debugger import Command
    from armwright.program.debugger.history import ProcessPath
    from armwright.program.debugger.stop_reason import Stop

_HELP = """\
n         next statement, over procedures         back      back to the previous statement
s         next statement, into procedures         tback     back by one servo tick
o         out of the procedure                    rc        back to the last breakpoint
g         next stage of a MOVE                    c         on to the next breakpoint
t [N]     on by N servo ticks                     b LINE [if CONDITION]   stop at a line
d FRAME   stop when it moves or changes           x N       delete breakpoint N
p EXPR    print a value                           set NAME = EXPR         assign a value
frames    the frame tree                          vars      all variables
where     where all processes are                 list      the program around here
th N      select process N                        q         quit
Full words are accepted too: next, step, out, stage, continue, break, print, quit.
An empty line repeats the last step. Ctrl-C stops a program that runs."""
# Commands in full, as users of other debuggers type them.
_ABBREVIATIONS = {
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
# Lines listed before and after the current line.
_LIST_CONTEXT = 5
_SLICE = 0.05
_PROMPT = "(rlo) "
# Digits of a count, or of the number of a breakpoint or process, at most.
_MAX_DIGITS = 15
_EVENT_LOG_HINT = "`armwright run -o FOLDER` writes all to events.jsonl"


class Terminal:
    """A session of the debugger on a terminal."""

    def __init__(self, loaded: "LoadedProgram") -> None:
        """Load the program."""
        from armwright.program.debugger.debugger import Debugger

        self._loaded = loaded
        assert loaded.cell is not None  # noqa: S101 - a program without a cell is not loaded
        self._debugger = Debugger(loaded.code, loaded.cell)
        self._path: ProcessPath = ()
        self._last, self._script = "", Script()
        self._interrupted = False
        self._commands: dict[str, Callable[[str], None]] = {
            **{word: functools.partial(self._resume, command) for word, command in _STEPS.items()},
            "t": self._advance_ticks,
            "b": self._break,
            "d": self._watch,
            "x": self._forget,
            "p": self._show,
            "set": self._set,
            "frames": lambda _: self._show("frames"),
            "vars": self._variables,
            "where": self._where,
            "list": self._list,
            "th": self._thread,
            "help": lambda _: print(_HELP),
        }

    def run(self) -> ExitStatus:
        """Read commands until the user quits; return the exit status of the program, 0 if it has not ended."""
        self._debugger.begin()
        self._run_to_stop()
        while True:
            try:
                line = self._read_line().strip()
            except EOFError:
                break
            if line in {"q", "quit", "exit"}:
                break
            self._execute(line or self._last)
        return ExitStatus.DONE if self._debugger.stop is None else self._debugger.stop.status

    def _read_line(self) -> str:
        if sys.stdin.isatty():
            return input(_PROMPT)
        print(_PROMPT, end="", flush=True)
        line = self._script.line(_PROMPT)
        if line is None:
            raise EOFError
        return line

    def _execute(self, line: str) -> None:
        word, _, argument = line.partition(" ")
        word = _ABBREVIATIONS.get(word, word)
        command = self._commands.get(word)
        if command is None:
            if line:
                print(f"unknown command `{word}`; `help` lists the commands")
            return
        self._last = line if word in {*_STEPS, "t"} else ""
        try:
            command(argument.strip())
        except ArmwrightError as error:
            print(error)

    # ---- execution -------------------------------------------------------------------------------------------------

    def _resume(self, command: "Command", _: str) -> None:
        self._debugger.resume(command, self._path)
        self._run_to_stop()

    def _advance_ticks(self, count: str) -> None:
        for _ in range(_parse_number(count) if count else 1):
            self._debugger.resume("tick", self._path)
            stop = self._run()
            if stop.reason != "step":
                break
        self._print_stop()

    def _run_to_stop(self) -> None:
        self._run()
        self._print_stop()

    def _run(self) -> "Stop":
        from armwright.program.vm.excerpt import MAX_TERMINAL_LINES, shorten_list

        debugger = self._debugger
        with self._interruptible():
            while True:
                stop = debugger.run_slice(_SLICE)
                news = [effect for effect in debugger.take_effects() if effect.kind not in {"PLACE", "LOCK"}]
                for text in shorten_list(
                    [f"{e.t1:9.3f} s  {e.text}" for e in news], MAX_TERMINAL_LINES, _EVENT_LOG_HINT
                ):
                    print(text)
                if self._interrupted and debugger.running:
                    stop = debugger.pause()
                if stop is not None and not debugger.running:
                    return stop

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Stop the program, not the debugger, on Ctrl-C."""

        def interrupt(_signal: int, _frame: object) -> None:
            self._interrupted = True

        self._interrupted = False
        before = signal.signal(signal.SIGINT, interrupt)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _print_stop(self) -> None:
        from armwright.program.diagnostics.render import render

        debugger, stop = self._debugger, self._debugger.stop
        assert stop is not None  # noqa: S101 - the program is stopped
        source = self._loaded.code.source
        if stop.diagnostic is not None:
            print(render([stop.diagnostic], source), end="")
        self._path = stop.path if any(process.path == stop.path for process in debugger.processes) else ()
        reason = stop.text or ("" if stop.reason in {"step", "entry"} else stop.reason)
        if stop.has_ended:
            print(f"{debugger.time:9.3f} s  the program has ended; `back` still undoes its statements")
            return
        frame = debugger.stack(self._path)[0]
        line = source.line(frame.span.start)
        print(f"{debugger.time:9.3f} s  {frame.title}, line {line}{': ' + reason if reason else ''}")
        print(f"{line:>5}  {source.line_text(line)}")

    # ---- breakpoints -----------------------------------------------------------------------------------------------

    def _break(self, argument: str) -> None:
        line, _, condition = argument.partition(" if ")
        breakpoint_ = self._debugger.add_breakpoint(_parse_number(line), condition=condition.strip())
        if breakpoint_.start is None:
            print(breakpoint_.message)
            self._debugger.remove_breakpoint(breakpoint_.number)
        else:
            print(f"breakpoint {breakpoint_.number} in line {breakpoint_.start.line}")

    def _watch(self, name: str) -> None:
        variable = self._debugger.evaluate(name, self._path).slot
        watch = self._debugger.add_watch(variable or name)
        print(f"breakpoint {watch.number}: when {name} changes")

    def _forget(self, number: str) -> None:
        if not self._debugger.remove_breakpoint(_parse_number(number)):
            print(f"there is no breakpoint {number}")

    # ---- inspection ------------------------------------------------------------------------------------------------

    def _show(self, text: str) -> None:
        variable = self._debugger.evaluate(text, self._path)
        print(f"{variable.value}  {variable.type}".rstrip())

    def _set(self, argument: str) -> None:
        name, _, text = argument.partition("=")
        variable = self._debugger.evaluate(name.strip(), self._path).slot
        if variable is None:
            print(f"cannot assign to `{name.strip()}`")
            return
        print(self._debugger.assign(variable, text.strip(), self._path).value)

    def _variables(self, _: str) -> None:
        for scope in self._debugger.scopes(self._path):
            print(scope.name)
            for variable in scope.children() if scope.children else ():
                print(f"  {variable.name} = {variable.value}  {variable.type}".rstrip())

    def _where(self, _: str) -> None:
        source = self._loaded.code.source
        for number, process in enumerate(self._debugger.processes, 1):
            mark = "*" if process.path == self._path else " "
            for frame in self._debugger.stack(process.path):
                line = source.line(frame.span.start)
                print(f"{mark}{number}  {frame.title}, line {line}: {source.line_text(line).strip()}")

    def _list(self, _: str) -> None:
        source = self._loaded.code.source
        current = source.line(self._debugger.stack(self._path)[0].span.start)
        for line in range(max(1, current - _LIST_CONTEXT), min(len(source.line_starts), current + _LIST_CONTEXT) + 1):
            print(f"{'>' if line == current else ' '}{line:>4}  {source.line_text(line)}")

    def _thread(self, number: str) -> None:
        processes = self._debugger.processes
        index = _parse_number(number)
        if not 1 <= index <= len(processes):
            print(f"expected the number of a process, 1 to {len(processes)}, got {index}")
            return
        self._path = processes[index - 1].path
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


def _parse_number(text: str) -> int:
    number = text.strip()
    if not number.isdecimal() or len(number) > _MAX_DIGITS:
        raise _NumberError(f"expected an integer, got `{shortened(number)}`")
    return int(number)
