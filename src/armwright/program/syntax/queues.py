"""Parsing QUEUE and PUT."""

from armwright.errors import closest
from armwright.program.language.diagnostic import did_you_mean
from armwright.program.language.words import PRECEDENCE
from armwright.program.syntax import tree
from armwright.program.syntax.control_flow import accept_else
from armwright.program.syntax.expressions import expression, mobile
from armwright.program.syntax.lexer import TokenKind
from armwright.program.syntax.move import clause_words, valued_clause
from armwright.program.syntax.statement_list import nested_statement
from armwright.program.syntax.token_stream import TokenStream, either

_ARM = "an arm such as ARM_1"


# queue = "QUEUE" arm { [","] "WITH" ( "CAPACITY" | "SPEED" | "VELOCITY" | "BLEND" ) "=" expr } "DO" statement ;
def queue(tokens: TokenStream) -> tree.Queue:
    """Read one QUEUE."""
    start = tokens.current
    tokens.accept_word("QUEUE")
    arm = mobile(tokens, _ARM, "after QUEUE")
    clauses = _queue_clauses(tokens)
    head = tokens.span_since(start)
    tokens.expect("DO", "after the clauses" if clauses else "after the arm", statement=True)
    return tokens.node(tree.Queue, start, head, arm, clauses, nested_statement(tokens, "DO"))


# put = "PUT" term "TO" arm [ "ELSE" statement ] ;
def put(tokens: TokenStream) -> tree.Put:
    """Read one PUT."""
    start = tokens.current
    tokens.accept_word("PUT")
    frame = expression(tokens, "a pose", "after PUT", PRECEDENCE["*"])
    tokens.expect("TO", "after the frame")
    arm = mobile(tokens, _ARM, "after TO")
    head = tokens.span_since(start)
    otherwise = nested_statement(tokens, "ELSE") if accept_else(tokens) else None
    return tokens.node(tree.Put, start, head, frame, arm, otherwise)


def _queue_clauses(tokens: TokenStream) -> tuple[tree.Clause, ...]:
    """Read the clauses of a QUEUE; one that is none is passed over."""
    clauses: list[tree.Clause] = []
    while tokens.current.key != ";":
        comma = tokens.accept(",")
        if tokens.is_at_end:
            words = (f"WITH {word}" for word in tree.QUEUE_WORDS)
            tokens.note_expected_words("DO", *words, present_clauses=clause_words(clauses))
        start = tokens.accept("WITH")
        if start is None:
            if comma:
                tokens.fail("expected a clause after `,`")
            break
        tokens.note_expected_words(*tree.QUEUE_WORDS, present_clauses=clause_words(clauses))
        word = tokens.current
        key = word.key if word.key in tree.QUEUE_WORDS else closest(word.text, tree.QUEUE_WORDS)
        if key != word.key:
            text, label = f"unknown clause `WITH {word.text}` of QUEUE", f"expected {either(tree.QUEUE_WORDS)}"
            tokens.report("E256", text, word.span, label, advice=did_you_mean(key))
        if key is None:
            tokens.skip_to(",", "WITH", "DO", ";", "BEGIN")
            continue
        word.kind = TokenKind.KEYWORD
        tokens.take()
        clauses.append(valued_clause(tokens, start, key))
    return tuple(clauses)
