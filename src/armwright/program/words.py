"""The words of the language: which are reserved, which have a meaning in one place only, which belong to RLO-2."""

STATEMENTS = ("AFFIX", "UNFIX", "OPEN", "GRASP", "OPERATE", "READ", "MOVE")
TYPES = ("SCALAR", "TRANS", "FRAME")
PLAIN_CLAUSES = ("DIRECTLY", "STRAIGHTLY", "VIA")
WITH_CLAUSES = ("APPROACH", "DEPARTURE", "SPEED")
CLAUSES = (*PLAIN_CLAUSES, "WITH", *WITH_CLAUSES)

RESERVED = frozenset(("VAR", "BEGIN", "END", "TO", "FROM", "AT", *STATEMENTS, *TYPES, *CLAUSES))

# Words only after READ: programs may use them as names.
SENSORS = ("VISIONS", "SYSTEM")

# The longest name; the report says "1-9 characters".
LONGEST_NAME = 9

# What starts a statement in RLO-2, and what RLO-83 lacks. All of these may be names in RLO-83.
LATER_STATEMENTS = {
    "FOR": "RLO-83 has no loops",
    "WHILE": "RLO-83 has no loops",
    "REPEAT": "RLO-83 has no loops",
    "IF": "RLO-83 has no conditions",
    "COBEGIN": "RLO-83 has no branches side by side",
    "SIGNAL": "RLO-83 has no events",
    "WAIT": "RLO-83 has no events",
    "PAUSE": "RLO-83 has no pauses",
    "LOCK": "RLO-83 has no locks",
    "TRY": "RLO-83 has no recovery",
    "RETRY": "RLO-83 has no recovery",
    "HALT": "RLO-83 runs to END.",
    "PRINT": "RLO-83 has no output",
}
LATER_HEADERS = {
    "IMPORT": "RLO-83 takes its frames from the cell file alone",
    "UNITS": "RLO-83 counts lengths in metres",
    "PROCEDURE": "RLO-83 has no procedures",
}
LATER_TYPES = {"ARRAY": "RLO-83 has no arrays", "EVENT": "RLO-83 has no events"}
LATER_WITH = ("BLEND", "DURATION")

# What opens and closes a stretch of statements in RLO-2.
OPENING = frozenset(("BEGIN", "COBEGIN", "TRY", "REPEAT"))
CLOSING = frozenset(("END", "COEND", "UNTIL"))
