"""Parsing declarations: VAR parts, types, and what is wrong with them."""

import math

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, did_you_mean
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import listed, number
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import LostError, Tokens, shown


def passed_over(tokens: Tokens, names: list[tree.Name]) -> tree.Declaration:
    """Pass over the rest of a declaration; return what was perhaps declared, of no known type."""
    start = tokens.now
    stops = ("BEGIN", *tokens.words.headers, *tokens.words.statements)
    while not tokens.done and not tokens.sees(";", "END", *stops):
        if tokens.now.kind is TokenKind.NAME:
            names.append(tokens.take_name())
        else:
            tokens.take()
    tokens.accept(";")
    span = tokens.since(start)
    return tree.Declaration(span, tuple(names), tree.TypeName(span, "", None))


# var_part = "VAR" decl { decl } ;
def var_part(tokens: Tokens) -> list[tree.Declaration]:
    """Read VAR and what it declares."""
    word = tokens.take()
    if tokens.sees(","):
        tokens.report("E111", "expected a name after VAR", tokens.now.span, "found `,`")
        tokens.take()
    if tokens.now.kind not in (TokenKind.NAME, TokenKind.ARM) and not _reserved(tokens):
        tokens.report("E111", "VAR declares nothing", word.span, "expected a name after VAR")
        return []
    return declarations(tokens)


def _reserved(tokens: Tokens) -> bool:
    """Whether a reserved word stands where a declared name should."""
    token = tokens.now
    outside = ("VAR", "BEGIN", "END")
    return token.kind is TokenKind.KEYWORD and token.key not in outside and tokens.ahead().key in (",", ":")


def declarations(tokens: Tokens) -> list[tree.Declaration]:
    """Read declarations, as many as there are."""
    read = []
    depth = tokens.depth
    while _goes_on(tokens):
        index = tokens.at
        names: list[tree.Name] = []
        try:
            read.append(_declaration(tokens, names))
        except LostError:
            tokens.depth = depth
            read.append(passed_over(tokens, names))
        if tokens.at == index:
            tokens.take()
    return read


def _goes_on(tokens: Tokens) -> bool:
    """Whether one more declaration follows, and not BEGIN, a statement or another header."""
    token, after = tokens.now, tokens.ahead()
    if token.kind is TokenKind.KEYWORD:
        return _reserved(tokens)
    if token.kind not in (TokenKind.NAME, TokenKind.ARM) or after.key in ("=", ":=", "(", "["):
        return False
    if after.key in (",", ":"):
        return True
    return not closest(token.text, ["BEGIN", *tokens.words.headers, *tokens.words.statements])


# decl = name { "," name } ":" type ";" ;
def _declaration(tokens: Tokens, names: list[tree.Name]) -> tree.Declaration:
    """Read one declaration; put its names also where they are safe if the rest makes no sense."""
    start = tokens.now
    names_of(tokens, names)
    kind = type_name(tokens)
    span = tokens.since(start)
    _close(tokens)
    return tree.Declaration(span, tuple(names), kind)


# name { "," name } ":"
def names_of(tokens: Tokens, names: list[tree.Name]) -> None:
    """Read what is declared, up to the type.

    Raises:
        LostError: there is no type.
    """
    _declared(tokens, names)
    while True:
        if tokens.accept(","):
            if tokens.sees(":"):
                tokens.report("E111", "expected a name after `,`", tokens.now.span, "found `:`")
                break
            _declared(tokens, names)
        elif tokens.now.kind is TokenKind.NAME and tokens.ahead().key in (",", ":"):
            gap = tokens.gap()
            tokens.report("E112", "missing `,` between two names", gap, "expected `,` here", fixes=(Fix(gap, ","),))
            _declared(tokens, names)
        else:
            break
    if not tokens.accept(":"):
        gap = tokens.gap()
        tokens.report("E112", "missing `:` before the type", gap, "expected `:` and a type here")
        if not tokens.sees(*tokens.words.types, "ARRAY"):
            raise LostError


