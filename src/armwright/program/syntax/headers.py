"""Parsing what stands in front of the statements: VAR parts, IMPORT, UNITS, procedures, and BEGIN itself."""

from collections.abc import Callable, Mapping, Sequence

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, Label, did_you_mean
from armwright.program.language.source import Span
from armwright.program.syntax import tree
from armwright.program.syntax.control_flow import block
from armwright.program.syntax.declarations import declarations, names_of, passed_over, type_name, var_part
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import LostError, Tokens, shown

# What other languages call a procedure.
_PROCEDURES = ("FUNCTION", "PROC", "SUB", "SUBROUTINE", "DEF")
_BY_REFERENCE = "a procedure returns results in its FRAME, EVENT and ARRAY parameters, or in variables of the program"


def head(tokens: Tokens) -> list[tree.Header]:
    """Read everything up to and including BEGIN; at the end of the text BEGIN may be missing."""
    headers_: list[tree.Header] = []
    while True:
        _semicolons(tokens)
        tokens.offer(*tokens.words.headers, "BEGIN", starts=True)
        token, after = tokens.now, tokens.ahead()
        if token.kind is TokenKind.KEYWORD and token.key in tokens.words.headers:
            headers_ += header(tokens)
        elif token.kind is TokenKind.NAME and after.key in (",", ":"):
            gap = Span(token.start, token.start)
            tokens.report(
                "E112", "missing `VAR` before the declarations", gap, "expected `VAR` here", fixes=(Fix(gap, "VAR "),)
            )
            headers_ += declarations(tokens)
        elif word := _misspelt_header(tokens):
            _misspelt(tokens, word)
            headers_ += header(tokens)
        elif tokens.at < tokens.begin() and not tokens.sees(*tokens.words.statements) and after.key != "=":
            headers_.append(_nonsense(tokens))
        else:
            break
    _begin(tokens)
    return headers_


def header(tokens: Tokens) -> Sequence[tree.Header]:
    """Read one part of what stands in front of BEGIN; what makes no sense is passed over."""
    index, level, depth = tokens.at, len(tokens.waiting), tokens.depth
    try:
        tokens.deep = -1
        return _HEADERS[tokens.now.key](tokens)
    except LostError:
        del tokens.waiting[level:]
        tokens.depth = depth
        passed_over(tokens, [])
    if tokens.at == index:
        tokens.take()
    return []


def _semicolons(tokens: Tokens) -> None:
    """Pass over each ``;`` in front of BEGIN, where there is none to spare."""
    while token := tokens.accept(";"):
        fix = Fix(token.span, "")
        tokens.report("E117", "`;` does not belong here", token.span, "leave it out", fixes=(fix,))
        while tokens.accept(";"):
            pass


def _misspelt_header(tokens: Tokens) -> str | None:
    """Return the word that was meant to start a part in front of BEGIN."""
    token, after = tokens.now, tokens.ahead()
    if token.kind is not TokenKind.NAME or after.kind not in (TokenKind.NAME, TokenKind.STRING):
        return None
    near = "PROCEDURE" if token.key in _PROCEDURES else closest(token.text, (*tokens.words.headers, "BEGIN"))
    return near if near != "BEGIN" and (after.kind is TokenKind.NAME or near == "IMPORT") else None


def _misspelt(tokens: Tokens, near: str) -> None:
    token = tokens.now
    tokens.report(
        "E105", f"unknown keyword `{token.text}`", token.span, "not a keyword of RLO", advice=did_you_mean(near)
    )
    tokens.replace(near)


def _nonsense(tokens: Tokens) -> tree.Declaration:
    """Pass over what is neither a declaration nor BEGIN; the names in it may have been meant to be declared."""
    start = tokens.take()
    if not start.damaged:
        tokens.report("E111", "expected `VAR` or `BEGIN`", start.span, f"found {shown(start)}")
    names = [tree.Name(start.span, start.text, start.key)] if start.kind is TokenKind.NAME else []
    return passed_over(tokens, names)


def _begin(tokens: Tokens) -> None:
    if tokens.accept("BEGIN") or tokens.done:
        return
    if tokens.now.kind is TokenKind.NAME and tokens.ahead().key != "=" and closest(tokens.now.text, ["BEGIN"]):
        _misspelt(tokens, "BEGIN")
        tokens.take()
        return
    gap = Span(tokens.now.start, tokens.now.start)
    fix = Fix(gap, "BEGIN ")
    tokens.say_once("E115", "missing `BEGIN` before the first statement", gap, "expected `BEGIN` here", fixes=(fix,))


