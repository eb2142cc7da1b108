"""Conformance to RLO-83: what a program has that the report did not have, as ``gcc -std=c89 -pedantic`` finds it in C.

The parser reads RLO-2. Here each part of the tree that belongs to RLO-2 is named once (E214) and becomes a poison, so
that the rest of the program is still judged; nothing is said of what is inside a statement that is no RLO-83 at all.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Sequence
from typing import Any

import attrs

from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.words import RLO_2_HEADERS, RLO_2_STATEMENTS, RLO_2_TYPES, is_reserved_in_rlo_2_only
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import Token, TokenKind

_FRAME = "the name of a FRAME"
_MOVED = "the name of a FRAME or an arm"
_ARM = "an arm such as ARM_1"
_MAX_SHOWN_LENGTH = 16
# In front of a word of RLO-2 that stands where only a name can, and behind one that gets a value or is declared.
_BEFORE_NAMES = {"MOVE", "AFFIX", "UNFIX", "TO", "FROM", "AT", "OPERATE", "=", ":=", *"([,+-*/<>", "<=", ">=", "<>"}
_BEHIND_NAMES = {"=", ":="}
# These stand there too, and are no names.
_NEVER_NAMES = {"NOT", "ON", "PRIORITY"}


def reserve_rlo_2_words(tokens: Sequence[Token], declared: Collection[str]) -> Sequence[Token]:
    """Take words of RLO-2 for reserved, but where they are the names that RLO-83 lets them be.

    Args:
        tokens: of a program of RLO-83.
        declared: all names that are declared in it or before it.
    """
    reserved = list(tokens)
    for index, token in enumerate(tokens):
        if token.kind is not TokenKind.NAME or token.key in declared or not is_reserved_in_rlo_2_only(token.key):
            continue
        named = index > 0 and tokens[index - 1].key in _BEFORE_NAMES and token.key not in _NEVER_NAMES
        if not named and tokens[index + 1].key not in _BEHIND_NAMES:
            reserved[index] = attrs.evolve(token, kind=TokenKind.KEYWORD)
    return reserved


def check_conformance(
    program: tree.Program, diagnostics: Sequence[Diagnostic], source: Source, tokens: Sequence[Token]
) -> tuple[tree.Program, DiagnosticList]:
    """Name what a program has that belongs to RLO-2.

    Args:
        program: as the parser has read it.
        diagnostics: what the parser has found wrong.
        source: the text.
        tokens: of the text, as the parser has read them.

    Returns:
        The program with a poison in place of each part that belongs to RLO-2, and what is wrong with both.
    """
    visitor = _ConformanceVisitor(source, tokens, program)
    headers = tuple(checked for header in program.headers if (checked := visitor.header(header)) is not None)
    statements = tuple(map(visitor.statement, program.statements))
    all_diagnostics = DiagnosticList()
    all_diagnostics += [one for one in diagnostics if not visitor.is_inside(one.span)]
    all_diagnostics += visitor.diagnostics
    return attrs.evolve(program, headers=headers, statements=statements), all_diagnostics


class _ConformanceVisitor:
    """Goes through a program, and remembers which stretches of it are no RLO-83 at all."""

    def __init__(self, source: Source, tokens: Sequence[Token], program: tree.Program) -> None:
        self.diagnostics = DiagnosticList()
        self.report = self.diagnostics.report
        self._source, self._tokens = source, tokens
        self._starts = [token.start for token in tokens]
        self._declared = {name.key for declaration in program.declarations for name in declaration.names}
        self._skipped_spans: list[Span] = []
        self._visits: dict[type, Callable[[Any], tree.Statement]] = {
            tree.Poison: lambda node: node,
            tree.Assign: self._assign,
            tree.Affix: self._affix,
            tree.Unfix: self._unfix,
            tree.Open: self._open,
            tree.Grasp: self._grasp,
            tree.Operate: self._operate,
            tree.ReadVisions: self._read_visions,
            tree.ReadSystem: lambda node: attrs.evolve(node, arm=self._operand(node.arm, _ARM)),
            tree.Move: self._move,
            tree.Call: self._call,
        }

    def is_inside(self, span: Span) -> bool:
        """Whether something stands in a stretch that has been passed over, behind its first word."""
        index = bisect_left(self._skipped_spans, span.start, key=lambda skipped: skipped.start) - 1
        return index >= 0 and span.start <= self._skipped_spans[index].end

    def _report(self, what: str, span: Span, instead: str) -> None:
        self.report("E214", f"{what} belongs to RLO-2", span, instead)

    # ---- tokens, where the tree forgets

    def _token_index(self, span: Span) -> int:
        """Return the number of the token with which a part of the tree begins, behind those that nobody has written."""
        return bisect_right(self._starts, span.start) - 1

    def _first_token(self, span: Span) -> Token:
        """Return the first token of a part of the tree."""
        return self._tokens[self._token_index(span)]

    def _last_token(self, span: Span) -> Token:
        """Return the last token of a part of the tree."""
        return self._tokens[bisect_right(self._starts, span.end - 1) - 1]

    def _names_in(self, span: Span) -> frozenset[str]:
        tokens = self._tokens[self._token_index(span) : bisect_left(self._starts, span.end)]
        return frozenset(token.key for token in tokens if token.kind in (TokenKind.NAME, TokenKind.ARM))

    def _with_parentheses(self, span: Span) -> Span:
        """Return where an expression stands with the parentheses around it, which are not those of a list."""
        first, end = self._token_index(span), bisect_left(self._starts, span.end)
        while (
            self._tokens[first - 1].key == "("
            and self._tokens[end].key == ")"
            and self._tokens[first - 2].key != "VIA"
            and self._tokens[first - 2].kind is not TokenKind.NAME
        ):
            first, end = first - 1, end + 1
        return Span(self._tokens[first].start, self._tokens[end - 1].end)

    # ---- in front of BEGIN

    def header(self, node: tree.Header) -> tree.Header | None:
        """Return a part in front of BEGIN as far as it is of RLO-83; None for one that is not."""
        if isinstance(node, tree.Declaration):
            return attrs.evolve(node, type=self._type(node.type))
        word = self._first_token(node.span)
        self._report(word.key, word.span, RLO_2_HEADERS[word.key])
        self._skipped_spans.append(node.span)
        return None

    def _type(self, node: tree.TypeName) -> tree.TypeName:
        word = self._first_token(node.span)
        if word.key not in RLO_2_TYPES:
            return node
        self._report(word.key, word.span, RLO_2_TYPES[word.key])
        self._skipped_spans.append(node.span)
        return attrs.evolve(node, key=None, sizes=())

    # ---- statements

    def statement(self, node: tree.Statement) -> tree.Statement:
        """Return a statement as far as it is of RLO-83."""
        if (visit := self._visits.get(type(node))) is not None:
            return visit(node)
        word = self._first_token(node.span)
        if isinstance(node, tree.Block):
            what, instead = "a block inside a program", "RLO-83 has one BEGIN and one END"
            return self._reject_statement(node, what, word.span, instead)
        if isinstance(node, tree.ZeroForce):
            return self._reject_statement(node, "ZERO FORCE", word.span, "RLO-83 has no forces")
        return self._reject_statement(node, word.key, word.span, RLO_2_STATEMENTS[word.key])

    def _reject_statement(self, node: tree.Statement, what: str, span: Span, instead: str) -> tree.Poison:
        """Pass over a statement that RLO-83 does not have."""
        self._report(what, span, instead)
        self._skipped_spans.append(node.span)
        return tree.Poison(self._first_token(node.span).span, self._names_in(node.span))

    def _call(self, node: tree.Call) -> tree.Statement:
        name = node.name
        if name.key not in self._declared:
            return self._reject_statement(node, f"the call of `{name.text}`", name.span, "RLO-83 has no procedures")
        bracket = self._tokens[self._token_index(name.span) + 1]
        text, advice = f"`{name.text}` needs `=` before its value", f"write `{name.text} = (...`"
        fix = Fix(bracket.gap, "= ")
        self.report("E109", text, bracket.span, "expected `=` before this", advice=advice, fixes=(fix,))
        value = tree.Matrix(Span(bracket.start, node.span.end), node.arguments)
        return self._assign(tree.Assign(node.span, name, value))

    def _grasp(self, node: tree.Grasp) -> tree.Grasp:
        if node.arm is not None:
            self._report("GRASP with an arm", node.arm.span, "RLO-83 closes the gripper of the arm named last")
        return node

    def _operate(self, node: tree.Operate) -> tree.Operate:
        self._report_last_word(node, "RLO-83 only starts a device; it stops at the end", "ON", "OFF")
        return attrs.evolve(node, device=self._operand(node.device, "the name of a device"), on=True)

    def _report_last_word(self, node: tree.Affix | tree.Operate, instead: str, *words: str) -> None:
        """Name a word that RLO-2 allows at the end of a statement."""
        last = self._last_token(node.span)
        if last.kind is TokenKind.KEYWORD and last.key in words:
            self._report(f"{type(node).__name__.upper()} ... {last.key}", last.span, instead)

    def _assign(self, node: tree.Assign) -> tree.Statement:
        if isinstance(node.target, tree.Index):
            bracket = self._tokens[self._token_index(node.target.span) + 1]
            return self._reject_statement(node, "indexing", bracket.span, "RLO-83 has no arrays")
        value = node.value
        numbers = value.items if isinstance(value, tree.Matrix) else (value,)
        are_known = all(isinstance(number, tree.Number | tree.Poison) for number in numbers)
        if not are_known or self._is_parenthesised(value):
            return attrs.evolve(node, value=self._poison(value, "a number or twelve numbers in `( )`"))
        bare = tuple(map(self._without_unit, numbers))
        known = attrs.evolve(value, items=bare) if isinstance(value, tree.Matrix) else bare[0]
        return attrs.evolve(node, value=known)

    def _is_parenthesised(self, value: tree.Expression) -> bool:
        """Whether parentheses stand around a value, or around a single number of a matrix."""
        tokens = self._tokens[self._token_index(value.span) - 1 : bisect_left(self._starts, value.span.end) + 1]
        opening = sum(token.key == "(" for token in tokens)
        return opening > isinstance(value, tree.Matrix)

    def _without_unit(self, node: tree.Expression) -> tree.Expression:
        """Return a number; one with a unit is no longer known."""
        if not isinstance(node, tree.Number) or node.unit is None:
            return node
        number = self._last_token(node.span)
        unit = number.text[len(number.key) :]
        self._report(f"the unit `{unit}`", number.span, "RLO-83 counts in metres and takes bare numbers")
        return attrs.evolve(node, value=math.nan, unit=None)

    def _affix(self, node: tree.Affix) -> tree.Affix:
        instead = "in RLO-83 a frame follows its parent, never the reverse"
        self._report_last_word(node, instead, "RIGIDLY", "NONRIGIDLY")
        child, parent = self._operand(node.child, _FRAME), self._operand(node.parent, _MOVED)
        step = None if node.at is None else self._operand(node.at, "the name of a TRANS")
        return attrs.evolve(node, child=child, parent=parent, at=step, rigid=False)

    def _unfix(self, node: tree.Unfix) -> tree.Unfix:
        child = self._operand(node.child, _FRAME)
        if node.parent is not None:
            return attrs.evolve(node, child=child, parent=self._operand(node.parent, _MOVED))
        self._report("UNFIX without FROM", Span(node.span.end, node.span.end), "RLO-83 names the parent: `FROM ...`")
        return attrs.evolve(node, child=child)

    def _open(self, node: tree.Open) -> tree.Open:
        if node.width is not None:
            word = self._tokens[bisect_left(self._starts, node.arm.span.end)]
            self._report("OPEN ... TO", word.span, "RLO-83 opens the fingers completely")
        return attrs.evolve(node, arm=self._operand(node.arm, _ARM), width=None)

    def _read_visions(self, node: tree.ReadVisions) -> tree.ReadVisions:
        if len(node.targets) < 2:
            return attrs.evolve(node, targets=tuple(self._operand(target, _FRAME) for target in node.targets))
        first, others = node.targets[0].span, node.targets[1].span.to(node.targets[-1].span)
        self._report("reading several frames at once", others, "RLO-83 reads one frame at a time")
        return attrs.evolve(node, targets=(tree.Poison(others, self._names_in(first.to(others))),))

    # ---- MOVE

    def _move(self, node: tree.Move) -> tree.Move:
        moved, goal = self._operand(node.moved, _MOVED), self._goal(node.goal)
        clauses = tuple(checked for clause in node.clauses if (checked := self._clause(clause)) is not None)
        return attrs.evolve(node, moved=moved, goal=goal, clauses=clauses)

    def _clause(self, node: tree.Clause) -> tree.Clause | None:
        """Return a clause as far as it is of RLO-83; None for one that is not."""
        match node:
            case tree.On():
                self._report("ON ... DO", self._first_token(node.span).span, "RLO-83 has no guarded motions")
            case tree.Blend() | tree.Duration():
                index = self._token_index(node.span)
                word = self._tokens[index + (self._tokens[index].key == "WITH")]
                self._report(f"WITH {word.key}", word.span, "RLO-83 has APPROACH, DEPARTURE and SPEED")
            case tree.Via(points=points):
                return attrs.evolve(node, points=tuple(map(self._goal, points)))
            case tree.Approach(point=point) | tree.Departure(point=point):
                return attrs.evolve(node, point=self._goal(point))
            case tree.Speed(value=tree.Number() as number):
                return attrs.evolve(node, value=self._without_unit(number))
            case tree.Speed(value=value):
                return attrs.evolve(node, value=self._operand(value, "a number or the name of a SCALAR"))
            case _:
                return node
        self._skipped_spans.append(node.span)
        return None

    def _goal(self, node: tree.Expression) -> tree.Expression:
        """Return the name of a frame to come to."""
        if isinstance(node, tree.ArmName):
            self._report(f"`{node.text}` as a pose", node.span, f"RLO-83 takes {_FRAME} here")
            return self._skip_expression(node.span)
        return self._operand(node, _FRAME)

    # ---- expressions

    def _operand(self, node: tree.Expression, wants: str) -> tree.Name | tree.ArmName | tree.Poison:
        """Return a name or an arm; a poison in place of any other expression."""
        if isinstance(node, tree.Name | tree.ArmName) and self._with_parentheses(node.span) == node.span:
            return node
        return self._poison(node, wants)

    def _poison(self, node: tree.Expression, wants: str) -> tree.Poison:
        if isinstance(node, tree.Poison):
            return node
        span = self._with_parentheses(node.span)
        self._report(self._quote(span), span, f"RLO-83 takes {wants} here")
        return self._skip_expression(span)

    def _skip_expression(self, span: Span) -> tree.Poison:
        self._skipped_spans.append(span)
        return tree.Poison(span, self._names_in(span))

    def _quote(self, span: Span) -> str:
        """Return how an expression is called in a message."""
        text, start = self._source.slice(span), self._first_token(span)
        if span == start.span:
            return f"`{text}` as a value"
        if len(text) <= _MAX_SHOWN_LENGTH and text.isprintable():
            return f"`{text}`"
        is_call = start.kind is TokenKind.NAME and self._tokens[self._token_index(span) + 1].key == "("
        return f"`{start.text}(...)`" if is_call else "this expression"
