"""The parser: one function for each rule of the grammar, with the rule above it. It never stops at the first error.

What is missing and obvious is put in, what is misspelt is replaced, and what makes no sense is passed over up to the
next statement; each is reported once.
"""

from collections.abc import Collection, Mapping, Sequence

from armwright.program.language.diagnostic import Diagnostic, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.words import Standard
from armwright.program.syntax import control_flow, devices, frames, output, rlo83, tree
from armwright.program.syntax.expected_tokens import Expected
from armwright.program.syntax.headers import head, late
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.move import move
from armwright.program.syntax.split_names import declared_names, joined
from armwright.program.syntax.statement_list import statements
from armwright.program.syntax.token_stream import Rule, Tokens

# statement = assign | affix | ... | move | block | "IF" ... | "WHILE" ... | "REPEAT" ... | ... | name "(" ... ")" ;
_RULES: Mapping[str, Rule] = {
    "=": frames.assign,
    "AFFIX": frames.affix,
    "UNFIX": frames.unfix,
    "OPEN": devices.open_hand,
    "GRASP": devices.grasp,
    "OPERATE": devices.operate,
    "READ": devices.read,
    "MOVE": move,
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
    "LOCK": control_flow.lock,
    "TRY": control_flow.try_,
    "RETRY": control_flow.retry,
    "HALT": control_flow.halt,
    "PRINT": output.printing,
    # Reported: these belong in front of BEGIN.
    **dict.fromkeys(("VAR", "IMPORT", "UNITS", "PROCEDURE"), late),
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
    cursor, torn = _cursor(source, tokens, standard, declared)
    cursor.procedures.update(procedures)
    tree_, slips = program(cursor), cursor.diagnostics
    if standard is Standard.RLO_83:
        tree_, slips = rlo83.conform(tree_, slips, source, cursor.tokens)
    return tree_, [*torn, *slips]


def expected(
    source: Source, tokens: Sequence[Token], standard: Standard = Standard.RLO_2, *, declared: Collection[str] = ()
) -> Expected:
    """Return what may stand behind the last token of a text; the arguments are those of ``parse``."""
    cursor, _ = _cursor(source, tokens, standard, declared)
    cursor.expected = Expected()
    program(cursor)
    return cursor.expected


def _cursor(
    source: Source, tokens: Sequence[Token], standard: Standard, declared: Collection[str]
) -> tuple[Tokens, list[Diagnostic]]:
    """Stand in front of the first token; return what is wrong with names that blanks tear apart, too."""
    tokens, torn = joined(source, tokens, declared)
    if standard is Standard.RLO_83:
        tokens = rlo83.reserve(tokens, {*declared, *declared_names(tokens)})
    cursor = Tokens(source, tokens, _RULES, standard)
    cursor.declared.update(declared)
    return cursor, torn


# program = { header } block "." ;
# block   = "BEGIN" statements "END" ;
def program(tokens: Tokens) -> tree.Program:
    """Read a whole program."""
    start = tokens.now
    headers = head(tokens)
    read: list[tree.Statement] = []
    if not tokens.done:
        read += _statements(tokens)
        while not tokens.done and not _ends(tokens):
            read += _statements(tokens)
    elif not tokens.silent:
        begun = tokens.before.key == "BEGIN"
        if begun:
            tokens.offer(*tokens.words.statements, "END", starts=True)
        span = tokens.gap() if headers or begun else Span(0, 0)
        text = "the program has no statements" if headers else "there is no program here"
        text, expected = ("the program has no END", "END.") if begun else (text, "BEGIN ... END.")
        tokens.report("E115", text, span, f"expected `{expected}`")
    return tree.Program(tokens.since(start), (*headers, *tokens.late), tuple(read), tokens.before.span)


def _statements(tokens: Tokens) -> tuple[tree.Statement, ...]:
    """Read statements up to END, which stays."""
    read = statements(tokens, "END")
    if tokens.done:
        tokens.say_once("E115", "the program has no END", tokens.gap(), "expected `END.` here")
    return read


def _ends(tokens: Tokens) -> bool:
    """Read END and the point behind it; whether the program is over."""
    end = tokens.take()
    gap = tokens.gap()
    if tokens.accept("."):
        if not tokens.done:
            last = tokens.now
            tokens.report("E114", "text after the end of the program", last.span, "the program ended with `END.`")
            while not tokens.done:
                tokens.take()
            return True
    elif tokens.done or (tokens.sees(";") and tokens.ahead().kind is TokenKind.END):
        if not tokens.now.damaged:
            semicolon = tokens.accept(";")
            text, note = "the program does not end with `.`", "the last END of an RLO program is written `END.`"
            fix = Fix(gap.to(semicolon.span) if semicolon else gap, ".")
            tokens.report("E110", text, gap, "expected `.` here", note=note, fixes=(fix,))
    else:
        text, advice = "END closes the program, but more follows", "leave it out, or write BEGIN before what it ends"
        tokens.report("E114", text, end.span, "the program would end here", advice=advice)
        tokens.spare += 1
        return False
    return True