# import = "IMPORT" string ";" ;
def _import(tokens: Tokens) -> list[tree.Header]:
    start = tokens.take()
    token = tokens.now
    if token.kind is not TokenKind.STRING:
        advice = 'write `IMPORT "cell.json" ;`'
        tokens.lost("expected the name of a file after IMPORT", f"found {shown(token)}", advice=advice)
    tokens.take()
    path = tree.String(token.span, token.text[1:-1])
    span = tokens.since(start)
    _semicolon(tokens, "after the import")
    return [tree.Import(span, path)]


# units = "UNITS" unitname { "," unitname } ";" ;
def _units(tokens: Tokens) -> list[tree.Header]:
    start = tokens.take()
    tokens.want("a unit")
    units = [_unit(tokens)]
    while tokens.now.key == "," or (tokens.now.kind is TokenKind.NAME and tokens.ahead().key in (",", ";")):
        if not tokens.accept(","):
            tokens.insert(",", "between two units")
        tokens.want("a unit")
        units.append(_unit(tokens))
    span = tokens.since(start)
    _semicolon(tokens, "after the units")
    return [tree.Units(span, tuple(units))]


def _unit(tokens: Tokens) -> tree.Name:
    token = tokens.now
    if token.kind is not TokenKind.NAME:
        advice = "write `UNITS MM, DEG ;`"
        tokens.lost(f"expected a unit after `{tokens.before.text}`", f"found {shown(token)}", advice=advice)
    return tokens.take_name()


# procedure = "PROCEDURE" name [ "(" param { "," param } ")" ] ";" [ var_part ] block ";" ;
def _procedure(tokens: Tokens) -> list[tree.Header]:
    start = tokens.take()
    name = _own_name(tokens)
    tokens.procedures.add(name.key)
    parameters = _parameters(tokens) if tokens.sees("(") else []
    above = tokens.since(start)
    _no_result(tokens)
    _semicolon(tokens, "after the head of the procedure")
    tokens.offer("VAR", "BEGIN", starts=True)
    own = var_part(tokens) if tokens.sees("VAR") else []
    while tokens.sees("VAR"):
        again = tokens.now
        fix = Fix(again.span, "")
        tokens.report("E118", "a procedure has one VAR part", again.span, "remove this word", fixes=(fix,))
        own += var_part(tokens)
    tokens.offer("BEGIN", starts=True)
    body = _body(tokens, above, name)
    procedure = tree.Procedure(tokens.since(start), above, name, tuple(parameters), tuple(own), body)
    if tokens.sees("END") and tokens.ahead().key != ".":
        tokens.say_once("E127", "`END` without BEGIN", tokens.now.span, "the procedure has ended before")
        tokens.take()
    if tokens.sees("."):
        fix = Fix(tokens.now.span, ";")
        tokens.say_once("E104", "a procedure ends with `;`", tokens.now.span, "write `;`", fixes=(fix,))
        tokens.take()
    else:
        _semicolon(tokens, "after the procedure")
    return [procedure]


def _own_name(tokens: Tokens) -> tree.Name:
    token = tokens.now
    if token.kind is TokenKind.KEYWORD and tokens.ahead().key in ("(", ";"):
        tokens.refuse_reserved()
    elif token.key in ("(", ";"):
        gap = tokens.gap()
        tokens.say_once("E111", "expected the name of the procedure", gap, f"found {shown(token)}")
        return tree.Name(gap, "", "")
    elif token.kind is not TokenKind.NAME:
        tokens.lost("expected the name of the procedure", f"found {shown(token)}")
    name = tokens.take_name()
    tokens.check_length(name)
    return name


# param = name { "," name } ":" type ;
def _parameters(tokens: Tokens) -> list[tree.Declaration]:
    opening, depth = tokens.take(), tokens.depth
    parameters: list[tree.Declaration] = []
    if tokens.sees(")"):
        fix = Fix(opening.span.to(tokens.now.span), "")
        text = "a procedure without parameters is declared without `( )`"
        tokens.say_once("E111", text, tokens.now.span, "there is nothing in between", fixes=(fix,))
        tokens.take()
        return parameters
    while True:
        start = tokens.now
        if tokens.sees("VAR"):
            text = "a parameter has no VAR in front"
            tokens.say_once("E117", text, start.span, "leave it out", note=_BY_REFERENCE)
            tokens.take()
        names: list[tree.Name] = []
        try:
            names_of(tokens, names)
            kind = type_name(tokens)
        except LostError:
            tokens.depth = depth
            while not tokens.done and not tokens.sees(")", ";", "BEGIN", *tokens.words.headers):
                tokens.take()
            kind = tree.TypeName(tokens.since(start), "", None)
        parameters.append(tree.Declaration(tokens.since(start), tuple(names), kind))
        if not _another(tokens):
            break
    if not tokens.accept(")"):
        tokens.insert(")", "after the parameters")
    return parameters


