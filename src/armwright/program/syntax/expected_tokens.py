"""What the parser would have accepted where a text is cut off, which is what can be written there."""

import attrs


@attrs.define
class ExpectedTokens:
    """What may stand behind the last token of a text; the parser takes note of it where it looks for it.

    Attributes:
        words: of the language, the likeliest first.
        operand: the value or name that is looked for, in the words of messages, and where; None where none is.
        starts_statement: whether a statement or a part of the program starts here.
        is_in_recovery: whether the position lies in the second part of a TRY.
        present_clauses: the words of the clauses that a MOVE has in front of the position.
        assignment_target: the key of the variable that gets the value; empty where none does.
        enclosing_procedure: the key of the procedure around the position; empty in the program itself.
    """

    words: list[str] = attrs.field(factory=list)
    operand: tuple[str, str] | None = None
    starts_statement: bool = False
    is_in_recovery: bool = False
    present_clauses: frozenset[str] = frozenset()
    assignment_target: str = ""
    enclosing_procedure: str = ""
