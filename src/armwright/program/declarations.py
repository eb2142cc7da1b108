"""Parsing what stands in front of the statements: VAR parts and BEGIN."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

from armwright.errors import closest
from armwright.program import beyond, tree
from armwright.program.cursor import LostError, Tokens, shown
from armwright.program.diagnostics import Fix
from armwright.program.source import Span
from armwright.program.tokens import TokenKind
from armwright.program.values import check_length, refuse_reserved
from armwright.program.words import LATER_TYPES, STATEMENTS, TYPES


def head(tokens: Tokens) -> list[tree.Declaration]:
    """Read everything up to and including BEGIN; at the end of the text BEGIN may be missing."""
    found: list[tree.Declaration] = []
    begin = tokens.find("BEGIN")
    while True:
        while tokens.accept(";"):
            pass
        token, after = tokens.now, tokens.ahead()
        if tokens.sees("VAR"):
            found += var_part(tokens)
        elif beyond.starts_header(tokens):
            beyond.header(tokens)
        elif token.kind is TokenKind.NAME and after.key in (",", ":"):
            gap = Span(token.start, token.start)
            tokens.found.say(
                "E112", "missing `VAR` before the declarations", gap, "expected `VAR` here", fixes=(Fix(gap, "VAR "),)
            )
            found += _declarations(tokens)
        elif token.kind is TokenKind.NAME and after.kind is TokenKind.NAME and closest(token.text, ["VAR"]):
            _misspelt(tokens, "VAR")
            found += var_part(tokens)
        elif tokens.at < begin and not tokens.sees(*STATEMENTS) and after.key != "=":
            found.append(_nonsense(tokens))
        else:
            break
    _begin(tokens)
    return found


def _nonsense(tokens: Tokens) -> tree.Declaration:
    """Pass over what is neither a declaration nor BEGIN; the names in it may have been meant to be declared."""
    start = tokens.take()
    if not start.damaged:
        tokens.found.say("E111", "expected `VAR` or `BEGIN`", start.span, f"found {shown(start)}")
    names: list[tree.Name | None] = []
    if start.kind is TokenKind.NAME:
        names.append(tree.Name(start.span, start.text, start.key))
    return _passed_over(tokens, names)


def _passed_over(tokens: Tokens, names: list[tree.Name | None]) -> tree.Declaration:
    """Pass over the rest of a declaration; return what was perhaps declared, of no known type."""
    start = tokens.now
    while not tokens.done and not tokens.sees(";", "BEGIN", "VAR", "END", *STATEMENTS):
        token = tokens.take()
        if token.kind is TokenKind.NAME:
            names.append(tree.Name(token.span, token.text, token.key))
    tokens.accept(";")
    span = tokens.since(start)
    return tree.Declaration(span, tuple(name for name in names if name), tree.TypeName(span, "", None))


def _begin(tokens: Tokens) -> None:
    if tokens.accept("BEGIN") or tokens.done:
        return
    if tokens.now.kind is TokenKind.NAME and tokens.ahead().key != "=" and closest(tokens.now.text, ["BEGIN"]):
        _misspelt(tokens, "BEGIN")
        tokens.take()
        return
    gap = Span(tokens.now.start, tokens.now.start)
    if not tokens.now.damaged:
        tokens.found.say(
            "E115",
            "missing `BEGIN` before the first statement",
            gap,
            "expected `BEGIN` here",
            fixes=(Fix(gap, "BEGIN "),),
        )


def _misspelt(tokens: Tokens, near: str) -> None:
    token = tokens.now
    tokens.found.say(
        "E105", f"unknown word `{token.text}`", token.span, "not a word of RLO", helps=(f"did you mean `{near}`?",)
    )


# var_part = "VAR" decl { decl } ;
def var_part(tokens: Tokens) -> list[tree.Declaration]:
    """Read VAR and what it declares."""
    word = tokens.take()
    if tokens.sees(","):
        tokens.found.say("E111", "expected a name after VAR", tokens.now.span, "found `,`")
        tokens.take()
    if tokens.now.kind not in (TokenKind.NAME, TokenKind.ARM) and not _reserved(tokens):
        tokens.found.say("E111", "VAR declares nothing", word.span, "expected a name after VAR")
        return []
    return _declarations(tokens)


def _reserved(tokens: Tokens) -> bool:
    """Whether a reserved word stands where a declared name should."""
    token = tokens.now
    outside = ("VAR", "BEGIN", "END")
    return token.kind is TokenKind.KEYWORD and token.key not in outside and tokens.ahead().key in (",", ":")


def _declarations(tokens: Tokens) -> list[tree.Declaration]:
    found = []
    while _goes_on(tokens):
        at = tokens.at
        names: list[tree.Name | None] = []
        try:
            found.append(_declaration(tokens, names))
        except LostError:
            found.append(_passed_over(tokens, names))
        if tokens.at == at:
            tokens.take()
    return found


def _goes_on(tokens: Tokens) -> bool:
    """Whether one more declaration follows, and not BEGIN, a statement or a header of RLO-2."""
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD:
        return _reserved(tokens)
    if token.kind not in (TokenKind.NAME, TokenKind.ARM) or after.key in ("=", ":=", "(", "["):
        return False
    if after.key in (",", ":"):
        return True
    return not beyond.starts_header(tokens) and not closest(token.text, ["BEGIN", *STATEMENTS])


# decl = name { "," name } ":" type ";" ;
def _declaration(tokens: Tokens, names: list[tree.Name | None]) -> tree.Declaration:
    """Read one declaration; put its names also where they are safe if the rest makes no sense."""
    start = tokens.now
    names.append(_declared(tokens))
    while True:
        if tokens.accept(","):
            if tokens.sees(":"):
                tokens.found.say("E111", "expected a name after `,`", tokens.now.span, "found `:`")
                break
            names.append(_declared(tokens))
        elif tokens.now.kind is TokenKind.NAME and tokens.ahead().key in (",", ":"):
            gap = tokens.gap()
            tokens.found.say("E112", "missing `,` between two names", gap, "expected `,` here", fixes=(Fix(gap, ","),))
            names.append(_declared(tokens))
        else:
            break
    if not tokens.accept(":"):
        gap = tokens.gap()
        tokens.found.say("E112", "missing `:` before the type", gap, "expected `:` and a type here")
        if not tokens.sees(*TYPES):
            raise LostError
    kind = _type(tokens)
    span = tokens.since(start)
    _close(tokens)
    return tree.Declaration(span, tuple(name for name in names if name), kind)


def _declared(tokens: Tokens) -> tree.Name | None:
    """Read one name; None for a word that cannot be one."""
    token = tokens.now
    if token.kind is TokenKind.NAME:
        tokens.take()
        name = tree.Name(token.span, token.text, token.key)
        check_length(tokens, name)
        return name
    if token.kind is TokenKind.ARM:
        if not token.damaged:
            tokens.found.say("E107", f"`{token.text}` is an arm and needs no declaration", token.span, "leave it out")
        tokens.take()
        return None
    if _reserved(tokens):
        refuse_reserved(tokens)
        tokens.take()
        return None
    return tokens.lost("expected a name", f"found {shown(token)}")


# type = "SCALAR" | "TRANS" | "FRAME" ;
def _type(tokens: Tokens) -> tree.TypeName:
    token = tokens.now
    if tokens.accept(*TYPES):
        return tree.TypeName(token.span, token.text, token.key)
    if tokens.sees_word(*LATER_TYPES):
        return beyond.type_name(tokens)
    if token.kind is not TokenKind.NAME:
        tokens.lost("expected a type after `:`", f"expected {', '.join(TYPES[:-1])} or {TYPES[-1]}")
    near = closest(token.text, TYPES)
    tokens.found.say(
        "E205",
        f"unknown type `{token.text}`",
        token.span,
        f"expected {', '.join(TYPES[:-1])} or {TYPES[-1]}",
        helps=(f"did you mean `{near}`?",) if near else (),
    )
    tokens.take()
    return tree.TypeName(token.span, token.text, near)


def _close(tokens: Tokens) -> None:
    if tokens.accept(";"):
        return
    gap = tokens.gap()
    tokens.found.say(
        "E104",
        "missing `;` after the declaration",
        gap,
        "expected `;` here",
        helps=(f"insert `;` after `{tokens.before.text}`",),
        fixes=(Fix(gap, ";"),),
    )
    if not tokens.sees("BEGIN", "VAR", *STATEMENTS) and tokens.ahead().key not in (",", ":", "="):
        raise LostError
