"""Parsing what stands in front of the statements: VAR parts, IMPORT, UNITS, procedures, and BEGIN itself."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from armwright.errors import closest
from armwright.program.language.diagnostic import Fix, Label, did_you_mean
from armwright.program.language.source import Span
from armwright.program.language.words import HEADERS_IN_CONTEXT
from armwright.program.syntax import tree
from armwright.program.syntax.control_flow import block
from armwright.program.syntax.declarations import (
    declarations,
    mode_and_names,
    skip_declaration,
    type_name,
    var_part,
)
from armwright.program.syntax.expressions import expression
from armwright.program.syntax.frames import expect_equals
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.token_stream import TokenStream, describe_token

# What other languages call a procedure.
_FOREIGN_PROCEDURE_KEYWORDS = ("FUNCTION", "PROC", "SUB", "SUBROUTINE", "DEF")
_NO_RESULTS = "a FUNCTION has a value; a procedure returns results in its INOUT, FRAME, EVENT and ARRAY parameters"


def parse_headers(tokens: TokenStream) -> list[tree.Header]:
    """Read everything up to and including BEGIN; at the end of the text BEGIN may be missing."""
    headers_: list[tree.Header] = []
    while True:
        _skip_semicolons(tokens)
        words = (*tokens.vocabulary.headers, *HEADERS_IN_CONTEXT, "BEGIN")
        tokens.note_expected_words(*words, starts_statement=True)
        token, after = tokens.current, tokens.peek()
        is_header = token.kind is TokenKind.KEYWORD and token.key in tokens.vocabulary.headers
        if is_header or tokens.starts_header_in_context:
            headers_ += parse_header(tokens)
        elif token.kind is TokenKind.NAME and after.key in (",", ":"):
            text = "missing `VAR` before the declarations"
            tokens.report("E112", text, token.gap, "expected `VAR` here", replacement="VAR ")
            headers_ += declarations(tokens)
        elif word := _intended_header(tokens):
            _replace_misspelt_keyword(tokens, word)
            headers_ += parse_header(tokens)
        elif after.key == "=" or tokens.matches("BEGIN", *tokens.vocabulary.statements) or not tokens.has_begin_ahead:
            break
        else:
            headers_.append(_skip_nonsense(tokens))
    _accept_begin(tokens)
    return headers_


def parse_header(tokens: TokenStream) -> Sequence[tree.Header]:
    """Read one part of what stands in front of BEGIN; what makes no sense is passed over."""
    index, tokens.overflow_index = tokens.index, -1
    headers_ = tokens.attempt(_HEADERS[tokens.current.key])
    if headers_ is not None:
        return headers_
    skip_declaration(tokens, [])
    if tokens.index == index:
        tokens.take()
    return []


def _skip_semicolons(tokens: TokenStream) -> None:
    """Pass over each ``;`` in front of BEGIN, where there is none to spare."""
    while token := tokens.accept(";"):
        tokens.report("E117", "`;` does not belong here", token.span, "leave it out", replacement="")
        while tokens.accept(";"):
            pass


def _intended_header(tokens: TokenStream) -> str | None:
    """Return the word that was meant to start a part in front of BEGIN."""
    token, after = tokens.current, tokens.peek()
    if token.kind is not TokenKind.NAME or after.kind not in (TokenKind.NAME, TokenKind.STRING):
        return None
    foreign = token.key in _FOREIGN_PROCEDURE_KEYWORDS
    near = "PROCEDURE" if foreign else closest(token.text, (*tokens.vocabulary.headers, "BEGIN"))
    return near if near != "BEGIN" and (after.kind is TokenKind.NAME or near == "IMPORT") else None


def _replace_misspelt_keyword(tokens: TokenStream, near: str) -> None:
    token = tokens.current
    text = f"unknown keyword `{token.text}`"
    tokens.report("E105", text, token.span, "not a keyword of RLO", advice=did_you_mean(near))
    tokens.replace_current(near)


def _skip_nonsense(tokens: TokenStream) -> tree.Declaration:
    """Pass over what is neither a declaration nor BEGIN; the names in it may have been meant to be declared."""
    start = tokens.take()
    if not start.damaged:
        tokens.report("E111", "expected `VAR` or `BEGIN`", start.span, f"found {describe_token(start)}")
    names = [tree.Name(start.span, start.text, start.key)] if start.kind is TokenKind.NAME else []
    return skip_declaration(tokens, names)


def _accept_begin(tokens: TokenStream) -> None:
    if tokens.accept("BEGIN") or tokens.is_at_end or (tokens.in_module and tokens.matches("END")):
        return
    if tokens.current.kind is TokenKind.NAME and tokens.peek().key != "=" and closest(tokens.current.text, ["BEGIN"]):
        _replace_misspelt_keyword(tokens, "BEGIN")
        tokens.take()
        return
    text = "missing `BEGIN` before the first statement"
    tokens.report_once("E115", text, tokens.current.gap, "expected `BEGIN` here", replacement="BEGIN ")


# constants = "CONST" name "=" expr ";" { name "=" expr ";" } ;
def _constants(tokens: TokenStream) -> list[tree.Header]:
    tokens.accept_word("CONST")
    constants: list[tree.Header] = []
    while not constants or (tokens.current.kind is TokenKind.NAME and tokens.peek().key in ("=", ":=", "==")):
        start = tokens.current
        if start.kind is TokenKind.KEYWORD:
            tokens.report_reserved_name()
        name = tokens.take_name()
        tokens.check_name_length(name)
        tokens.declared.add(name.key)
        expect_equals(tokens, f"the constant `{name.text}`", name.text)
        tokens.assignment_target = ""
        value = expression(tokens, "a value", f"after `{name.text} =`")
        constants.append(tokens.node(tree.Constant, start, name, value))
        tokens.accept_semicolon("after the constant")
    return constants


# module = "MODULE" name ";" ;
def _module(tokens: TokenStream) -> list[tree.Header]:
    start = tokens.current
    if tokens.index:
        text = "MODULE stands in front of everything else"
        tokens.report_once("E250", text, start.span, "too late here", advice="make it the first line of the file")
    tokens.accept_word("MODULE")
    name = tokens.take_name()
    tokens.check_name_length(name)
    tokens.in_module = True
    node = tokens.node(tree.Module, start, name)
    tokens.accept_semicolon("after the name of the module")
    return [node]


# import = "IMPORT" string [ "AS" name ] ";" ;
def _import(tokens: TokenStream) -> list[tree.Header]:
    start = tokens.take()
    token = tokens.current
    if token.kind is not TokenKind.STRING:
        tokens.fail("expected the name of a file after IMPORT", advice='write `IMPORT "cell.json" ;`')
    path, alias = tree.String(tokens.take().span, token.text[1:-1]), None
    if tokens.accept_word("AS"):
        if tokens.current.kind is not TokenKind.NAME:
            tokens.fail("expected a name after AS", advice='write `IMPORT "gripping.rlo" AS grip ;`')
        alias = tokens.take_name()
        tokens.check_name_length(alias)
    node = tokens.node(tree.Import, start, path, alias)
    tokens.accept_semicolon("after the import")
    return [node]


# record = "RECORD" name ";" decl { decl } "END" ";" ;
def _record(tokens: TokenStream) -> list[tree.Header]:
    start = tokens.current
    tokens.accept_word("RECORD")
    if tokens.current.kind is TokenKind.KEYWORD:
        tokens.report_reserved_name()
    name = tokens.take_name()
    tokens.check_name_length(name)
    tokens.accept_semicolon("after the name of the record")
    fields = declarations(tokens)
    if not fields:
        tokens.report_once("E111", "a record has no fields", tokens.gap_span(), "expected `name : TYPE ;` here")
    if not tokens.accept("END"):
        tokens.report_once("E115", "the record has no END", tokens.gap_span(), "expected `END ;` here")
    node = tokens.node(tree.Record, start, name, tuple(fields))
    tokens.accept_semicolon("after the record")
    return [node]


# units = "UNITS" unitname { "," unitname } ";" ;
def _units(tokens: TokenStream) -> list[tree.Header]:
    start = tokens.take()
    units = [_unit(tokens)]
    while tokens.current.key == "," or (tokens.current.kind is TokenKind.NAME and tokens.peek().key in (",", ";")):
        if not tokens.accept(","):
            tokens.insert_missing(",", "between two units")
        units.append(_unit(tokens))
    node = tokens.node(tree.Units, start, tuple(units))
    tokens.accept_semicolon("after the units")
    return [node]


def _unit(tokens: TokenStream) -> tree.Name:
    token = tokens.current
    tokens.note_expected_operand("a unit")
    if token.kind is not TokenKind.NAME:
        tokens.fail(f"expected a unit after `{tokens.previous.text}`", advice="write `UNITS MM, DEG ;`")
    return tokens.take_name()


# procedure = "PROCEDURE" name [ "(" param { "," param } ")" ] ";" [ var_part ] block ";" ;
# function  = "FUNCTION" name [ "(" param { "," param } ")" ] ":" type ";" [ var_part ] block ";" ;
def _procedure(tokens: TokenStream) -> list[tree.Header]:
    start = tokens.accept_word("FUNCTION") or tokens.take()
    name = _procedure_name(tokens)
    tokens.procedures.add(name.key)
    parameters = _parameters(tokens) if tokens.matches("(") else []
    head = tokens.span_since(start)
    result = _result_type(tokens) if start.key == "FUNCTION" else None
    if result is None:
        _skip_result_type(tokens)
    what = start.key.lower()
    tokens.accept_semicolon(f"after the head of the {what}")
    tokens.note_expected_words("VAR", "BEGIN", starts_statement=True)
    own = var_part(tokens) if tokens.matches("VAR") else []
    while tokens.matches("VAR"):
        text = "a procedure has one VAR part"
        tokens.report("E118", text, tokens.current.span, "remove this word", replacement="")
        own += var_part(tokens)
    tokens.note_expected_words("BEGIN", starts_statement=True)
    tokens.in_function = result is not None
    body = _procedure_body(tokens, head, name)
    tokens.in_function = False
    procedure = tokens.node(tree.Procedure, start, head, name, tuple(parameters), tuple(own), body, result)
    if tokens.matches("END") and tokens.peek().key != ".":
        tokens.report_once("E127", "`END` without BEGIN", tokens.current.span, "the procedure has ended before")
        tokens.take()
    if tokens.matches("."):
        tokens.report_once("E104", "a procedure ends with `;`", tokens.current.span, "write `;`", replacement=";")
        tokens.take()
    else:
        tokens.accept_semicolon(f"after the {what}")
    return [procedure]


def _procedure_name(tokens: TokenStream) -> tree.Name:
    token = tokens.current
    if token.kind is TokenKind.KEYWORD and tokens.peek().key in ("(", ";"):
        tokens.report_reserved_name()
    elif token.key in ("(", ";"):
        gap = tokens.gap_span()
        tokens.report_once("E111", "expected the name of the procedure", gap, f"found {describe_token(token)}")
        return tree.Name(gap, "", "")
    elif token.kind is not TokenKind.NAME:
        tokens.fail("expected the name of the procedure")
    name = tokens.take_name()
    tokens.check_name_length(name)
    return name


# param = [ "IN" | "INOUT" ] name { "," name } ":" type ;
def _parameters(tokens: TokenStream) -> list[tree.Declaration]:
    opening = tokens.take()
    parameters: list[tree.Declaration] = []
    if tokens.matches(")"):
        fix = Fix(opening.span.to(tokens.current.span), "")
        text = "a procedure without parameters is declared without `( )`"
        tokens.report_once("E111", text, tokens.current.span, "there is nothing in between", fixes=(fix,))
        tokens.take()
        return parameters
    while True:
        start = tokens.current
        if tokens.matches("VAR"):
            text = "a parameter has no VAR in front"
            tokens.report_once("E117", text, start.span, "leave it out", note=_NO_RESULTS)
            tokens.take()
        names: list[tree.Name] = []
        read = tokens.attempt(partial(mode_and_names, names=names))
        if read is None:
            tokens.skip_to(")", ";", "BEGIN", *tokens.vocabulary.headers)
            read = "", tokens.node(tree.TypeName, start, "", None)
        mode, kind = read
        parameters.append(tokens.node(tree.Declaration, start, tuple(names), kind, mode))
        if not _parameter_separator(tokens):
            break
    if not tokens.accept(")"):
        tokens.insert_missing(")", "after the parameters")
    return parameters


def _result_type(tokens: TokenStream) -> tree.TypeName:
    """Read the type of the value of a FUNCTION."""
    if not tokens.accept(":"):
        gap = tokens.gap_span()
        advice = "write `: SCALAR`, or PROCEDURE instead of FUNCTION if it has no value"
        text = "a FUNCTION needs the type of its value"
        tokens.report_once("E112", text, gap, "expected `:` and a type here", advice=advice)
        return tree.TypeName(gap, "", None)
    return tokens.attempt(type_name) or tokens.node(tree.TypeName, tokens.previous, "", None)


def _skip_result_type(tokens: TokenStream) -> None:
    """Pass over the type of what a procedure was meant to give back."""
    if not tokens.matches(":"):
        return
    start = tokens.take()
    tokens.skip_to(";", "VAR", "BEGIN")
    span = tokens.span_since(start)
    tokens.report_once("E117", "a procedure returns no value", span, "leave this out", note=_NO_RESULTS)


def _parameter_separator(tokens: TokenStream) -> bool:
    """Whether one more parameter follows."""
    if tokens.accept(","):
        return True
    token = tokens.current
    if token.key == ";" and tokens.peek().kind is TokenKind.NAME and tokens.peek(2).key in (",", ":"):
        tokens.report_once("E112", "expected `,` between two parameters", token.span, "write `,`", replacement=",")
        tokens.take()
        return True
    if token.kind is TokenKind.NAME and tokens.peek().key in (",", ":"):
        tokens.insert_missing(",", "between two parameters")
        return True
    return False


def _procedure_body(tokens: TokenStream, head: Span, name: tree.Name) -> tree.Block:
    """Read the statements of a procedure, also where BEGIN or END is missing."""
    token = tokens.current
    if token.kind is TokenKind.NAME and token.key not in tokens.declared and closest(token.text, ("BEGIN",)):
        _replace_misspelt_keyword(tokens, "BEGIN")
    elif not tokens.matches("BEGIN"):
        gap = tokens.gap_span()
        starts_statement = token.kind is TokenKind.NAME or tokens.matches(*tokens.vocabulary.statements)
        fixes = (Fix(token.gap, "BEGIN "),) if starts_statement else ()
        tokens.report_once("E115", "the procedure has no BEGIN", gap, "expected `BEGIN` here", fixes=fixes)
        if not starts_statement:
            return tree.Block(gap, (), gap)
    tokens.enclosing_procedure = name.key or "?"
    body = block(tokens)
    tokens.enclosing_procedure = ""
    return _restore_main_program(tokens, head, body)


def _restore_main_program(tokens: TokenStream, head: Span, body: tree.Block) -> tree.Block:
    """Give back the statements of the program itself, which a procedure without END has swallowed."""
    last = body.statements[-1] if body.statements else None
    open_ended = isinstance(last, tree.Block) and last.end.start == last.end.end
    if not open_ended or last is None or body.end.start != body.end.end or not tokens.matches("END"):
        return body
    while tokens.current.start > last.span.start:
        tokens.rewind(tokens.index - 1)
    tokens.diagnostics[:] = [diagnostic for diagnostic in tokens.diagnostics if diagnostic.span.start < last.span.start]
    gap = tokens.gap_span()
    label = Label(head, "this procedure")
    tokens.report_once("E115", "the procedure has no END", gap, "expected `END ;` here", secondary=(label,))
    tokens.suppress_reports()
    return tokens.node(tree.Block, body.span, body.statements[:-1], gap)


def late_header(tokens: TokenStream) -> tree.Statement:
    """Read a part that belongs in front of BEGIN, and keep what it declares."""
    word = tokens.current
    what = "declarations belong" if word.key == "VAR" else "it belongs"
    tokens.report("E118", f"{word.text} after BEGIN", word.span, f"{what} before BEGIN")
    tokens.late_headers += parse_header(tokens)
    # It has its own ``;``.
    tokens.suppress_reports()
    return tree.Poison(word.span)


_HEADERS: Mapping[str, Callable[[TokenStream], Sequence[tree.Header]]] = {
    "VAR": var_part,
    "MODULE": _module,
    "RECORD": _record,
    "CONST": _constants,
    "FUNCTION": _procedure,
    "IMPORT": _import,
    "UNITS": _units,
    "PROCEDURE": _procedure,
}
