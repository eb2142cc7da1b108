"""Open documents: their texts as they change, and the analysis of each."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from lsprotocol import types as lsp
from pygls.uris import to_fs_path

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.positions import span_of
from armwright.program.language_server.semantic_tokens import SemanticToken

if TYPE_CHECKING:
    from armwright.program.language_server.server import RloServer

# How many lines a program may have that is analysed at every change.
MAX_SHORT_LINES = 2000
# Time after the last key stroke until a program is analysed without a request: short and long programs [s].
TYPING_DELAY, LONG_TYPING_DELAY = 0.02, 0.5


class Document:
    """One open program.

    Attributes:
        uri: as the editor calls it.
        path: of its file; None where it has none.
        version: as the editor counts.
        codec: of its text.
        last_analysis: the analysis of the text, or of one before; None before the first.
        sent_tokens: the number and the lines of the semantic tokens that the editor got last.
    """

    def __init__(self, server: "RloServer", item: lsp.TextDocumentItem) -> None:
        """Open a text; it is analysed on request or after a delay, then its diagnostics are published."""
        self._server, self.uri, self.version = server, item.uri, item.version
        self.codec = PositionCodec(item.text, server.encoding)
        path = to_fs_path(item.uri) if item.uri.startswith("file:") else None
        self.path = None if path is None else Path(path)
        self.last_analysis: Analysis | None = None
        self.sent_tokens: tuple[str, Sequence[list[SemanticToken]]] = "", ()
        self._outdated = True
        self._timer: asyncio.TimerHandle | None = None
        self._published = asyncio.Event()
        self.invalidate()

    @property
    def text(self) -> str:
        """The text as it is now."""
        return self.codec.text

    @property
    def name(self) -> str:
        """What a message calls it."""
        return self.path.name if self.path is not None else self.uri.rpartition("/")[2]

    @property
    def _is_short(self) -> bool:
        """Whether it is analysed at every change."""
        return len(self.codec.line_starts) <= MAX_SHORT_LINES

    def change(self, changes: Sequence[lsp.TextDocumentContentChangeEvent], version: int) -> None:
        """Apply changes one by one; a change without a range replaces the entire text."""
        for change in changes:
            text, replaced = self.text, Span(0, len(self.text))
            if isinstance(change, lsp.TextDocumentContentChangePartial):
                replaced = span_of(self.codec, change.range)
            self.codec = PositionCodec(text[: replaced.start] + change.text + text[replaced.end :], self.codec.encoding)
        self.version = version
        self.invalidate()

    def invalidate(self) -> None:
        """Mark the analysis as outdated: the text has changed, or what it depends on."""
        self._outdated = True
        self._published.clear()
        self._stop_timer()
        pause = TYPING_DELAY if self._is_short else LONG_TYPING_DELAY
        self._timer = asyncio.get_running_loop().call_later(pause, self.publish)

    def analyse(self) -> Analysis:
        """Return the analysis of the text as it is now."""
        if self._outdated or self.last_analysis is None:
            self.last_analysis, self._outdated = self._server.analyse(self), False
        return self.last_analysis

    def publish(self) -> None:
        """Publish the diagnostics of the current text."""
        self._stop_timer()
        self._server.publish(self, self.analyse())
        self._published.set()

    def close(self) -> None:
        """Analyse and publish nothing more."""
        self._stop_timer()
        self._published.set()

    async def analysis(self) -> Analysis:
        """Return the analysis of the text as it is now; that of a long program comes when nothing more is typed."""
        if not self._is_short:
            await self._published.wait()
        return self.analyse()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
