"""Which of several pages commands: the first one, until it hands over or is closed."""

from __future__ import annotations

import attrs

# A page that is asked for control and says nothing for so long hands it over [s].
_TIMEOUT = 10.0


@attrs.define
class _Request:
    """A page asks for control.

    Attributes:
        page: its number.
        until: when it gets control without an answer.
    """

    page: int
    until: float


class Control:
    """The open pages, and the one that has control.

    Attributes:
        page: number of the page that has control; None without pages.
    """

    def __init__(self) -> None:
        """Begin without pages."""
        self.page: int | None = None
        self._pages: list[int] = []
        self._request: _Request | None = None

    def open(self, page: int) -> None:
        """Take note of a page; the first has control."""
        self._pages.append(page)
        if self.page is None:
            self.page = page

    def close(self, page: int) -> None:
        """Take note that a page is closed or lost; if it had control, another one gets it."""
        self._pages.remove(page)
        if self._request is not None and self._request.page == page:
            self._request = None
        if self.page == page:
            self.page = self._request.page if self._request is not None else next(iter(self._pages), None)
            self._request = None

    def ask(self, page: int, now: float) -> None:
        """Ask for control."""
        if page != self.page:
            self._request = _Request(page, now + _TIMEOUT)

    def answer(self, *, give: bool) -> None:
        """Hand over control to the page that asks, or keep it."""
        if self._request is not None and give:
            self.page = self._request.page
        self._request = None

    def tick(self, now: float) -> bool:
        """Hand over control where nobody has answered; return whether that was so."""
        expired = self._request is not None and now > self._request.until
        if expired:
            self.answer(give=True)
        return expired

    def state(self, page: int) -> dict[str, bool | int]:
        """Return what a page shows of it, as plain data."""
        return {
            "mine": page == self.page,
            "pages": len(self._pages),
            "asked": self._request is not None and page == self.page,
            "asking": self._request is not None and page == self._request.page,
        }