def _declared(tokens: Tokens, names: list[tree.Name]) -> None:
    """Read one name; a word that cannot be one is passed over."""
    token = tokens.now
    if token.kind is TokenKind.NAME:
        name = tokens.take_name()
        tokens.check_length(name)
        tokens.declared.add(name.key)
        names.append(name)
    elif token.kind is TokenKind.ARM:
        if not token.damaged:
            tokens.report("E107", f"`{token.text}` is an arm and needs no declaration", token.span, "leave it out")
        tokens.take()
    elif _reserved(tokens):
        # It was meant as a name: a procedure has one parameter less without it, and calls would be wrong too.
        tokens.refuse_reserved()
        names.append(tokens.take_name())
    else:
        tokens.lost("expected a name", f"found {shown(token)}")


# type = [ "ARRAY" "[" number { "," number } "]" "OF" ] ( "SCALAR" | "TRANS" | "FRAME" | "EVENT" ) ;
def type_name(tokens: Tokens) -> tree.TypeName:
    """Read a type.

    Raises:
        LostError: there is none.
    """
    start = tokens.now
    tokens.offer(*tokens.words.types)
    sizes = _sizes(tokens) if tokens.accept("ARRAY") else ()
    token = tokens.now
    types, offered = tokens.words.types, tokens.offered.types
    expected = f"expected {', '.join(offered[:-1])} or {offered[-1]}"
    if tokens.accept(*types):
        span = tokens.since(start)
        return tree.TypeName(span, tokens.source.slice(span), token.key, sizes)
    if token.kind is not TokenKind.NAME:
        tokens.lost("expected a type after `OF`" if sizes else "expected a type after `:`", expected)
    near = closest(token.text, types)
    tokens.report("E205", f"unknown type `{token.text}`", token.span, expected, advice=did_you_mean(near))
    tokens.take()
    return tree.TypeName(tokens.since(start), token.text, near, sizes)


def _sizes(tokens: Tokens) -> tuple[tree.Number, ...]:
    """Read what stands between ARRAY and the type of its elements."""
    if tokens.sees("OF"):
        gap = tokens.gap()
        tokens.say_once("E111", "an array needs its sizes", gap, "expected `[` and a number here")
        sizes: tuple[tree.Number, ...] = (tree.Number(gap, "", math.nan),)
    else:
        sizes = listed(tokens, _size, "a number", "after ARRAY", "[")
        if tokens.ahead(-2).key == ",":
            sizes = (*sizes, tree.Number(tokens.gap(), "", math.nan))
    tokens.expect("OF", "before the type of the elements", statement=True)
    return sizes or (tree.Number(tokens.gap(), "", math.nan),)


def _size(tokens: Tokens, wants: str, where: str) -> tree.Number:
    if tokens.now.kind is TokenKind.NUMBER:
        return number(tokens)
    start = tokens.now
    if start.kind is not TokenKind.NAME and start.key != "-":
        tokens.lost(f"expected {wants} {where or f'after `{tokens.before.text}`'}", f"found {shown(start)}")
    tokens.say_once("E111", "the size of an array is a plain number", start.span, "such as `6`")
    tokens.take()
    if start.key == "-":
        tokens.take()
    span = tokens.since(start)
    return tree.Number(span, tokens.source.slice(span), math.nan)


def _close(tokens: Tokens) -> None:
    if tokens.accept(";"):
        return
    gap = tokens.gap()
    text = "missing `;` after the declaration"
    advice = f"insert `;` after `{tokens.before.text}`"
    tokens.report("E104", text, gap, "expected `;` here", advice=advice, fixes=(Fix(gap, ";"),))
    words = tokens.words
    if not tokens.sees("BEGIN", *words.headers, *words.statements) and tokens.ahead().key not in (",", ":", "="):
        raise LostError
