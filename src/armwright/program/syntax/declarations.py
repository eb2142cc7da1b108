"""Parsing declarations: VAR parts, types, and what is wrong with them."""

# ruff: noqa: ERA001 - each rule of the grammar stands above its function

import math
from functools import partial

from armwright.errors import closest
from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import HEADERS_IN_CONTEXT, PARAMETER_MODES, TYPES_IN_CONTEXT, Standard
from armwright.program.syntax import tree
from armwright.program.syntax.expressions import number, parenthesised_list
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import PanicModeError, TokenStream, either


def skip_declaration(tokens: TokenStream, names: list[tree.Name]) -> tree.Declaration:
    """Pass over the rest of a declaration; return what was perhaps declared, of no known type."""
    start, first = tokens.current, tokens.index
    tokens.skip_to(";", "END", "BEGIN", *tokens.vocabulary.headers, *tokens.vocabulary.statements)
    skipped = tokens.tokens[first : tokens.index]
    names += [tree.Name(token.span, token.text, token.key) for token in skipped if token.kind is TokenKind.NAME]
    tokens.accept(";")
    return tokens.node(tree.Declaration, start, tuple(names), tokens.node(tree.TypeName, start, "", None))


# var_part = "VAR" decl { decl } ;
def var_part(tokens: TokenStream) -> list[tree.Declaration]:
    """Read VAR and what it declares."""
    word = tokens.take()
    if tokens.matches(","):
        tokens.report("E111", "expected a name after VAR", tokens.current.span, "found `,`")
        tokens.take()
    if tokens.current.kind not in (TokenKind.NAME, TokenKind.ARM) and not _is_reserved_as_name(tokens):
        tokens.report("E111", "VAR declares nothing", word.span, "expected a name after VAR")
        return []
    return declarations(tokens)


def _is_reserved_as_name(tokens: TokenStream) -> bool:
    """Whether a reserved word stands where a declared name should."""
    token = tokens.current
    outside = ("VAR", "BEGIN", "END", *HEADERS_IN_CONTEXT)
    return token.kind is TokenKind.KEYWORD and token.key not in outside and tokens.peek().key in (",", ":")


def declarations(tokens: TokenStream) -> list[tree.Declaration]:
    """Read declarations, as many as there are."""
    read = []
    while _starts_declaration(tokens):
        index = tokens.index
        names: list[tree.Name] = []
        read.append(tokens.attempt(partial(_declaration, names=names)) or skip_declaration(tokens, names))
        if tokens.index == index:
            tokens.take()
    return read


def _starts_declaration(tokens: TokenStream) -> bool:
    """Whether one more declaration follows, and not BEGIN, a statement or another header."""
    token, after = tokens.current, tokens.peek()
    if tokens.starts_header_in_context:
        return False
    if token.kind is TokenKind.KEYWORD:
        return _is_reserved_as_name(tokens)
    if token.kind not in (TokenKind.NAME, TokenKind.ARM) or after.key in ("=", ":=", "(", "["):
        return False
    if after.key in (",", ":"):
        return True
    return not closest(token.text, ["BEGIN", *tokens.vocabulary.headers, *tokens.vocabulary.statements])


# decl = name { "," name } ":" type ";" ;
def _declaration(tokens: TokenStream, names: list[tree.Name]) -> tree.Declaration:
    """Read one declaration; put its names also where they are safe if the rest makes no sense."""
    start = tokens.current
    kind = names_and_type(tokens, names)
    declaration = tokens.node(tree.Declaration, start, tuple(names), kind)
    _end_declaration(tokens)
    return declaration


# name { "," name } ":" type
def names_and_type(tokens: TokenStream, names: list[tree.Name]) -> tree.TypeName:
    """Read what is declared, and its type.

    Raises:
        PanicModeError: there is no type.
    """
    _declared_name(tokens, names)
    while True:
        if tokens.accept(","):
            if tokens.matches(":"):
                tokens.report("E111", "expected a name after `,`", tokens.current.span, "found `:`")
                break
            _declared_name(tokens, names)
        elif tokens.current.kind is TokenKind.NAME and tokens.peek().key in (",", ":"):
            gap = tokens.gap_span()
            tokens.report("E112", "missing `,` between two names", gap, "expected `,` here", replacement=",")
            _declared_name(tokens, names)
        else:
            break
    if not tokens.accept(":"):
        gap = tokens.gap_span()
        tokens.report("E112", "missing `:` before the type", gap, "expected `:` and a type here")
        if not (tokens.matches(*tokens.vocabulary.types, "ARRAY") or tokens.matches_word(*TYPES_IN_CONTEXT)):
            raise PanicModeError
    return type_name(tokens)


