"""The parser: one function for each rule of the grammar, with the rule above it. It never stops at the first error.

What is missing and obvious is put in, what is misspelt is replaced, and what makes no sense is passed over up to the
next statement; each is reported once.
"""

from collections.abc import Collection, Mapping, Sequence

from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.syntax import control_flow, devices, frames, output, queues, rlo83, tree
from armwright.program.syntax.expected_tokens import ExpectedTokens
from armwright.program.syntax.headers import late_header, parse_headers
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.move import move
from armwright.program.syntax.split_names import declared_names, join_split_names
from armwright.program.syntax.statement_list import statements
from armwright.program.syntax.token_stream import Rule, TokenStream

# statement = assign | affix | ... | move | block | "IF" ... | "WHILE" ... | "REPEAT" ... | ... | name "(" ... ")" ;
_RULES: Mapping[str, Rule] = {
    "=": frames.assign,
    "AFFIX": frames.affix,
    "UNFIX": frames.unfix,
    "OPEN": devices.open_,
    "GRASP": devices.grasp,
    "OPERATE": devices.operate,
    "PULSE": devices.pulse,
    "TIMER": devices.timer,
    "READ": devices.read,
    "ZERO": devices.zero_force,
    "MOVE": move,
    "QUEUE": queues.queue,
    "PUT": queues.put,
    "(": control_flow.call,
    "BEGIN": control_flow.block,
    "IF": control_flow.if_,
    "WHILE": control_flow.while_,
    "REPEAT": control_flow.repeat,
    "FOR": control_flow.for_,
    "COBEGIN": control_flow.cobegin,
    "SIGNAL": control_flow.signal,
    "WAIT": control_flow.wait,
    "PAUSE": control_flow.pause,
    "WHEN": control_flow.when,
    "BRAKE": control_flow.brake,
    "RESUME": control_flow.resume,
    "LOCK": control_flow.lock,
    "TRY": control_flow.try_,
    "RETRY": control_flow.retry,
    "HALT": control_flow.halt,
    "RAISE": control_flow.raise_,
    "RETURN": control_flow.return_,
    "PRINT": output.print_,
    "LOG": output.log,
    # Reported: these belong in front of BEGIN.
    **dict.fromkeys(("VAR", "IMPORT", "UNITS", "PROCEDURE"), late_header),
}


def parse(
    source: Source,
    tokens: Sequence[Token],
    standard: Standard = Standard.RLO_2,
    *,
    declared: Collection[str] = (),
    procedures: Collection[str] = (),
) -> tuple[tree.Program, list[Diagnostic]]:
    """Return the syntax tree of a program and what is wrong with its syntax.

    Args:
        source: the text, for messages.
        tokens: of the text, the last being its end.
        standard: the language; the tokens are of the same. All programs are read as RLO-2; what in one of RLO-83
            belongs to RLO-2 is named and passed over.
        declared: names of variables that were declared before this text.
        procedures: names of procedures that were.
    """
    stream, split = _token_stream(source, tokens, standard, declared)
    stream.procedures.update(procedures)
    program, diagnostics = _program(stream), stream.diagnostics
    if standard is Standard.RLO_83:
        program, diagnostics = rlo83.check_conformance(program, diagnostics, source, stream.tokens)
    return program, [*split, *diagnostics]


def expected_tokens(
    source: Source, tokens: Sequence[Token], standard: Standard = Standard.RLO_2, *, declared: Collection[str] = ()
) -> ExpectedTokens:
    """Return what may stand behind the last token of a text; the arguments are those of ``parse``."""
    stream, _ = _token_stream(source, tokens, standard, declared)
    stream.expected = ExpectedTokens()
    _program(stream)
    return stream.expected


def _token_stream(
    source: Source, tokens: Sequence[Token], standard: Standard, declared: Collection[str]
) -> tuple[TokenStream, list[Diagnostic]]:
    """Stand in front of the first token; return what is wrong with names that blanks tear apart, too."""
    tokens, split = join_split_names(source, tokens, declared)
    if standard is Standard.RLO_83:
        tokens = rlo83.reserve_rlo_2_words(tokens, {*declared, *declared_names(tokens)})
    stream = TokenStream(source, tokens, _RULES, standard)
    stream.declared.update(declared)
    return stream, split


# program = { header } block "." ;
# block   = "BEGIN" statements "END" ;
def _program(tokens: TokenStream) -> tree.Program:
    start = tokens.current
    headers = parse_headers(tokens)
    read: list[tree.Statement] = []
    if not tokens.is_at_end:
        read += _statements(tokens)
        while not tokens.is_at_end and not _end_program(tokens):
            read += _statements(tokens)
    elif not tokens.is_reported:
        begun = tokens.previous.key == "BEGIN"
        if begun:
            tokens.note_expected_words(*tokens.vocabulary.statements, "END", starts_statement=True)
        first = tokens.source.file_start(tokens.current.start)
        span = tokens.gap_span() if headers or begun else Span(first, first)
        text = "the program has no statements" if headers else "there is no program here"
        text, missing = ("the program has no END", "END.") if begun else (text, "BEGIN ... END.")
        tokens.report("E115", text, span, f"expected `{missing}`")
    headers += tokens.late_headers
    return tokens.node(tree.Program, start, tuple(headers), tuple(read), tokens.previous.span)


def _statements(tokens: TokenStream) -> tuple[tree.Statement, ...]:
    """Read statements up to END, which stays."""
    read = statements(tokens, "END")
    if tokens.is_at_end:
        tokens.report_once("E115", "the program has no END", tokens.gap_span(), "expected `END.` here")
    return read


def _end_program(tokens: TokenStream) -> bool:
    """Read END and the point behind it; whether the program is over."""
    end = tokens.take()
    gap = tokens.gap_span()
    if tokens.accept("."):
        if not tokens.is_at_end:
            span = tokens.current.span
            tokens.report("E114", "text after the end of the program", span, "the program ended with `END.`")
            tokens.skip_to()
    elif tokens.is_at_end or (tokens.matches(";") and tokens.peek().kind is TokenKind.END):
        if not tokens.current.damaged:
            semicolon = tokens.accept(";")
            text, note = "the program does not end with `.`", "the last END of an RLO program is written `END.`"
            fix = Fix(gap.to(semicolon.span) if semicolon else gap, ".")
            tokens.report("E110", text, gap, "expected `.` here", note=note, fixes=(fix,))
    else:
        text, advice = "END closes the program, but more follows", "leave it out, or write BEGIN before what it ends"
        tokens.report("E114", text, end.span, "the program would end here", advice=advice)
        tokens.surplus_ends += 1
        return False
    return True
