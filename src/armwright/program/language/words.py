"""The words of the language in both standards: which are reserved, and which have a meaning in one place only."""

import enum
from typing import NamedTuple


class Standard(enum.StrEnum):
    """Which RLO a program is written in: that of the report, or the one that grants its wishes."""

    RLO_83 = "83"
    RLO_2 = "2"


STATEMENTS = ("AFFIX", "UNFIX", "OPEN", "GRASP", "OPERATE", "READ", "MOVE")
TYPES = ("SCALAR", "TRANS", "FRAME")
PLAIN_CLAUSES = ("DIRECTLY", "STRAIGHTLY", "VIA")
WITH_CLAUSES = ("APPROACH", "DEPARTURE", "SPEED")

# Words only after READ: programs may use them as names.
SENSORS = ("VISIONS", "SYSTEM")

# What starts a statement only in front of another word, and that word: programs may use both as names.
STATEMENT_PHRASES = {"ZERO": "FORCE"}


def statement_phrase(before: str, key: str, after: str) -> str:
    """Return the two words that start a statement together, where a word is one of them; empty where it is not.

    Args:
        before: the word in front of it, in upper case.
        key: the word.
        after: the word behind it.
    """
    pairs = (pair for pair in ((key, after), (before, key)) if STATEMENT_PHRASES.get(pair[0]) == pair[1])
    return " ".join(next(pairs, ()))


# What starts a statement in RLO-2, and what RLO-83 lacks. All of these may be names in RLO-83.
RLO_2_STATEMENTS = {
    "FOR": "RLO-83 has no loops",
    "WHILE": "RLO-83 has no loops",
    "REPEAT": "RLO-83 has no loops",
    "IF": "RLO-83 has no conditions",
    "COBEGIN": "RLO-83 has no concurrent branches",
    "SIGNAL": "RLO-83 has no events",
    "WAIT": "RLO-83 has no events",
    "PAUSE": "RLO-83 has no pauses",
    "LOCK": "RLO-83 has no locks",
    "TRY": "RLO-83 has no recovery",
    "RETRY": "RLO-83 has no recovery",
    "HALT": "RLO-83 ends a program at END.",
    "PRINT": "RLO-83 has no output",
}
RLO_2_HEADERS = {
    "IMPORT": "RLO-83 takes its frames from the cell file alone",
    "UNITS": "RLO-83 has lengths in metres only",
    "PROCEDURE": "RLO-83 has no procedures",
}
RLO_2_TYPES = {"ARRAY": "RLO-83 has no arrays", "EVENT": "RLO-83 has no events"}
RLO_2_WITH_CLAUSES = ("BLEND", "DURATION")

# Values that need no argument. What a program, its procedures or its cell call so comes first.
VALUES = frozenset(("PI", "TIME", "TRUE", "FALSE", "MESSAGE"))

# Functions of a name that is no variable: an input or a device of the cell, a timer, an axis.
FUNCTIONS_OF_NAMES = ("INPUT", "ANALOG", "OUTPUT", "SETTING", "TIMER", "FORCE", "TORQUE")

# Types, and what starts a part in front of BEGIN, that are reserved nowhere: programs may use all of them as names.
TYPES_IN_CONTEXT = ("BOOLEAN", "TEXT")
HEADERS_IN_CONTEXT = ("CONST", "FUNCTION", "MODULE", "RECORD")
# How a parameter is passed, in front of its name.
PARAMETER_MODES = ("IN", "INOUT")
# Clauses of MOVE that are words only where a clause may begin.
PLAIN_CLAUSES_IN_CONTEXT = ("CIRCULARLY", "SMOOTHLY")
WITH_CLAUSES_IN_CONTEXT = ("VELOCITY", "ROTATION", "ACCELERATION", "TRACKING", "CORRECTION", "BOUND", "RATE")
# A clause of QUEUE alone.
QUEUE_CLAUSES_IN_CONTEXT = ("CAPACITY",)
# What starts a statement only in front of a name.
STATEMENTS_BEFORE_NAME = ("PULSE", "RAISE", "TIMER")
# What starts a statement only in front of an arm, and of an arm or a name.
STATEMENTS_BEFORE_ARM, STATEMENTS_BEFORE_FRAME = ("QUEUE",), ("PUT",)
# What starts a statement only in front of a text.
STATEMENTS_BEFORE_TEXT = ("LOG",)
# What is a statement by itself, where neither `=` nor a bracket follows.
STATEMENTS_ALONE = ("BRAKE", "RESUME")
WORDS_IN_CONTEXT = frozenset(
    (
        *TYPES_IN_CONTEXT,
        *HEADERS_IN_CONTEXT,
        *PARAMETER_MODES,
        *PLAIN_CLAUSES_IN_CONTEXT,
        *WITH_CLAUSES_IN_CONTEXT,
        *QUEUE_CLAUSES_IN_CONTEXT,
        *STATEMENTS_BEFORE_NAME,
        *STATEMENTS_BEFORE_ARM,
        *STATEMENTS_BEFORE_FRAME,
        *STATEMENTS_BEFORE_TEXT,
        "AS",
        *STATEMENTS_ALONE,
        "RETURN",
        "WHEN",
        "WITHIN",
    )
)

