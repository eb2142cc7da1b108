"""Open documents: their texts as they change, and what is known of them, worked out beside the conversation."""

import asyncio
import gc
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import attrs

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analyse import Settings, analyse
from armwright.program.language_server.analysis import Analysis, View
from armwright.program.language_server.cell_lookup import Cells
from armwright.program.language_server.edit_map import NO_DRIFT
from armwright.program.language_server.semantic_tokens import Stretch, line_stretches

# How long nothing has to be typed before a program is looked at as a whole, short and long ones [s].
SETTLED, SETTLED_LONG = 0.02, 0.15
# How long nothing has to be asked before what is no longer needed is looked for, which stops everything else [s].
IDLE = 10.0
# What takes longer is not waited for where an answer from before the last changes will do [s].
PATIENCE = 0.06


@attrs.frozen
class Changed:
    """A change as an editor tells it: lines and columns from 0; without a start the text is all new."""

    text: str
    start: tuple[int, int] | None = None
    end: tuple[int, int] = (0, 0)


@attrs.define(slots=False, kw_only=True, eq=False)
class Known:
    """What is known of one text of a document.

    Attributes:
        analysis: all of it.
        encoding: of the editor's columns.
        said: what is wrong, in the words of the conversation.
        problem: why the cell of the settings could not be read; empty if it could.
        cost: how long it took to find out [s].
    """

    analysis: Analysis
    encoding: str
    said: Sequence[Any] = ()
    problem: str = ""
    cost: float = 0.0

    @cached_property
    def stretches(self) -> list[list[Stretch]]:
        """The coloured stretches of each line."""
        return line_stretches(self.analysis, self.encoding)


class Office:
    """What the documents share.

    Attributes:
        encoding: of the editor's columns.
        settings: how programs are to be read.
        cells: those read so far.
        said: what is wrong with a program, in the words of the conversation.
        found_out: told of every document whose text, as it is now, has been looked at as a whole.
        failed: told of what should not have happened.
    """

    def __init__(
        self,
        encoding: str,
        said: Callable[[Analysis, PositionCodec, str], Sequence[Any]],
        found_out: "Callable[[Document, Known], None]",
        failed: Callable[[Exception], None],
    ) -> None:
        """Start with the settings that hold where none are made."""
        self.encoding = encoding
        self.said = said
        self.settings = Settings()
        self.cells = Cells()
        self.found_out, self.failed = found_out, failed
        # One at a time: two would take twice as long each.
        self.worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="analysis")
        self._idle: asyncio.TimerHandle | None = None

    def look(self, name: str, uri: str, ruler: PositionCodec, folder: Path | None) -> Known:
        """Find out all there is to know of a text."""
        begin = time.perf_counter()
        # All that is made here stays: to look through it for what can go costs as much as making it.
        gc.disable()
        try:
            done = analyse(name, ruler.text, folder, self.cells, self.settings)
            known = Known(analysis=done.analysis, encoding=self.encoding, problem=done.problem)
            known.said = self.said(done.analysis, ruler, uri)
            _ = known.stretches
        finally:
            gc.freeze()
            gc.enable()
        known.cost = time.perf_counter() - begin
        return known

    def rest(self) -> None:
        """Look for what is no longer needed when nothing changes for a while: each analysis leaves some of that."""
        if self._idle is not None:
            self._idle.cancel()
        self._idle = asyncio.get_running_loop().call_later(IDLE, _tidy)


def _let_go(known: list[Known]) -> None:
    """Give up what is known of an earlier text part by part: all at once would keep others waiting."""
    analysis = known.pop().analysis
    program = analysis.compiled.tree
    parts = [analysis.compiled.tokens, program.statements, program.headers, *analysis.__dict__.values()]
    del analysis, program
    while parts:
        parts.pop()


def _tidy() -> None:
    gc.unfreeze()
    gc.collect()
    gc.freeze()


