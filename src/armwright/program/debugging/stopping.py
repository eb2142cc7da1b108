"""Why a run stands still."""

from typing import Literal, TypeAlias

import attrs

from armwright.program.debugging.timeline import Path
from armwright.program.messages.diagnostics import Diagnostic

Reason: TypeAlias = Literal[
    "entry", "breakpoint", "data breakpoint", "step", "exception", "pause", "start", "end", "failed"
]


@attrs.frozen(kw_only=True)
class Stop:
    """Why a run stands still, and which process is the reason.

    Attributes:
        reason: ``start``: it was taken back as far as it goes; ``end`` and ``failed``: it is over.
        path: of the process.
        text: more for people.
        numbers: of the breakpoints.
        diagnostic: of ``exception`` and ``failed``: what went wrong.
        caught: of ``exception``: whether the program goes on in a RECOVER.
    """

    reason: Reason
    path: Path = ()
    text: str = ""
    numbers: tuple[int, ...] = ()
    diagnostic: Diagnostic | None = None
    caught: bool = False

    @property
    def over(self) -> bool:
        """Whether the program is over."""
        return self.reason in {"end", "failed"}
