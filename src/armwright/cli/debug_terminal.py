"""The debugger on a terminal: reads commands line by line and prints their results."""

import cmd
import re
import sys
import threading
from functools import partialmethod
from typing import TYPE_CHECKING, Any, cast

from armwright.cli.repl_lines import Script, handle_interrupt
from armwright.errors import ArmwrightError, ExitStatus, InvalidValueError, one_of, shortened

if TYPE_CHECKING:
    from armwright.program.api import LoadedProgram
    from armwright.program.debugger.debugger import Command
    from armwright.program.debugger.history import ProcessPath
    from armwright.program.debugger.stop_reason import Stop
    from armwright.program.language.source import Span

_HELP = """\
n         next statement, over procedures         back      back to the previous statement
s         next statement, into procedures         tback     back by one servo tick
o         out of the procedure                    rc        back to the last breakpoint
g         next stage of a MOVE                    c         on to the next breakpoint
t [N]     on by N servo ticks                     b [FILE:]LINE [if CONDITION]   stop there
d FRAME   stop when it moves or changes           x N       delete breakpoint N
p EXPR    print a value                           set NAME = EXPR         assign a value
frames    the frame tree                          set INPUT(NAME) = 1     switch an input by hand
where     where all processes are                 vars      all variables
th N      select process N                        list      the program around here
q         quit
Full words are accepted too: next, step, out, stage, continue, break, print, quit.
An empty line repeats the last step. Ctrl-C stops a program that runs."""
# Commands that an empty line repeats.
_STEPS = frozenset(
    ["n", "next", "s", "step", "o", "out", "g", "stage", "c", "continue", "back", "tback", "rc", "t", "tick"]
)
# Lines listed before and after the current line.
_LIST_CONTEXT = 5
_SLICE = 0.05
# Digits of a count, or of the number of a breakpoint or process, at most.
_MAX_DIGITS = 15
# What of the cell can be set by hand, and what may stand for 0 and 1.
_INPUT = re.compile(r"(?:INPUT|ANALOG)\s*\(\s*(\w+)\s*\)", re.IGNORECASE)
_STATES = {"TRUE": 1.0, "FALSE": 0.0, "ON": 1.0, "OFF": 0.0}
_EVENT_LOG_HINT = "`armwright run -o FOLDER` writes all to events.jsonl"