class Document:
    """One open program.

    Attributes:
        uri: as the editor calls it.
        version: as the editor counts.
    """

    def __init__(self, office: Office, uri: str, path: Path | None, text: str, version: int | None) -> None:
        """Take up a text; nothing is known of it yet."""
        self.uri, self.version = uri, version
        self._office, self._path = office, path
        self.ruler = PositionCodec(text, office.encoding)
        # Changes of the text, of settings or of cell files so far, and how many of them are known.
        self._changes, self._seen = 1, 0
        self._known: Known | None = None
        # What has changed since the text that is known, and since the one that is being looked at.
        self._drift = self._since = NO_DRIFT
        self._view: View | None = None
        self._running: asyncio.Task[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._closed = False
        self.start()

    @property
    def text(self) -> str:
        """The text as it is now."""
        return self.ruler.text

    @property
    def name(self) -> str:
        """What a message calls it."""
        return self._path.name if self._path is not None else self.uri.rpartition("/")[2]

    def change(self, changes: Sequence[Changed], version: int | None) -> None:
        """Make changes, one after the other."""
        for change in changes:
            ruler = self.ruler
            start = 0 if change.start is None else ruler.offset(*change.start)
            end = len(ruler.text) if change.start is None else max(start, ruler.offset(*change.end))
            self.ruler = ruler.changed(start, end, change.text)
            self._drift = self._drift.then(start, end, len(change.text))
            self._since = self._since.then(start, end, len(change.text))
        self.version = version
        self.outdate()

    def outdate(self) -> None:
        """Take what is known for old; find it out again when nothing else changes for a while."""
        self._changes += 1
        self._view = None
        self._stop_timer()
        if not self._closed:
            self._timer = asyncio.get_running_loop().call_later(self._settled, self.start)

    def close(self) -> None:
        """Ask nothing more."""
        self._closed = True
        self._stop_timer()

    def start(self) -> "asyncio.Task[None]":
        """Begin to find out all there is to know, unless that is under way."""
        self._stop_timer()
        if self._running is None or self._running.done():
            self._running = asyncio.get_running_loop().create_task(self._find_out())
        return self._running

    async def known(self, *, exact: bool = False) -> tuple[Known, View]:
        """Return what is known, and the text as it is now seen with that.

        Args:
            exact: whether what is known of an earlier text will not do.
        """
        while self._known is None or self._seen != self._changes:
            if self._known is not None and not exact and self._known.cost > PATIENCE:
                break
            # Others may wait for the same: one who gives up does not end it.
            await asyncio.wait((self.start(),))
        known = self._known
        if self._view is None or self._view.analysis is not known.analysis:
            self._view = View(self.text, known.analysis, self._drift)
        return known, self._view

    async def _find_out(self) -> None:
        office, changes, loop = self._office, self._changes, asyncio.get_running_loop()
        self._since = NO_DRIFT
        folder = None if self._path is None else self._path.parent
        old = [] if self._known is None else [self._known]
        try:
            look = partial(office.look, self.name, self.uri, self.ruler, folder)
            self._known = await loop.run_in_executor(office.worker, look)
            self._drift = self._since
        except Exception as error:  # noqa: BLE001 - a conversation goes on, whatever happens in it
            office.failed(error)
            if self._known is None:
                self._known = office.look(self.name, self.uri, PositionCodec("", office.encoding), None)
                self._drift = NO_DRIFT.then(0, 0, len(self.text))
        if old and old[0] is not self._known:
            office.worker.submit(_let_go, old)
        self._seen = changes
        office.rest()
        if changes == self._changes and not self._closed:
            office.found_out(self, self._known)
        elif not self._closed and self._timer is None:
            self._timer = loop.call_later(self._settled, self.start)

    @property
    def _settled(self) -> float:
        return SETTLED_LONG if self._known is not None and self._known.cost > PATIENCE else SETTLED

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
