"""The parser's finger on the tokens: looking, taking, and saying what is missing."""

from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from typing import Concatenate, NoReturn, ParamSpec, TypeAlias, TypeVar, Unpack

from armwright.errors import closest
from armwright.program.language.diagnostic import Details, DiagnosticList, Fix, did_you_mean
from armwright.program.language.source import Source, Span
from armwright.program.language.words import HEADERS_IN_CONTEXT, VOCABULARIES, Standard, is_reserved_in_rlo_2_only
from armwright.program.syntax import tree
from armwright.program.syntax.expected_tokens import ExpectedTokens
from armwright.program.syntax.lexer import Token, TokenKind

# How deep statements, parentheses and operations may lie in one another.
MAX_DEPTH = 100

# What an expression is for where nothing more is known.
ANY_VALUE = ("a value", "")

_T = TypeVar("_T")
_P = ParamSpec("_P")
_NAME, _KEYWORD, _SYMBOL, _END = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.SYMBOL, TokenKind.END


class PanicModeError(Exception):
    """The parser has said what is wrong and cannot go on here; it looks for the next statement."""


class NestingError(Exception):
    """Statements lie too deep in one another; the outermost is passed over."""


class TokenStream:
    """The tokens of a program, the position that the parser has come to, and what it has found.

    Attributes:
        source: the text.
        tokens: its tokens, those that were misspelt replaced by what was meant.
        standard: the language that the program is to be in; all of them are read as RLO-2.
        vocabulary: the words of RLO-2.
        standard_vocabulary: those of its own language, for messages.
        rules: how to read each statement, by the word that starts it, or the sign behind the name that does.
        diagnostics: what is wrong.
        index: how many tokens have been read.
        current: the token to be read next.
        previous: the token read last; the first one where none has been read.
        depth: how deep the position lies in statements, parentheses and operations.
        statement_depth: how deep the statement lies that was begun last.
        height: how deep the expression is that was read last.
        open_closers: the words that the open statements around the position wait for, the innermost last.
        overflow_index: where the outermost statement was last found to be too deep; -1 if it was not.
        late_headers: headers that stand behind BEGIN.
        declared: the names declared so far.
        procedures: the names of the procedures read so far.
        reported_missing: the words whose absence has been reported.
        enclosing_procedure: the key of the procedure that the position lies in; empty outside of all.
        in_module: whether the program is a module, which needs no BEGIN.
        in_function: whether the position lies in the statements of a FUNCTION.
        recover_depth: how many TRYs the position lies in the second part of.
        assignment_target: the key of the variable that the statement gives a value; empty where it gives none.
        operand_context: what the expression is for that is being read, in the words of messages, and where.
        expected: what may stand at the end of the text, where somebody asks for that.
        surplus_ends: how many ENDs have been reported that close nothing but the program.
    """

    def __init__(
        self, source: Source, tokens: Sequence[Token], rules: "Mapping[str, Rule]", standard: Standard = Standard.RLO_2
    ) -> None:
        """Start at the first token; the last must be the end of the text."""
        self.source = source
        self.standard = standard
        self.vocabulary, self.standard_vocabulary = VOCABULARIES[Standard.RLO_2], VOCABULARIES[standard]
        self.rules = rules
        self.diagnostics = DiagnosticList()
        self.report = self.diagnostics.report
        self.index = 0
        self.tokens = list(tokens)
        self._end_index = len(tokens) - 1
        self.current = self.previous = self.tokens[0]
        self.depth = self.statement_depth = self.height = 0
        self.open_closers: list[tuple[str, ...]] = []
        self.overflow_index = -1
        self.late_headers: list[tree.Header] = []
        self.declared: set[str] = set()
        self.procedures: set[str] = set()
        self.reported_missing: set[str] = set()
        self.enclosing_procedure = self.assignment_target = ""
        self.recover_depth = 0
        self.in_module = self.in_function = False
        self.operand_context = ANY_VALUE
        self.expected: ExpectedTokens | None = None
        # How much was wrong in front of the last token; what is looked for after a mistake there is guessed.
        self._expected_error_count = 0
        self.surplus_ends = 0
        self._reported_reserved: set[str] = set()
        self._reported_index = -1
        self._last_begin_index = max((index for index, token in enumerate(tokens) if token.key == "BEGIN"), default=-1)
        self._surplus_counts: list[int] | None = None

    # ---- looking and taking

    def peek(self, steps: int = 1) -> Token:
        """Return a token further on or, with less than no steps, back; behind the end it is always the end."""
        index = self.index + steps
        return self.tokens[index] if index < self._end_index else self.tokens[-1]

    @property
    def is_at_end(self) -> bool:
        """Whether everything has been read."""
        return self.current.kind is _END

    @property
    def is_at_statement_end(self) -> bool:
        """Whether the next token ends a statement: a ``;``, a word that ends a stretch of them, or the end."""
        return self.is_at_end or self.matches(";", *self.vocabulary.block_ends)

    def take(self) -> Token:
        """Read one token; the end stays."""
        token = self.current
        if self.index < self._end_index:
            self.index += 1
            self.previous = token
            self.current = self.tokens[self.index]
            if self.index == self._end_index - 1:
                self._expected_error_count = len(self.diagnostics)
        return token

    def take_name(self) -> tree.Name:
        """Read one token as a name."""
        token = self.take()
        return tree.Name(token.span, token.text, token.key)

    def rewind(self, index: int) -> None:
        """Return to where ``at`` tokens had been read."""
        self.index = index
        self.current = self.tokens[index]
        self.previous = self.tokens[max(0, index - 1)]

    def matches(self, *keys: str) -> bool:
        """Whether the next token is one of these keywords or symbols."""
        token = self.current
        return token.key in keys and (token.kind is _SYMBOL or token.kind is _KEYWORD)

    def matches_name(self, *keys: str) -> bool:
        """Whether the next token is a name that reads so: a word with a meaning in this position only."""
        return self.current.kind is _NAME and self.current.key in keys

    def accept(self, *keys: str) -> Token | None:
        """Read the next token if it is one of these keywords or symbols."""
        if self.matches(*keys):
            return self.take()
        if self.is_at_end:
            self.note_expected_words(*keys)
        return None

    def matches_word(self, *words: str) -> bool:
        """Whether the next token is one of these words, which are reserved nowhere; RLO-83 has none of them."""
        token = self.current
        is_word = token.key in words and (token.kind is _NAME or token.kind is _KEYWORD)
        return is_word and self.standard is Standard.RLO_2

    def accept_word(self, *words: str) -> Token | None:
        """Read the next token if it is one of these words, which are reserved nowhere: here it is a keyword."""
        if self.matches_word(*words):
            # Whoever goes through the tokens behind the parser, such as the formatter, knows it for one too.
            self.current.kind = _KEYWORD
            return self.take()
        if self.is_at_end:
            self.note_expected_words(*words)
        return None

    @property
    def starts_header_in_context(self) -> bool:
        """Whether two words stand here of which the first starts a part in front of BEGIN."""
        following = self.peek()
        # A reserved word behind it was meant as a name.
        is_name = following.kind is _NAME or (following.kind is _KEYWORD and self.peek(2).key in ("=", ":=", "(", ":"))
        return self.matches_word(*HEADERS_IN_CONTEXT) and is_name

    def note_expected_words(
        self, *keys: str, starts_statement: bool = False, present_clauses: frozenset[str] = frozenset()
    ) -> None:
        """Take note that these words may stand at the end of the text, if that is where the parser has come to.

        Args:
            keys: keywords; signs are passed over.
            starts_statement: whether they start a statement or a part of the program.
            present_clauses: the clauses of a MOVE that there are already, by their words.
        """
        if self._is_at_cursor() and self.expected is not None:
            self.expected.present_clauses |= present_clauses
            self.expected.words += (key for key in keys if key[0].isalpha())
            self.expected.starts_statement |= starts_statement

    def note_expected_operand(self, wants: str, where: str = "") -> None:
        """Take note that a value or name may stand at the end of the text; the arguments are those of ``mobile``."""
        if self._is_at_cursor() and self.expected is not None:
            self.expected.operand = wants, where

    def discard_expected(self) -> None:
        """Take what is looked for from here on for guessed: at the end of the text none of it is to be offered."""
        if self.current.kind is _END:
            self._expected_error_count = -1

    def _is_at_cursor(self) -> bool:
        if self.expected is None or not self.is_at_end or len(self.diagnostics) != self._expected_error_count:
            return False
        self.expected.assignment_target = self.assignment_target
        self.expected.enclosing_procedure = self.enclosing_procedure
        self.expected.is_in_recovery = self.recover_depth > 0
        return True

    def replace_current(self, key: str, kind: TokenKind = _KEYWORD) -> None:
        """Put the word that was meant, a keyword or name, in the place of the next token, which has been reported."""
        token = self.current
        self.current = self.tokens[self.index] = Token(kind, token.text, key, token.start, token.end, damaged=True)

    @property
    def has_begin_ahead(self) -> bool:
        """Whether a BEGIN stands behind the next token."""
        return self.index < self._last_begin_index

    def has_surplus_end(self) -> bool:
        """Whether more ENDs follow than the statements around this position and those further on wait for."""
        if self._surplus_counts is None:
            steps = [(token.key == "END") - (token.key in ("BEGIN", "TRY")) for token in reversed(self.tokens)]
            self._surplus_counts = list(accumulate(steps))[::-1]
        waiting = sum("END" in words or "RECOVER" in words for words in self.open_closers)
        return self._surplus_counts[self.index] > waiting

    # ---- spans

    def gap_span(self) -> Span:
        """Return the position right behind the token read last, where a missing thing belongs."""
        end = self.previous.end if self.index else self.current.start
        return Span(end, end)

    def span_since(self, start: Token | Span) -> Span:
        """Return the stretch from ``start`` to the token read last."""
        first, end = start.start, self.previous.end
        return Span(first, max(first, end))

    def is_on_same_line(self) -> bool:
        """Whether the next token stands in the line of the one read last."""
        return self.source.line(self.previous.start) == self.source.line(self.current.start)

    def node(
        self, kind: Callable[Concatenate[Span, _P], _T], start: Token | Span, *parts: _P.args, **named: _P.kwargs
    ) -> _T:
        """Return a node of the tree that reaches from ``start`` to the token read last."""
        return kind(self.span_since(start), *parts, **named)

    # ---- going on after mistakes

    def attempt(self, rule: "Callable[[TokenStream], _T]") -> _T | None:
        """Read something; None where it makes no sense: what has been read of it is passed over.

        Raises:
            NestingError: statements lie too deep in one another.
        """
        depth, level = self.depth, len(self.open_closers)
        try:
            return rule(self)
        except PanicModeError:
            del self.open_closers[level:]
            self.depth = depth
            return None

    def skip_to(self, *keys: str) -> None:
        """Pass over tokens up to one of these keywords or symbols, or to the end of the text."""
        while not (self.is_at_end or self.matches(*keys)):
            self.take()

    # ---- depth

    def enter_level(self) -> None:
        """Go one step deeper.

        Raises:
            PanicModeError: it would be too deep.
        """
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self.fail_too_deep()

    def fail_too_deep(self) -> NoReturn:
        """Say that the nesting is too deep.

        Raises:
            PanicModeError: always; where most of the depth is that of statements, all of them are to be given up.
        """
        statement = self.statement_depth > MAX_DEPTH // 2
        what = "statements" if statement else "parentheses and operations"
        if self.overflow_index < 0:
            text = f"{what} are nested too deeply here"
            advice = "move a part of it to a procedure" if statement else "split the expression"
            self.report_once("E119", text, self.current.span, f"more than {MAX_DEPTH} deep", advice=advice)
        self.overflow_index = self.index
        raise NestingError if statement else PanicModeError

    # ---- saying what is wrong

    @property
    def is_reported(self) -> bool:
        """Whether something has been reported at this position already."""
        broken_text = self.previous.damaged and self.previous.kind is TokenKind.STRING
        return self.current.damaged or self._reported_index == self.index or broken_text

    def suppress_reports(self) -> None:
        """Take this position for one about which something has been said."""
        self._reported_index = self.index

    def report_once(self, code: str, message: str, span: Span, label: str, **details: Unpack[Details]) -> None:
        """Report an error, unless one has been reported at this position; the arguments are those of ``report``."""
        if not self.is_reported:
            self.report(code, message, span, label, **details)
        self._reported_index = self.index

    def fail(self, message: str, label: str = "", *, code: str = "E111", advice: str = "") -> NoReturn:
        """Say what is missing at the next token, unless that was reported before, and give up the statement.

        Args:
            message: what is missing.
            label: what stands there instead; the token, unless something else is given.
            code: of the diagnostic.
            advice: what to write.

        Raises:
            PanicModeError: always.
        """
        # At the end of the text there is nothing to mark; the gap before it is the position.
        span = self.gap_span() if self.is_at_end else self.current.span
        self.report_once(code, message, span, label or f"found {describe_token(self.current)}", advice=advice)
        raise PanicModeError

    def insert_missing(self, key: str, what: str, *, advice: str = "", alone: bool = True) -> None:
        """Say that ``key`` is missing behind the token read last, and go on as if it had been there.

        Args:
            key: what is missing.
            what: the position in words.
            advice: of the diagnostic.
            alone: whether nothing else is missing, so that putting it in is a cure.
        """
        gap = self.gap_span()
        # A word needs blanks around it; a sign goes where it is missing.
        fixes = (Fix(gap, f" {key}" if key[0].isalpha() else key),) if alone else ()
        self.report_once("E112", f"missing `{key}` {what}", gap, f"expected `{key}` here", advice=advice, fixes=fixes)

    def accept_semicolon(self, where: str, *, report_once: bool = True) -> bool:
        """Read ``;``, or say that it is missing; return whether it stands there.

        Args:
            where: the position in words, such as ``after the import``.
            report_once: whether a missing one is reported only if nothing else is reported at this position.
        """
        if self.accept(";"):
            return True
        report = self.report_once if report_once else self.report
        text, advice = f"missing `;` {where}", f"insert `;` after `{self.previous.text}`"
        report("E104", text, self.gap_span(), "expected `;` here", advice=advice, replacement=";")
        return False

    def expect(self, key: str, where: str, *, statement: bool = False) -> None:
        """Read ``key``; or say that it is missing, and go on as if it had been there.

        Args:
            key: a keyword or symbol.
            where: the position in words, such as ``after the name``.
            statement: whether statements follow.

        Raises:
            PanicModeError: nothing that could stand behind ``key`` follows either.
        """
        if self.accept(key):
            return
        if self._is_misspelt(key):
            text, advice = f"expected `{key}` {where}", f"write `{key}`"
            self.report("E112", text, self.current.span, f"expected `{key}`", advice=advice)
            self.take()
            return
        follows = statement or key in (")", "]")
        ends = not follows and (self.is_at_end or self.matches(";", "END", *self.vocabulary.statements))
        # What a word stands in front of begins with no sign but a parenthesis.
        alone = not key[0].isalpha() or not (ends or (self.current.kind is _SYMBOL and self.current.key != "("))
        self.insert_missing(key, where, advice=f"insert `{key}` after `{self.previous.text}`", alone=alone)
        if ends:
            raise PanicModeError

    def _is_misspelt(self, key: str) -> bool:
        """Whether a name stands where a keyword should: one like it, or any with another name or arm behind it."""
        token, after = self.current, self.peek()
        if token.kind is not _NAME or not key[0].isalpha() or after.key in ("=", ":=", "(", "["):
            return False
        if closest(token.text, (key,)):
            return True
        return after.kind in (_NAME, TokenKind.ARM) and self.is_on_same_line()

    def check_name_length(self, name: tree.Name) -> None:
        """Refuse a declared name that is too long, or has a point in it."""
        if "." in name.text:
            label = "names are made of the letters A to Z, digits and `_`"
            self.report("E101", "a name cannot contain `.`", name.span, label)
            return
        longest = self.standard_vocabulary.longest_name
        if len(name.text) > longest:
            text = f"the name `{name.text}` is longer than {longest} characters"
            note = f"names of {self.standard_vocabulary.name} have 1 to {longest} characters"
            self.report("E103", text, name.span, f"{len(name.text)} characters", note=note)

    def report_reserved_name(self) -> None:
        """Say once of the word that stands here that it cannot be a name."""
        token = self.current
        if token.key in self._reported_reserved:
            return
        self._reported_reserved.add(token.key)
        # Only what looks alike: T0 for TO.
        advice = did_you_mean(closest(token.text, self.declared, limit=0))
        if not advice and is_reserved_in_rlo_2_only(token.key):
            if self.standard is Standard.RLO_83:
                text = f"the keyword `{token.text}` belongs to RLO-2"
                self.report("E214", text, token.span, "in RLO-83 it may be a name, but it is not declared")
                return
            advice = f"choose another name; check a program of RLO-83 that uses `{token.text}` with `--std=83`"
        text = f"`{token.text}` is a reserved word and cannot be a name"
        self.report("E107", text, token.span, "a reserved word", advice=advice)


Rule: TypeAlias = Callable[[TokenStream], tree.Statement]


def either(words: Sequence[str]) -> str:
    """Return words as the choices of a message, such as ``SCALAR, TRANS or FRAME``."""
    return f"{', '.join(words[:-1])} or {words[-1]}"


def describe_token(token: Token) -> str:
    """Return how a token is called in a message."""
    return "the end of the text" if token.kind is TokenKind.END else f"`{token.text}`"