class Terminal(cmd.Cmd):
    """A session of the debugger on a terminal; a method ``do_x`` is the command ``x``."""

    prompt = "(rlo) "

    def __init__(self, loaded: "LoadedProgram") -> None:
        """Load the program."""
        from armwright.program.debugger.debugger import Debugger

        self.use_rawinput = sys.stdin.isatty()
        super().__init__(stdin=None if self.use_rawinput else cast("Any", Script()))
        assert loaded.cell is not None  # noqa: S101 - a program without a cell is not loaded
        self._source = loaded.code.source
        self._debugger = Debugger(loaded.code, loaded.cell, hardware=loaded.hardware)
        self._path: ProcessPath = ()

    def run(self) -> ExitStatus:
        """Read commands until the user quits; return the exit status of the program, 0 if it has not ended."""
        self._debugger.begin()
        self._run_to_stop()
        self.cmdloop()
        return ExitStatus.DONE if self._debugger.stop is None else self._debugger.stop.status

    def onecmd(self, line: str) -> bool:
        """Execute a command; return whether it ends the session."""
        try:
            return super().onecmd(line.strip())
        except ArmwrightError as error:
            print(error)
            return False

    def postcmd(self, stop: bool, line: str) -> bool:
        """Remember a command for an empty line only if it is a step."""
        if line.strip() and line.split(maxsplit=1)[0] not in _STEPS:
            self.lastcmd = ""
        return stop

    def default(self, line: str) -> None:
        """Refuse an unknown command."""
        print(f"unknown command `{line.partition(' ')[0]}`; `help` lists the commands")

    def do_help(self, _: str) -> None:
        """List the commands."""
        print(_HELP)

    def do_q(self, _: str) -> bool:
        """End the session."""
        return True

    do_quit = do_exit = do_EOF = do_q

    # ---- execution -------------------------------------------------------------------------------------------------

    def _resume(self, _: str, command: "Command") -> None:
        self._debugger.resume(command, self._path)
        self._run_to_stop()

    do_n = do_next = partialmethod(_resume, command="next")
    do_s = do_step = partialmethod(_resume, command="in")
    do_o = do_out = partialmethod(_resume, command="out")
    do_g = do_stage = partialmethod(_resume, command="stage")
    do_c = do_continue = partialmethod(_resume, command="continue")
    do_back = partialmethod(_resume, command="back")
    do_tback = partialmethod(_resume, command="tick back")
    do_rc = partialmethod(_resume, command="reverse")

    def do_t(self, count: str) -> None:
        """Advance by servo ticks, to the first stop."""
        for _ in range(_parse_number(count) if count else 1):
            self._debugger.resume("tick", self._path)
            if self._run().reason != "step":
                break
        self._print_stop()

    do_tick = do_t

    def _run_to_stop(self) -> None:
        self._run()
        self._print_stop()

    def _run(self) -> "Stop":
        """Run the program, print its effects, and return where it stops; Ctrl-C stops it, not the debugger."""
        from armwright.program.vm.excerpt import MAX_TERMINAL_LINES, shorten_list

        debugger, interrupted = self._debugger, threading.Event()
        with handle_interrupt(lambda *_: interrupted.set()):
            while True:
                stop = debugger.run_slice(_SLICE)
                effects = [effect for effect in debugger.take_effects() if effect.kind not in {"PLACE", "LOCK"}]
                lines = [f"{effect.t1:9.3f} s  {effect.text}" for effect in effects]
                for line in shorten_list(lines, MAX_TERMINAL_LINES, _EVENT_LOG_HINT):
                    print(line)
                if interrupted.is_set() and debugger.running:
                    stop = debugger.pause()
                if stop is not None and not debugger.running:
                    return stop

    def _print_stop(self) -> None:
        from armwright.program.diagnostics.render import render

        debugger, source, stop = self._debugger, self._source, self._debugger.stop
        assert stop is not None  # noqa: S101 - the program is stopped
        if stop.diagnostic is not None:
            print(render([stop.diagnostic], source), end="")
        self._path = stop.path if any(process.path == stop.path for process in debugger.processes) else ()
        reason = stop.text or ("" if stop.reason in {"step", "entry"} else stop.reason)
        if stop.has_ended:
            print(f"{debugger.time:9.3f} s  the program has ended; `back` still undoes its statements")
            return
        frame = debugger.stack(self._path)[0]
        place, line = source.place(frame.span.start), source.line(frame.span.start)
        print(f"{debugger.time:9.3f} s  {frame.title}, line {place}{': ' + reason if reason else ''}")
        print(f"{line:>5}  {source.line_at(frame.span.start)}")

    # ---- breakpoints -----------------------------------------------------------------------------------------------

    def do_b(self, argument: str) -> None:
        """Stop at a line of the present file or of another, perhaps only under a condition."""
        place, _, condition = argument.partition(" if ")
        name, colon, line = place.rpartition(":")
        file = self._file_number(name.strip()) if colon else self._source.file_number(self._present.start)
        breakpoint_ = self._debugger.add_breakpoint(_parse_number(line), file=file, condition=condition.strip())
        if breakpoint_.start is None:
            print(breakpoint_.message)
            self._debugger.remove_breakpoint(breakpoint_.number)
        else:
            print(f"breakpoint {breakpoint_.number} in line {self._source.place(breakpoint_.start.span.start)}")

    do_break = do_b

    @property
    def _present(self) -> "Span":
        """Where the selected process is."""
        return self._debugger.stack(self._path)[0].span

    def _file_number(self, name: str) -> int:
        """Return the file of the program with this name."""
        names = [self._source.file_path(file) for file in range(len(self._source.modules) + 1)]
        return names.index(one_of("file of the program", name, names))

    def do_d(self, name: str) -> None:
        """Stop when a frame moves or changes."""
        variable = self._debugger.evaluate(name, self._path).slot
        watch = self._debugger.add_watch(variable or name)
        print(f"breakpoint {watch.number}: when {name} changes")

    def do_x(self, number: str) -> None:
        """Delete a breakpoint."""
        if not self._debugger.remove_breakpoint(_parse_number(number)):
            print(f"there is no breakpoint {number}")

    do_delete = do_x

    # ---- inspection ------------------------------------------------------------------------------------------------

    def do_p(self, text: str) -> None:
        """Print a value."""
        variable = self._debugger.evaluate(text, self._path)
        print(f"{variable.value}  {variable.type}".rstrip())

    do_print = do_p

    def do_frames(self, _: str) -> None:
        """Print the frame tree."""
        self.do_p("frames")

    def do_set(self, argument: str) -> None:
        """Assign a value, or switch an input by hand."""
        name, _, text = argument.partition("=")
        if (found := _INPUT.fullmatch(name.strip())) is not None:
            self._debugger.set_input(found[1], _parse_state(text.strip()))
            print(self._debugger.evaluate(name.strip(), self._path).value)
            return
        variable = self._debugger.evaluate(name.strip(), self._path).slot
        if variable is None:
            print(f"cannot assign to `{name.strip()}`")
            return
        print(self._debugger.assign(variable, text.strip(), self._path).value)

    def do_vars(self, _: str) -> None:
        """Print all variables."""
        for scope in self._debugger.scopes(self._path):
            print(scope.name)
            for variable in scope.children() if scope.children else ():
                print(f"  {variable.name} = {variable.value}  {variable.type}".rstrip())

    def do_where(self, _: str) -> None:
        """Print where all processes are."""
        source = self._source
        for number, process in enumerate(self._debugger.processes, 1):
            mark = "*" if process.path == self._path else " "
            for frame in self._debugger.stack(process.path):
                place, text = source.place(frame.span.start), source.line_at(frame.span.start).strip()
                print(f"{mark}{number}  {frame.title}, line {place}: {text}")

    def do_list(self, _: str) -> None:
        """Print the program around the current line."""
        source, start = self._source, self._present.start
        current, file = source.line(start), source.file_number(start)
        for line in range(max(1, current - _LIST_CONTEXT), min(source.line_count(file), current + _LIST_CONTEXT) + 1):
            print(f"{'>' if line == current else ' '}{line:>4}  {source.line_text(line, file)}")

    def do_th(self, number: str) -> None:
        """Select a process."""
        processes = self._debugger.processes
        index = _parse_number(number)
        if not 1 <= index <= len(processes):
            print(f"expected the number of a process, 1 to {len(processes)}, got {index}")
            return
        self._path = processes[index - 1].path
        self.do_where("")


def _parse_state(text: str) -> float:
    """Return the value of an input."""
    try:
        return _STATES[text.upper()] if text.upper() in _STATES else float(text)
    except ValueError:
        raise InvalidValueError(f"expected TRUE, FALSE or a number, got `{shortened(text)}`") from None


def _parse_number(text: str) -> int:
    number = text.strip()
    if not number.isdecimal() or len(number) > _MAX_DIGITS:
        raise InvalidValueError(f"expected an integer, got `{shortened(number)}`")
    return int(number)