# What other languages call a statement, and what they have and RLO has not.
FOREIGN_STATEMENTS = {
    **dict.fromkeys(("STOP", "EXIT", "QUIT", "ABORT"), "HALT"),
    **dict.fromkeys(("DELAY", "SLEEP"), "PAUSE"),
    **dict.fromkeys(("WRITE", "WRITELN", "SAY"), "PRINT"),
    **dict.fromkeys(("CLOSE", "GRIP"), "GRASP"),
    "ATTACH": "AFFIX",
    "DETACH": "UNFIX",
}
UNSUPPORTED_STATEMENTS = {
    **dict.fromkeys(("GOTO", "GO", "JUMP"), "RLO has no jumps; write WHILE, REPEAT or FOR"),
    **dict.fromkeys(("BREAK", "CONTINUE"), "a loop ends by its own condition only; write WHILE or REPEAT"),
    **dict.fromkeys(("CASE", "SWITCH"), "write `IF ... THEN ... ELSE IF ... THEN ...`"),
    **dict.fromkeys(("LET", "SET"), "an assignment has no keyword: `name = value`"),
    **dict.fromkeys(
        ("ENDIF", "ENDWHILE", "ENDFOR", "ENDDO", "FI", "OD"),
        "IF, WHILE and FOR contain one statement and have no end keyword; write `BEGIN ... END` around several",
    ),
    "RAISE": "write `RAISE kind`, with a name for errors of this kind",
    "TIMER": "write `TIMER name ON`",
    "PULSE": "write `PULSE device FOR seconds`",
    "PUT": "write `PUT f TO ARM_1`",
    "QUEUE": "write `QUEUE ARM_1 DO BEGIN ... END`",
    "LOG": 'write `LOG "name" (values)`',
    "CALL": "a procedure is called by its name: `name(...)`",
    "RETURN": "a procedure returns at its END; a FUNCTION returns a value by `RETURN value`",
}

COMPARISONS = ("<", "<=", "=", "<>", ">=", ">")
# How tightly operations bind; NOT stands between AND and the comparisons.
PRECEDENCE = {"OR": 1, "AND": 2, **dict.fromkeys(COMPARISONS, 4), "+": 5, "-": 5, "*": 6, "/": 6}
PRECEDENCE_OF_NOT = 3

# What opens and closes a stretch of statements in RLO-2.
BLOCK_OPENERS = frozenset(("BEGIN", "COBEGIN", "TRY", "REPEAT"))
BLOCK_CLOSERS = frozenset(("END", "COEND", "UNTIL"))

_RLO_83_KEYWORDS = ("VAR", "BEGIN", "END", "TO", "FROM", "AT", "WITH")
_RLO_2_KEYWORDS = (
    *("OF", "THEN", "ELSE", "DO", "UNTIL", "STEP", "COEND", "PRIORITY", "RECOVER"),
    *("ON", "OFF", "AND", "OR", "NOT", "RIGIDLY", "NONRIGIDLY"),
)


class Vocabulary(NamedTuple):
    """The words of one standard; a plain tuple, since the command line needs them for its --help.

    Attributes:
        name: of the standard.
        headers: what starts a part in front of BEGIN.
        statements: what starts a statement, but for names.
        block_ends: what ends a stretch of statements or a part of one.
        types: of single things.
        plain_clauses: clauses of MOVE that stand without WITH.
        with_clauses: those that stand behind WITH.
        reserved: all words that cannot be names.
        longest_name: of how many characters.
    """

    name: str
    headers: tuple[str, ...]
    statements: tuple[str, ...]
    block_ends: tuple[str, ...]
    types: tuple[str, ...]
    plain_clauses: tuple[str, ...]
    with_clauses: tuple[str, ...]
    reserved: frozenset[str]
    longest_name: int

    @property
    def clauses(self) -> tuple[str, ...]:
        """The words that start a clause of MOVE, and those that would with WITH in front."""
        return (*self.plain_clauses, "WITH", *self.with_clauses)


_RLO_83_RESERVED = frozenset((*_RLO_83_KEYWORDS, *STATEMENTS, *TYPES, *PLAIN_CLAUSES, *WITH_CLAUSES))
_RLO_2_RESERVED = frozenset((*_RLO_2_KEYWORDS, *RLO_2_STATEMENTS, *RLO_2_HEADERS, *RLO_2_TYPES, *RLO_2_WITH_CLAUSES))

# The longest name of RLO-83 is that of the report: "1-9 characters".
VOCABULARIES = {
    Standard.RLO_83: Vocabulary(
        name="RLO-83",
        headers=("VAR",),
        statements=STATEMENTS,
        block_ends=("END",),
        types=TYPES,
        plain_clauses=PLAIN_CLAUSES,
        with_clauses=WITH_CLAUSES,
        reserved=_RLO_83_RESERVED,
        longest_name=9,
    ),
    Standard.RLO_2: Vocabulary(
        name="RLO-2",
        headers=("VAR", *RLO_2_HEADERS),
        statements=(*STATEMENTS, *RLO_2_STATEMENTS, "BEGIN"),
        block_ends=("END", "UNTIL", "COEND", "PRIORITY", "RECOVER", "ELSE"),
        types=(*TYPES, "EVENT", *TYPES_IN_CONTEXT),
        plain_clauses=(*PLAIN_CLAUSES, "ON"),
        with_clauses=(*WITH_CLAUSES, *RLO_2_WITH_CLAUSES),
        reserved=_RLO_83_RESERVED | _RLO_2_RESERVED,
        longest_name=31,
    ),
}


def is_reserved_in_rlo_2_only(word: str) -> bool:
    """Whether a word, in upper case, is reserved in RLO-2 alone."""
    return word in _RLO_2_RESERVED
