"""Does in a browser what a tutorial on the studio says; its test and `make pictures` use this.

Bold names on such a page are the controls that its sentences tell to use. A sentence that says how is one of those
below, and a bold name in any other sentence is an error, so that all that the page tells is done.
"""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

# How long something that the page is to say may take [ms], and how long a button is held [ms].
PATIENCE, HELD = 60_000, 600
# A pause in which what is typed is sent [ms].
PAUSE = 250
NAME = r"\*\*([^*]+)\*\*"


class FollowError(Exception):
    """The studio does something else than the tutorial says."""


class Session:
    """A studio that a tutorial has started, and its page."""

    def __init__(self, command: list[str], folder: Path, browser: Any) -> None:
        """Start it in a folder and open its page, as large as for a picture.

        Args:
            command: arguments of ``armwright``.
            folder: in which it runs.
            browser: of playwright.
        """
        called = [sys.executable, "-m", "armwright", *command]
        self._process = subprocess.Popen(called, cwd=folder, stdout=subprocess.PIPE, text=True)  # noqa: S603 - our own
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        self.address = self._process.stdout.readline().strip()
        self._page = browser.new_page(viewport={"width": 1280, "height": 860}, color_scheme="light")
        self._downloads: list[str] = []
        self._page.on("download", lambda download: self._downloads.append(download.suggested_filename))
        self._page.goto(self.address)
        self._until(lambda: self._page.evaluate("Boolean(window.studio?.live.state?.ready)"), "the page is ready")

    def __enter__(self) -> Self:
        """Return it."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it, as Ctrl-C does."""
        self._page.close()
        self._process.terminate()
        self._process.wait(10)
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        self._process.stdout.close()

    def follow(self, text: str, take: Callable[[str, bytes], object] = lambda *_: None) -> int:
        """Do what a part of a tutorial says, in its order; return how much that was.

        Args:
            text: the part.
            take: gets the name of a picture that the tutorial shows, and what the page looks like there.

        Raises:
            FollowError: the page does not say what the tutorial says, or a sentence tells nothing that can be done.
        """
        sentences: dict[str, Callable[..., object]] = {
            rf"`([^`]+)` into {NAME}": self._type,
            rf"[Cc]hoose `([^`]+)` at {NAME}": self._choose,
            rf"[Cc]lick {NAME}": lambda name: self._button(name).click(),
            r"[Cc]lick the number of line (\d+)": self._break,
            rf"[Oo]pen the tab {NAME}": lambda name: self._page.get_by_role("tab", name=name).click(),
            rf"[Tt]ick {NAME}": lambda name: self._field(name).check(),
            rf"[Hh]old {NAME}": self._hold,
            rf"[Pp]oint at {NAME} beside {NAME}": self._point,
            r"[Pp]ut the cursor into line (\d+)": self._put_cursor,
            rf"{NAME} shows `([^`]+)`": self._field_shows,
            r"[Tt]he page says `([^`]+)`": self._says,
            r"[Tt]he browser keeps `([^`]+)`": self._keeps,
            r"[Tt]ype this into the editor:\n\n```text\n(.*?)```": self._write,
            r"[Tt]he editor shows:\n\n```text\n(.*?)```": lambda told: self._shows("#text", told),
            r"[Tt]he change of the cell file is:\n\n```text\n(.*?)```": lambda told: self._shows("#change", told),
            r"!\[[^\]]*\]\(\.\./pictures/([\w.-]+)\)": lambda name: take(name, self._photo()),
        }
        found = [(it, do) for pattern, do in sentences.items() for it in re.finditer(pattern, text, re.DOTALL)]
        done = sorted(found, key=lambda it: it[0].start())
        for bold in re.finditer(NAME, text):
            if not any(it.start() <= bold.start() < it.end() for it, _ in done):
                raise FollowError(f"nothing is told to be done with {bold[0]}")
        for it, do in done:
            do(*it.groups())
            self._settle()
        return len(done)

    # ---- what sentences say --------------------------------------------------------------------------------------

    def _type(self, value: str, name: str) -> None:
        row = self._page.locator(".slider").filter(has_text=re.compile(rf"^{re.escape(name)}\b"))
        field = row.locator("input[type=text]") if row.count() else self._field(name)
        field.fill(value)
        if row.count():
            field.press("Enter")

    def _choose(self, value: str, name: str) -> None:
        self._field(name).select_option(label=value)

    def _break(self, line: str) -> None:
        self._page.get_by_role("button", name=f"Breakpoint in line {line}", exact=True).click()

    def _hold(self, name: str) -> None:
        self._button(name).hover()
        self._page.mouse.down()
        self._page.wait_for_timeout(HELD)
        self._page.mouse.up()

    def _point(self, name: str, row: str) -> None:
        item = self._page.locator(f'#frames li[data-name="{row}"]')
        item.get_by_role("button", name=name, exact=True).hover()

    def _put_cursor(self, line: str) -> None:
        place = "([field, line]) => field.value.split('\\n').slice(0, line - 1).join('\\n').length + (line > 1)"
        field = self._page.locator("#text").element_handle()
        offset = self._page.evaluate(place, [field, int(line)])
        self._page.evaluate("([field, at]) => { field.focus(); field.setSelectionRange(at, at); }", [field, offset])

    def _write(self, text: str) -> None:
        self._page.locator("#text").fill(text)

    def _says(self, text: str) -> None:
        body = self._page.locator("body")
        self._until(lambda: text in " ".join(body.inner_text().split()), f"the page says {text!r}")

    def _field_shows(self, name: str, value: str) -> None:
        self._until(lambda: self._field(name).input_value() == value, f"{name} shows {value}")

    def _keeps(self, name: str) -> None:
        self._until(lambda: name in self._downloads, f"the browser keeps {name}")

    def _shows(self, field: str, told: str) -> None:
        where = self._page.locator(field)
        lines = [line.rstrip() for line in told.strip().splitlines()]

        def same() -> bool:
            got = where.input_value() if field == "#text" else where.text_content()
            return [line.rstrip() for line in got.strip().splitlines()] == lines

        self._until(same, f"{field} shows\n{told}")

    # ---- the page ------------------------------------------------------------------------------------------------

    def _button(self, name: str) -> Any:
        exactly = re.compile(rf"^\s*{re.escape(name)}\s*$")
        return self._page.locator("button:not([role=tab]):visible").filter(has_text=exactly)

    def _field(self, name: str) -> Any:
        label = self._page.locator("label:visible").filter(has_text=re.compile(rf"^\s*{re.escape(name)}\b"))
        return label.locator("input, select")

    def _photo(self) -> bytes:
        self._page.wait_for_timeout(2 * PAUSE)
        photo: bytes = self._page.screenshot()
        return photo

    def _settle(self) -> None:
        """Wait until what has been asked for is done; a map is worked out bit by bit."""
        self._page.wait_for_timeout(PAUSE)
        done = "!studio.live.awaiting && !studio.live.queue.size && (studio.map()?.done ?? true)"
        self._until(lambda: self._page.evaluate(done), "it is done")

    def _until(self, condition: Callable[[], bool], what: str) -> None:
        for _ in range(PATIENCE // 50):
            if condition():
                return
            self._page.wait_for_timeout(50)
        raise FollowError(f"it does not come about that {what}: {self._page.locator('body').inner_text()}")