def _no_result(tokens: Tokens) -> None:
    """Pass over the type of what a procedure was meant to give back."""
    if not tokens.sees(":"):
        return
    start = tokens.take()
    while not tokens.done and not tokens.sees(";", "VAR", "BEGIN"):
        tokens.take()
    tokens.say_once("E117", "a procedure returns no value", tokens.since(start), "leave this out", note=_BY_REFERENCE)


def _another(tokens: Tokens) -> bool:
    """Whether one more parameter follows."""
    if tokens.accept(","):
        return True
    token = tokens.now
    if token.key == ";" and tokens.ahead().kind is TokenKind.NAME and tokens.ahead(2).key in (",", ":"):
        fix = Fix(token.span, ",")
        tokens.say_once("E112", "expected `,` between two parameters", token.span, "write `,`", fixes=(fix,))
        tokens.take()
        return True
    if token.kind is TokenKind.NAME and tokens.ahead().key in (",", ":"):
        tokens.insert(",", "between two parameters")
        return True
    return False


def _body(tokens: Tokens, above: Span, name: tree.Name) -> tree.Block:
    """Read the statements of a procedure, also where BEGIN or END is missing."""
    token = tokens.now
    if token.kind is TokenKind.NAME and token.key not in tokens.declared and closest(token.text, ("BEGIN",)):
        _misspelt(tokens, "BEGIN")
    elif not tokens.sees("BEGIN"):
        gap = tokens.gap()
        fix = Fix(Span(token.start, token.start), "BEGIN ")
        fixes = (fix,) if token.kind is TokenKind.NAME or tokens.sees(*tokens.words.statements) else ()
        tokens.say_once("E115", "the procedure has no BEGIN", gap, "expected `BEGIN` here", fixes=fixes)
        if not fixes:
            return tree.Block(gap, (), gap)
    tokens.in_procedure = name.key or "?"
    body = block(tokens)
    tokens.in_procedure = ""
    return _without_main(tokens, above, body)


def _without_main(tokens: Tokens, above: Span, body: tree.Block) -> tree.Block:
    """Give back the statements of the program itself, which a procedure without END has swallowed."""
    last = body.statements[-1] if body.statements else None
    open_ended = isinstance(last, tree.Block) and last.end.start == last.end.end
    if not open_ended or last is None or body.end.start != body.end.end or not tokens.sees("END"):
        return body
    tokens.back_to(last.span.start)
    tokens.diagnostics[:] = [diagnostic for diagnostic in tokens.diagnostics if diagnostic.span.start < last.span.start]
    gap = tokens.gap()
    label = Label(above, "this procedure")
    tokens.say_once("E115", "the procedure has no END", gap, "expected `END ;` here", secondary=(label,))
    tokens.hush()
    return tree.Block(tokens.since(body.span), body.statements[:-1], gap)


def _semicolon(tokens: Tokens, where: str) -> None:
    if tokens.accept(";"):
        return
    gap = tokens.gap()
    advice = f"insert `;` after `{tokens.before.text}`"
    tokens.say_once("E104", f"missing `;` {where}", gap, "expected `;` here", advice=advice, fixes=(Fix(gap, ";"),))


def late(tokens: Tokens) -> tree.Statement:
    """Read a part that belongs in front of BEGIN, and keep what it declares."""
    word = tokens.now
    what = "declarations belong" if word.key == "VAR" else "it belongs"
    tokens.report("E118", f"{word.text} after BEGIN", word.span, f"{what} before BEGIN")
    tokens.late += header(tokens)
    # It has its own ``;``.
    tokens.hush()
    return tree.Poison(word.span)


_HEADERS: Mapping[str, Callable[[Tokens], Sequence[tree.Header]]] = {
    "VAR": var_part,
    "IMPORT": _import,
    "UNITS": _units,
    "PROCEDURE": _procedure,
}
