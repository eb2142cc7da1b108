"""What the commands of pages do: to the arms, and to which page commands them."""

from __future__ import annotations

import math
from functools import singledispatchmethod
from typing import Any

import attrs

from armwright.errors import ArmwrightError
from armwright.studio import messages
from armwright.studio.messages import MessageError, read_message
from armwright.studio.workbench import Workbench

# Jogging stops so long after the latest message that keeps it going [s].
_JOG_TIMEOUT = 0.25
# A page that is asked for control and says nothing for so long hands it over [s].
_REQUEST_TIMEOUT = 10.0


@attrs.define
class _Request:
    """A page asks another one for control.

    Attributes:
        page: its number.
        until: when it gets control without an answer.
    """

    page: int
    until: float


class Studio:
    """A workbench, and the pages that command it.

    Attributes:
        workbench: what is commanded.
        controlling_page: number of the page that has control; None without pages.
    """

    def __init__(self, workbench: Workbench) -> None:
        """Take a workbench that no page commands yet."""
        self.workbench = workbench
        self.controlling_page: int | None = None
        self._pages: list[int] = []
        self._request: _Request | None = None
        # Why the latest command of a page was not done.
        self._refusals: dict[int, str] = {}
        # What is being jogged, and until when.
        self._jog: messages.Jog | None = None
        self._jog_until = -math.inf

    # ---- pages ---------------------------------------------------------------------------------------------------

    def page_opened(self, number: int) -> None:
        """Take note of a page; the first has control."""
        self._pages.append(number)
        if self.controlling_page is None:
            self.controlling_page = number

    def page_closed(self, number: int) -> None:
        """Take note that a page is closed or lost: what it jogged stops, and another page gets control."""
        self._pages.remove(number)
        self._refusals.pop(number, None)
        if self._request is not None and self._request.page == number:
            self._request = None
        if self.controlling_page == number:
            self._jog = None
            heir = self._request.page if self._request is not None else next(iter(self._pages), None)
            self.controlling_page, self._request = heir, None

    # ---- commands ------------------------------------------------------------------------------------------------

    def receive(self, text: str | bytes, page: int, now: float) -> bool:
        """Do what a page asks for; return whether anything may have changed.

        Args:
            text: its message.
            page: its number.
            now: the time [s].
        """
        try:
            command = read_message(text)
            if isinstance(command, messages.Got):
                return False
            if page != self.controlling_page and not isinstance(command, messages.AskForControl):
                raise MessageError("another page has control; ask for it")  # noqa: TRY301
            if not self.workbench.ready:
                raise MessageError("the equations of the arm are being compiled; a moment, please")  # noqa: TRY301
            self._do(command, page, now)
            self._refusals.pop(page, None)
        except ArmwrightError as error:
            self._refusals[page] = str(error)
        return True

    @singledispatchmethod
    def _do(self, command: Any, page: int, now: float) -> None:
        raise AssertionError(f"no handler of {command!r}")

    @_do.register
    def _(self, command: messages.SetJoint, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.set_joint(command.arm, command.joint, command.value, now)

    @_do.register
    def _(self, command: messages.SetJoints, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.set_joints(command.arm, command.q, now)

    @_do.register
    def _(self, command: messages.MoveTool, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.move_tool(command.arm, command.pose, now, leaping=command.leaping)

    @_do.register
    def _(self, command: messages.Jog, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.arm(command.arm)
        if not 0 < command.share <= 1:
            raise MessageError(f"jog.share: expected above 0 to 1, got {command.share:g}")
        self._jog, self._jog_until = command, now + _JOG_TIMEOUT

    @_do.register
    def _(self, command: messages.Halt, page: int, now: float) -> None:  # noqa: ARG002
        self._jog = None

    @_do.register
    def _(self, command: messages.TakeSolution, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.take_solution(command.arm, command.number, now)

    @_do.register
    def _(self, command: messages.Grip, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.grip(command.arm, open_it=command.open, now=now)

    @_do.register
    def _(self, command: messages.Undo, page: int, now: float) -> None:  # noqa: ARG002
        self.workbench.undo()

    @_do.register
    def _(self, command: messages.AskForControl, page: int, now: float) -> None:  # noqa: ARG002
        if page != self.controlling_page:
            self._request = _Request(page, now + _REQUEST_TIMEOUT)

    @_do.register
    def _(self, command: messages.AnswerRequest, page: int, now: float) -> None:  # noqa: ARG002
        if self._request is not None and command.give:
            self._jog, self.controlling_page = None, self._request.page
        self._request = None

    # ---- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float, seconds: float) -> bool:
        """Let what moves by itself go on for a time [s]; return whether anything has changed."""
        changed = False
        if self._request is not None and now > self._request.until:
            self._jog, self.controlling_page, self._request = None, self._request.page, None
            changed = True
        jog = self._jog
        if jog is None:
            return changed
        if now > self._jog_until:
            self._jog = None
            return changed
        try:
            self.workbench.jog(jog.arm, jog.frame, jog.axis, jog.way * jog.share * seconds, now)
        except ArmwrightError as error:
            if self.controlling_page is not None:
                self._refusals[self.controlling_page] = str(error)
        return True

    def state(self, page: int) -> dict[str, Any]:
        """Return what a page shows, as plain data."""
        control = {
            "mine": page == self.controlling_page,
            "pages": len(self._pages),
            "asked": self._request is not None and page == self.controlling_page,
            "asking": self._request is not None and page == self._request.page,
        }
        return {**self.workbench.state(), "refusal": self._refusals.get(page, ""), "control": control}
