"""All that is known of one version of a program, worked out once; and the same of a text that has changed since."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping
from functools import cached_property
from itertools import accumulate
from typing import Any

import attrs

from armwright.cell.frames import FrameTree
from armwright.cell.model import Cell
from armwright.program.api import Compilation
from armwright.program.language.source import Source, Span
from armwright.program.language.words import CLOSING, OPENING
from armwright.program.language_server.edit_map import EditMap, drift
from armwright.program.language_server.symbol_index import Extents, Occurrence, extents_of, occurrences
from armwright.program.semantics.symbols import Scope
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Scanned, Token, TokenKind, scan

# How many tokens in front of a place are looked at to find out what may stand there.
_REACH = 1000
_DEEPER = {**dict.fromkeys(OPENING, 1), **dict.fromkeys(CLOSING, -1)}


@attrs.frozen(kw_only=True, slots=False, eq=False)
class Analysis:
    """What is known of a program.

    Attributes:
        compiled: the translation.
        cell: what it acts on, with what it imports; None where that is not known.
        frames: the frames of the cell at the start; None without a cell.
        files: where frames and arms are told of, by name: the URI of the file, and the line from 1.
    """

    compiled: Compilation
    cell: Cell | None = None
    frames: FrameTree | None = None
    files: Mapping[str, tuple[str, int]] = attrs.field(factory=dict)

    @property
    def text(self) -> str:
        """The text of the program."""
        return self.compiled.source.text

    @cached_property
    def extents(self) -> Extents:
        """Where the procedures stand."""
        return extents_of(self.compiled.symbols)

    @cached_property
    def occurrences(self) -> tuple[Occurrence, ...]:
        """All names, in order."""
        return occurrences(self.compiled.tokens, self.extents)

    @cached_property
    def by_key(self) -> Mapping[str, tuple[Occurrence, ...]]:
        """All occurrences of each name."""
        found: dict[str, list[Occurrence]] = {}
        for one in self.occurrences:
            found.setdefault(one.key, []).append(one)
        return {key: tuple(several) for key, several in found.items()}

    @cached_property
    def _occurrence_starts(self) -> list[int]:
        return [one.start for one in self.occurrences]

    @cached_property
    def token_starts(self) -> list[int]:
        """Where each token starts."""
        return [token.start for token in self.compiled.tokens]

    @cached_property
    def depths(self) -> list[int]:
        """Of each token, how many BEGINs and the like are open in front of it."""
        steps = (_DEEPER.get(token.key, 0) if token.kind is TokenKind.KEYWORD else 0 for token in self.compiled.tokens)
        return list(accumulate(steps, initial=0))

    @cached_property
    def statements(self) -> tuple[tree.Move | tree.Call | tree.Grasp, ...]:
        """The statements that hints are given for, in the order of the text."""
        return tuple(_hinted(self.compiled.tree))

    @cached_property
    def lower(self) -> bool:
        """Whether the program writes the words of the language in lower case."""
        first = next((token for token in self.compiled.tokens if token.kind is TokenKind.KEYWORD), None)
        return first is not None and first.text.islower()

    def prepare(self) -> None:
        """Work out beforehand what questions will ask for."""
        _ = self._occurrence_starts, self.token_starts, self.depths, self.statements, self.lower, self.by_key

    def at(self, offset: int) -> Occurrence | None:
        """Return the name at a place, or right in front of it."""
        at = bisect_right(self._occurrence_starts, offset) - 1
        return self.occurrences[at] if at >= 0 and self.occurrences[at].end >= offset else None

    def token_at(self, offset: int) -> Token | None:
        """Return the token that holds a place."""
        at = bisect_right(self.token_starts, offset) - 1
        token = self.compiled.tokens[at] if at >= 0 else None
        return token if token is not None and token.start <= offset < token.end else None

    def same(self, occurrence: Occurrence) -> tuple[Occurrence, ...]:
        """Return all occurrences of the same thing."""
        return tuple(one for one in self.by_key.get(occurrence.key, ()) if one.is_same(occurrence))

    def declaration(self, occurrence: Occurrence) -> tree.Name | None:
        """Return where the name was declared, if it was."""
        symbols = self.compiled.symbols
        if occurrence.owner is not None:
            return symbols.procedures[occurrence.owner].declared.get(occurrence.key)
        if occurrence.key in symbols.procedures:
            return symbols.procedures[occurrence.key].node.name
        return symbols.declared.get(occurrence.key)


@attrs.frozen(kw_only=True)
class Before:
    """What stands in front of a place.

    Attributes:
        tokens: the last of them, in order.
        depth: how many BEGINs and the like are open at the place.
        word: the word that is being written at the place; the place itself where there is none.
        behind: the tokens from the word on, as far as they are known.
        scope: the names that can be seen.
    """

    tokens: tuple[Token, ...]
    depth: int
    word: Span
    behind: tuple[Token, ...]
    scope: Scope


class View:
    """A text as it is now, seen with what is known of it, or of a text that it was made from.

    Attributes:
        text: as it is now.
        analysis: of this text, or of an earlier one.
        drift: what has changed between the two.
    """

    def __init__(self, text: str, analysis: Analysis, change: EditMap | None = None) -> None:
        """Take up what has changed; where that is not told, compare the texts."""
        self.text, self.analysis = text, analysis
        self.drift: EditMap = drift(analysis.text, text) if change is None else change

    @property
    def fresh(self) -> bool:
        """Whether what is known is known of the text as it is now."""
        return self.drift.none

    def old(self, offset: int) -> int | None:
        """Return where a place was in the text that is known; None for what was written since."""
        return self.drift.old(offset)

    def span(self, span: Span) -> Span | None:
        """Return where a known stretch of text is now; None where it was changed."""
        return self.drift.new_span(span)

    def before(self, offset: int) -> Before:
        """Return what stands in front of a place of the text as it is now."""
        start = offset
        while start and (self.text[start - 1].isalnum() or self.text[start - 1] in "_-"):
            start -= 1
        word = Span(_word_start(self.text, start, offset), offset)
        analysis, known = self.analysis, self.analysis.compiled.tokens
        # Right behind what was written since, that counts too.
        written_since = self.drift.start < word.start <= self.drift.new_end
        if (at := None if written_since else self.old(word.start)) is not None:
            count = bisect_left(analysis.token_starts, at)
            front: tuple[Token, ...] = known[max(0, count - _REACH) : count]
            depth = analysis.depths[count]
            behind = known[count : count + _REACH] if self.fresh else ()
        else:
            count, safe = self._unchanged()
            written = self._scanned(Span(safe, word.start)).tokens[:-1]
            front = (*known[max(0, count - _REACH) : count], *written)
            depth = analysis.depths[count] + sum(_DEEPER.get(token.key, 0) for token in written)
            behind = ()
        place = self.old(word.start)
        return Before(
            tokens=tuple(token for token in front if not _covers(token, at)) if at is not None else front,
            depth=depth,
            word=word,
            behind=behind,
            scope=analysis.extents.scope(self.drift.start if place is None else place),
        )

    def _unchanged(self) -> tuple[int, int]:
        """Return how many tokens in front of what has changed are as they were, and where the last of them ends."""
        known = self.analysis.compiled.tokens
        count = bisect_left(self.analysis.token_starts, self.drift.start)
        # The last one may have become a part of a longer one.
        while count and known[count - 1].end >= self.drift.start:
            count -= 1
        return count, known[count - 1].end if count else 0

    def _scanned(self, span: Span) -> Scanned:
        text = self.text[span.start : span.end]
        return scan(Source("", text), text, self.analysis.compiled.standard)

    def in_comment(self, offset: int) -> bool:
        """Whether a place lies in a comment or a text in quotes, where nothing is to be completed."""
        if self.drift.start < offset <= self.drift.new_end:
            _, safe = self._unchanged()
            scanned = self._scanned(Span(safe, offset))
            last = self.text[safe + scanned.comments[-1].start : offset] if scanned.comments else ""
            beside = last.startswith("//") and not set(last) & set("\r\n")
            return beside or any(one.code in ("E102", "E120") for one in scanned.found)
        place = self.old(offset)
        if place is None:
            return False
        if any(one.code == "E102" and one.span.start < place for one in self.analysis.compiled.diagnostics):
            return True
        comments = self.analysis.compiled.comments
        at = bisect_right(comments, place, key=lambda span: span.start) - 1
        if at >= 0 and comments[at].start < place:
            inside = self.analysis.text[comments[at].start] == "{"
            return place < comments[at].end or (place == comments[at].end and not inside)
        token = self.analysis.token_at(place)
        return token is not None and token.kind is TokenKind.STRING and token.start < place


def _word_start(text: str, start: int, end: int) -> int:
    """Return where the word in front of a place starts: a sign in it belongs to an arm or to nothing."""
    if "-" not in text[start:end]:
        return start
    first, _, _ = text[start:end].upper().rpartition("-")
    return start if first == "ARM" else start + len(first) + 1


def _covers(token: Token, place: int) -> bool:
    return token.end > place


def _hinted(program: tree.Program) -> list[tree.Move | tree.Call | tree.Grasp]:
    found: list[tree.Move | tree.Call | tree.Grasp] = []
    waiting: list[object] = [*reversed(program.statements)]
    waiting += [procedure.body for procedure in reversed(program.procedures)]
    while waiting:
        node = waiting.pop()
        match node:
            case tree.Move(clauses=clauses):
                found.append(node)
                waiting += [clause.action for clause in clauses if isinstance(clause, tree.On)]
            case tree.Call() | tree.Grasp():
                found.append(node)
            case _:
                waiting += reversed(_inner(node))
    return sorted(found, key=lambda one: one.span.start)


_INNER: Mapping[type, Callable[[Any], tuple[tree.Statement, ...]]] = {
    tree.Block: lambda node: node.statements,
    tree.If: lambda node: node.statements,
    tree.While: lambda node: (node.body,),
    tree.For: lambda node: (node.body,),
    tree.Lock: lambda node: (node.body,),
    tree.Repeat: lambda node: node.body,
    tree.Cobegin: lambda node: tuple(branch.body for branch in node.branches),
    tree.Try: lambda node: (*node.body, *node.recovery),
}


def _inner(node: object) -> tuple[tree.Statement, ...]:
    """Return the statements directly inside of a statement."""
    inner = _INNER.get(type(node))
    return () if inner is None else inner(node)
