"""Why a run stands still."""

from collections.abc import Callable
from typing import Literal, TypeAlias

import attrs

from armwright.errors import ExitStatus
from armwright.program.debugger.history import ProcessPath
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording

_End: TypeAlias = Literal["start", "end", "failed"]
Reason: TypeAlias = _End | Literal["entry", "breakpoint", "data breakpoint", "step", "exception", "pause"]


@attrs.frozen(kw_only=True)
class Stop:
    """Why a run stands still, and which process is the reason.

    Attributes:
        reason: ``start``: it was taken back as far as it goes; ``end`` and ``failed``: it is over.
        path: of the process.
        text: more for people.
        breakpoint_numbers: of the breakpoints.
        diagnostic: of ``exception`` and ``failed``: what went wrong.
        caught: of ``exception``: whether the program goes on in a RECOVER.
        recording: of ``failed``: returns all that happened up to the failure, marked with it.
    """

    reason: Reason
    path: ProcessPath = ()
    text: str = ""
    breakpoint_numbers: tuple[int, ...] = ()
    diagnostic: Diagnostic | None = None
    caught: bool = False
    recording: Callable[[], Recording] | None = attrs.field(default=None, eq=False)

    @property
    def has_ended(self) -> bool:
        """Whether the program is over."""
        return self.reason in {"end", "failed"}

    @property
    def status(self) -> ExitStatus:
        """With which status a run ends here: that of its failure, where it stands in front of one or ended with it."""
        return ExitStatus.DONE if self.diagnostic is None else RunError.exit_status