def mode_and_names(tokens: TokenStream, names: list[tree.Name]) -> tuple[str, tree.TypeName]:
    """Read how parameters are passed, where that is written, the parameters, and their type.

    Raises:
        PanicModeError: there is no type.
    """
    mode = None
    if tokens.matches_word(*PARAMETER_MODES) and tokens.peek().kind is TokenKind.NAME:
        mode = tokens.accept_word(*PARAMETER_MODES)
    return "" if mode is None else mode.key, names_and_type(tokens, names)


def _declared_name(tokens: TokenStream, names: list[tree.Name]) -> None:
    """Read one name; a word that cannot be one is passed over."""
    token = tokens.current
    if token.kind is TokenKind.NAME:
        name = tokens.take_name()
        tokens.check_name_length(name)
        tokens.declared.add(name.key)
        names.append(name)
    elif token.kind is TokenKind.ARM:
        if not token.damaged:
            tokens.report("E107", f"`{token.text}` is an arm and needs no declaration", token.span, "leave it out")
        tokens.take()
    elif _is_reserved_as_name(tokens):
        # It was meant as a name: a procedure has one parameter less without it, and calls would be wrong too.
        tokens.report_reserved_name()
        names.append(tokens.take_name())
    else:
        tokens.fail("expected a name")


# type = [ "ARRAY" "[" number { "," number } "]" "OF" ] kind ;
# kind = "SCALAR" | "TRANS" | "FRAME" | "EVENT" | "BOOLEAN" | "TEXT" | name ;
def type_name(tokens: TokenStream) -> tree.TypeName:
    """Read a type."""
    start = tokens.current
    tokens.note_expected_words(*tokens.vocabulary.types)
    sizes = _array_sizes(tokens) if tokens.accept("ARRAY") else ()
    token = tokens.current
    types, expected = tokens.vocabulary.types, f"expected {either(tokens.standard_vocabulary.types)}"
    if tokens.accept(*types) or tokens.accept_word(*TYPES_IN_CONTEXT):
        span = tokens.span_since(start)
        return tree.TypeName(span, tokens.source.slice(span), token.key, sizes)
    if token.kind is TokenKind.NAME and tokens.standard is Standard.RLO_2:
        # Of a record; which there are is known when all is read.
        record = tokens.take_name()
        span = tokens.span_since(start)
        return tree.TypeName(span, tokens.source.slice(span), None, sizes, record)
    if token.kind is not TokenKind.NAME:
        tokens.fail(f"expected a type after `{'OF' if sizes else ':'}`", expected)
    near = closest(token.text, types)
    tokens.report("E205", f"unknown type `{token.text}`", token.span, expected, advice=did_you_mean(near))
    tokens.take()
    return tokens.node(tree.TypeName, start, token.text, near, sizes)


def _array_sizes(tokens: TokenStream) -> tuple[tree.Number, ...]:
    """Read what stands between ARRAY and the type of its elements."""
    if tokens.matches("OF"):
        gap = tokens.gap_span()
        tokens.report_once("E111", "an array needs its sizes", gap, "expected `[` and a number here")
        sizes: tuple[tree.Number, ...] = (tree.Number(gap, "", math.nan),)
    else:
        sizes = parenthesised_list(tokens, _array_size, "a number", "after ARRAY", "[")
        if tokens.peek(-2).key == ",":
            sizes = (*sizes, tree.Number(tokens.gap_span(), "", math.nan))
    tokens.expect("OF", "before the type of the elements", statement=True)
    return sizes or (tree.Number(tokens.gap_span(), "", math.nan),)


def _array_size(tokens: TokenStream, wants: str, where: str) -> tree.Number:
    if tokens.current.kind is TokenKind.NUMBER:
        return number(tokens)
    start = tokens.current
    if start.kind is not TokenKind.NAME and start.key != "-":
        tokens.fail(f"expected {wants} {where or f'after `{tokens.previous.text}`'}")
    tokens.report_once("E111", "the size of an array is a plain number", start.span, "such as `6`")
    tokens.take()
    if start.key == "-":
        tokens.take()
    span = tokens.span_since(start)
    return tree.Number(span, tokens.source.slice(span), math.nan)


def _end_declaration(tokens: TokenStream) -> None:
    if tokens.accept_semicolon("after the declaration", report_once=False):
        return
    words = tokens.vocabulary
    if not tokens.matches("BEGIN", *words.headers, *words.statements) and tokens.peek().key not in (",", ":", "="):
        raise PanicModeError
