"""The inputs of a session: declarations, statements, expressions, whole programs; and whether an input is complete.

Each input is parsed by the rules of a program: what a program would have around it is put there as tokens without
characters, so that every span is one in the text of the session.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise, takewhile

import attrs

from armwright.errors import closest
from armwright.program.language.diagnostic import Diagnostic, sort_diagnostics
from armwright.program.language.source import Source, Span
from armwright.program.language.words import (
    BLOCK_CLOSERS,
    BLOCK_OPENERS,
    HEADERS_IN_CONTEXT,
    VOCABULARIES,
    Standard,
    Vocabulary,
)
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind, scan
from armwright.program.syntax.line_numbers import blank_line_numbers
from armwright.program.syntax.parser import parse

# No expression begins like a line of a numbered program.
_NUMBERED_LINE = re.compile(r"\s*[0-9]+[ \t]+[A-Za-z]")
_ASSIGNMENT_SIGNS = ("=", ":=", "==")
_OPERATORS = ("+", "-", "*", "/", "<", "<=", ">", ">=", "<>", "AND", "OR", ",")
# What an expression can begin with, besides a name.
_LITERAL_KINDS = (TokenKind.NUMBER, TokenKind.STRING)


@attrs.frozen(kw_only=True)
class ParsedInput:
    """One input, read.

    Attributes:
        headers: what it declares.
        statements: what is to be done, in order; a value that is to be shown is a PRINT.
        printed_starts: where the statements start that only show a value.
        spelling: how it first writes each of its names, by key.
        diagnostics: what is wrong with its syntax.
        is_complete: whether it can be taken as it is; otherwise it goes on in the next line.
    """

    headers: tuple[tree.Header, ...]
    statements: tuple[tree.Statement, ...]
    printed_starts: frozenset[int]
    spelling: Mapping[str, str]
    diagnostics: tuple[Diagnostic, ...]
    is_complete: bool


def parse_input(
    source: Source,
    start: int,
    std: Standard,
    *,
    names: Collection[str] = (),
    procedures: Collection[str] = (),
    functions: Collection[str] = (),
    is_file: bool = False,
) -> ParsedInput:
    """Read one input.

    Args:
        source: all that was entered so far, this input last.
        start: where it begins.
        std: the language.
        names: the variables that are declared.
        procedures: the procedures and functions that are.
        functions: those of them that have a value.
        is_file: whether it is the text of a file; elsewhere a number that begins a line may begin an expression.
    """
    text, diagnostics = source.text[start:], []
    if is_file or std is Standard.RLO_83 or _NUMBERED_LINE.match(text):
        text, odd = blank_line_numbers(Source(source.name, text))
        diagnostics += [shift_diagnostic(diagnostic, start) for diagnostic in odd]
    scanned = scan(source, " " * start + text, std)
    diagnostics += scanned.diagnostics
    tokens = _strip_program_frame(scanned.tokens[:-1])
    reader = _InputParser(source, std, names, procedures, functions)
    for is_header, part in _split_parts(tokens, VOCABULARIES[std]):
        if is_header:
            reader.parse_headers(part)
        else:
            reader.parse_statements(part)
    diagnostics += map(_add_else_advice, reader.diagnostics)
    return ParsedInput(
        headers=tuple(reader.headers),
        statements=tuple(reader.statements),
        printed_starts=frozenset(reader.printed_starts),
        spelling={token.key: token.text for token in reversed(tokens) if token.kind is TokenKind.NAME},
        diagnostics=tuple(diagnostics),
        is_complete=_is_complete(scanned.tokens[:-1], diagnostics),
    )


def shift_diagnostic(diagnostic: Diagnostic, offset: int) -> Diagnostic:
    """Return a diagnostic for a text that begins ``offset`` characters later."""

    def shift(span: Span) -> Span:
        return Span(span.start + offset, span.end + offset)

    return attrs.evolve(
        diagnostic,
        span=shift(diagnostic.span),
        secondary=tuple(attrs.evolve(label, span=shift(label.span)) for label in diagnostic.secondary),
        fixes=tuple(attrs.evolve(fix, span=shift(fix.span)) for fix in diagnostic.fixes),
    )


def _add_else_advice(diagnostic: Diagnostic) -> Diagnostic:
    """Return a diagnostic with the advice that it needs where a program comes line by line."""
    if diagnostic.code != "E127" or not diagnostic.message.upper().startswith("`ELSE`"):
        return diagnostic
    help_ = "an IF ends with its line: end that line with ELSE, or write `BEGIN ... END` around the entire statement"
    return attrs.evolve(diagnostic, helps=(*diagnostic.helps, help_))


def _is_complete(tokens: Sequence[Token], diagnostics: Sequence[Diagnostic]) -> bool:
    """Whether nothing is open, and the first thing that is wrong is not that the text ends."""
    if any(diagnostic.code == "E102" for diagnostic in diagnostics) or (tokens and _block_depth(tokens) > 0):
        return False
    first = next((diagnostic for diagnostic in sort_diagnostics(diagnostics) if diagnostic.is_syntax), None)
    # A character that RLO does not have stays wrong whatever follows, a comment of another language too.
    if first is None or first.code == "E101" or not tokens or first.span.start < tokens[-1].end:
        return True
    # Whoever forgets the parentheses of a call believes that nothing is missing.
    return any(fix.replacement == "()" for fix in first.fixes)


def _block_depth(tokens: Sequence[Token]) -> int:
    """Return how many blocks are open after some tokens."""
    words = [token.key for token in tokens if token.kind is TokenKind.KEYWORD]
    # The UNTIL of a WAIT closes nothing.
    waits = sum(pair == ("WAIT", "UNTIL") for pair in pairwise(words))
    return waits + sum((word in BLOCK_OPENERS) - (word in BLOCK_CLOSERS) for word in words)


def _strip_program_frame(tokens: Sequence[Token]) -> list[Token]:
    """Return the tokens without the BEGIN and the ``END.`` of a whole program."""
    remaining = list(tokens)
    if len(remaining) > 1 and remaining[-1].key == "." and remaining[-2].key == "END":
        remaining.pop()
        depth = 0
        for index in reversed(range(len(remaining))):
            if remaining[index].kind is TokenKind.KEYWORD:
                depth += (remaining[index].key in BLOCK_CLOSERS) - (remaining[index].key in BLOCK_OPENERS)
            if depth == 0:
                if remaining[index].key == "BEGIN" and (index == 0 or remaining[index - 1].key == ";"):
                    del remaining[-1], remaining[index]
                break
    return remaining


# ---- parts ---------------------------------------------------------------------------------------------------------


def _split_parts(tokens: Sequence[Token], words: Vocabulary) -> Iterator[tuple[bool, Sequence[Token]]]:
    """Split an input into headers and sequences of statements, each with whether it is a header."""
    index = 0
    while index < len(tokens):
        is_header = True
        if _is_header(tokens[index], words) or _is_header_in_context(tokens, index):
            end = _end_of_header(tokens, index)
        elif _begins_declaration(tokens, index):
            end = _end_of_variables(tokens, index)
        else:
            is_header, end = False, _end_of_statements(tokens, index, words)
        yield is_header, tokens[index:end]
        index = end


def _is_header(token: Token, words: Vocabulary) -> bool:
    return token.kind is TokenKind.KEYWORD and token.key in words.headers


def _is_header_in_context(tokens: Sequence[Token], index: int) -> bool:
    """Whether a word that is reserved nowhere starts a header here: a name follows it."""
    pair = tokens[index : index + 2]
    return len(pair) > 1 and pair[0].key in HEADERS_IN_CONTEXT and pair[1].kind is TokenKind.NAME


def _begins_declaration(tokens: Sequence[Token], index: int) -> bool:
    """Whether names and a type follow, as behind the first ``;`` of a VAR part."""
    while index + 1 < len(tokens) and tokens[index].kind is TokenKind.NAME:
        if tokens[index + 1].key == ":":
            return True
        if tokens[index + 1].key != ",":
            return False
        index += 2
    return False


def _end_of_header(tokens: Sequence[Token], index: int) -> int:
    if tokens[index].key == "VAR":
        return _end_of_variables(tokens, index)
    if tokens[index].key == "RECORD":
        return _index_after(tokens, _index_after(tokens, index, "END"), ";")
    if tokens[index].key not in ("PROCEDURE", "FUNCTION"):
        return _index_after(tokens, index, ";")
    index, depth = _index_after(tokens, index, "BEGIN"), 1
    while index < len(tokens) and depth:
        depth += _block_depth(tokens[index : index + 1])
        index += 1
    return index + 1 if index < len(tokens) and tokens[index].key in (";", ".") else index


def _end_of_variables(tokens: Sequence[Token], index: int) -> int:
    index = _index_after(tokens, index, ";")
    while _begins_declaration(tokens, index):
        index = _index_after(tokens, index, ";")
    return index


def _index_after(tokens: Sequence[Token], index: int, key: str) -> int:
    """Return the index after the next token with this key; the end without one."""
    return next((number + 1 for number in range(index, len(tokens)) if tokens[number].key == key), len(tokens))


def _end_of_statements(tokens: Sequence[Token], index: int, words: Vocabulary) -> int:
    first, *others = _split_statements(tokens[index:])
    statements = takewhile(lambda piece: not _is_header(piece[0], words), others)
    return index + len(first) + sum(map(len, statements))


# ---- parsing -------------------------------------------------------------------------------------------------------


class _InputParser:
    """Parses the parts of one input."""

    def __init__(
        self,
        source: Source,
        std: Standard,
        names: Collection[str],
        procedures: Collection[str],
        functions: Collection[str],
    ) -> None:
        self._source, self._std, self._names = source, std, set(names)
        self._procedures, self._functions = set(procedures), set(functions)
        self.headers: list[tree.Header] = []
        self.statements: list[tree.Statement] = []
        self.printed_starts: list[int] = []
        self.diagnostics: list[Diagnostic] = []

    def parse_headers(self, part: Sequence[Token]) -> None:
        """Read declarations, units, an import or a procedure; the last ``;`` and the word VAR may be left out."""
        first, last = part[0], part[-1]
        is_bare = first.kind is TokenKind.NAME and not _is_header_in_context(part, 0)
        tokens = [*(_synthetic_tokens("VAR", index=first.start) if is_bare else ()), *part]
        if _block_depth(part) <= 0:
            semicolon = () if last.key in (";", ".") else (";",)
            tokens += _synthetic_tokens(*semicolon, "BEGIN", "END", ".", index=last.end)
        program = self._parse(tokens, last.end, self._std)
        self.headers += program.headers
        for header in program.headers:
            if isinstance(header, tree.Declaration):
                self._names.update(name.key for name in header.names)
            elif isinstance(header, tree.Constant):
                self._names.add(header.name.key)
            elif isinstance(header, tree.Procedure):
                self._procedures.add(header.name.key)
                (self._functions.discard if header.result is None else self._functions.add)(header.name.key)

    def parse_statements(self, part: Sequence[Token]) -> None:
        """Read statements; an expression among them becomes a PRINT of it."""
        std, tokens = self._std, _synthetic_tokens("BEGIN", index=part[0].start)
        pieces = list(_split_statements(part))
        for piece in pieces:
            if not self._is_expression(piece, alone=len(pieces) == 1):
                tokens += piece
                continue
            self.printed_starts.append(piece[0].start)
            std = Standard.RLO_2
            remaining = piece[:-1] if piece[-1].key == ";" else piece
            start, end = remaining[0].start, remaining[-1].end
            tokens += [*_synthetic_tokens("PRINT", "(", index=start), *remaining, *_synthetic_tokens(")", index=end)]
            tokens += piece[len(remaining) :]
        tokens += _synthetic_tokens("END", ".", index=part[-1].end)
        self.statements += self._parse(tokens, part[-1].end, std).statements

    def _parse(self, tokens: list[Token], end: int, std: Standard) -> tree.Program:
        """Parse what has a program around it already, up to the end of the text."""
        tokens.append(Token(TokenKind.END, "", "", end, end))
        program, diagnostics = parse(self._source, tokens, std, declared=self._names, procedures=self._procedures)
        self.diagnostics += diagnostics
        return program

    def _is_expression(self, piece: Sequence[Token], *, alone: bool) -> bool:
        """Whether what stands between two ``;`` is a value and no statement."""
        first, remaining = piece[0], [token for token in piece[1:] if token.key != ";"]
        if self._std is Standard.RLO_83:
            is_known = first.kind is TokenKind.ARM or (first.kind is TokenKind.NAME and first.key in self._names)
            return alone and is_known and not remaining
        if first.kind is TokenKind.NAME:
            return self._is_value(first, _tokens_after_brackets(remaining))
        if first.kind is TokenKind.ARM:
            return not remaining or remaining[0].key not in _ASSIGNMENT_SIGNS
        return first.kind in _LITERAL_KINDS or first.key in ("(", "-", "NOT")

    def _is_value(self, name: Token, remaining: Sequence[Token]) -> bool:
        """Whether a name with this behind it and its indices is a value."""
        if not remaining:
            is_known = name.key in self._names
            words = VOCABULARIES[self._std].statements
            return name.key not in self._procedures and (is_known or closest(name.text, words) is None)
        if remaining[0].key == "(":
            return name.key in (self._functions if name.key in self._procedures else FUNCTIONS)
        return remaining[0].key in _OPERATORS


def _split_statements(part: Sequence[Token]) -> Iterator[Sequence[Token]]:
    """Split a sequence of statements after each ``;`` that is not inside one of them."""
    first, depth = 0, 0
    for index, token in enumerate(part):
        depth += _block_depth(part[max(0, index - 1) : index + 1]) - _block_depth(part[max(0, index - 1) : index])
        if token.key == ";" and depth <= 0:
            yield part[first : index + 1]
            first = index + 1
    if first < len(part):
        yield part[first:]


def _tokens_after_brackets(tokens: Sequence[Token]) -> Sequence[Token]:
    """Return the tokens behind the indices that they begin with, if any."""
    if not tokens or tokens[0].key != "[":
        return tokens
    depth = 0
    for index, token in enumerate(tokens):
        depth += (token.key == "[") - (token.key == "]")
        if depth == 0:
            return tokens[index + 1 :]
    return ()


def _synthetic_tokens(*keys: str, index: int) -> list[Token]:
    """Return keywords and symbols that are not in the text."""
    kinds = {True: TokenKind.KEYWORD, False: TokenKind.SYMBOL}
    return [Token(kinds[key.isalpha()], key, key, index, index) for key in keys]
