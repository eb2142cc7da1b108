"""What may stand at a place of a program, told from the words of the statement in front of it."""

from collections.abc import Mapping, Sequence

import attrs

from armwright.program.language.kinds import VariableKind
from armwright.program.language.units import DECLARABLE
from armwright.program.language.words import SENSORS, VOCABULARIES, Standard
from armwright.program.language_server.analysis import Before
from armwright.program.language_server.signature_help import open_call
from armwright.program.language_server.symbol_index import OPENERS
from armwright.program.semantics.builtins import AXES, FUNCTIONS
from armwright.program.semantics.symbols import Symbols
from armwright.program.syntax.lexer import Token, TokenKind

_OPERANDS = (TokenKind.NAME, TokenKind.ARM, TokenKind.NUMBER, TokenKind.STRING)
_STEPS = ("XYZ", "ROTX", "ROTY", "ROTZ", "INV")
_MEASURES = ("DIST", "FORCE")
# Ways that exclude each other, for one clause each.
_EXCLUDES: Mapping[str, frozenset[str]] = {
    "DIRECTLY": frozenset(("STRAIGHTLY", "VIA", "APPROACH", "DEPARTURE", "BLEND")),
    "STRAIGHTLY": frozenset(("DIRECTLY", "VIA", "APPROACH", "DEPARTURE", "BLEND")),
    **dict.fromkeys(("VIA", "APPROACH", "DEPARTURE", "BLEND"), frozenset(("DIRECTLY", "STRAIGHTLY"))),
    "SPEED": frozenset(("DURATION",)),
    "DURATION": frozenset(("SPEED",)),
}


@attrs.frozen(kw_only=True)
class Wanted:
    """What may stand at a place.

    Attributes:
        words: of the language.
        kinds: of variables; an array of elements of the kind may stand there too.
        arms: whether an arm may.
        devices: whether a device may.
        procedures: whether a call may.
        functions: which functions of the language may.
        starts: whether a statement or a part of the program starts here.
        fixed: other words with a meaning at this place.
    """

    words: tuple[str, ...] = ()
    kinds: frozenset[VariableKind] = frozenset()
    arms: bool = False
    devices: bool = False
    procedures: bool = False
    functions: tuple[str, ...] = ()
    starts: bool = False
    fixed: tuple[str, ...] = ()


_NOTHING = Wanted()
_ARM = Wanted(arms=True)
_FRAME = Wanted(kinds=frozenset((VariableKind.FRAME,)))
_MOBILE = Wanted(kinds=frozenset((VariableKind.FRAME,)), arms=True)
_EVENT = Wanted(kinds=frozenset((VariableKind.EVENT,)))
_SCALAR = Wanted(kinds=frozenset((VariableKind.SCALAR,)), functions=_MEASURES)
_COUNTER = Wanted(kinds=frozenset((VariableKind.SCALAR,)))
_TRANS = Wanted(kinds=frozenset((VariableKind.TRANS,)), functions=_STEPS)
_PLACE = Wanted(kinds=frozenset((VariableKind.FRAME,)), arms=True)
_STEP = Wanted(kinds=frozenset((VariableKind.TRANS, VariableKind.FRAME)), arms=True, functions=_STEPS)
_ANYTHING = Wanted(
    kinds=frozenset((VariableKind.SCALAR, VariableKind.TRANS, VariableKind.FRAME)),
    arms=True,
    functions=tuple(FUNCTIONS),
)
_CONDITION = Wanted(words=("NOT",), kinds=frozenset((VariableKind.SCALAR,)), functions=_MEASURES)
_OF_KIND = {
    VariableKind.SCALAR: _SCALAR,
    VariableKind.TRANS: _STEP,
    VariableKind.FRAME: _PLACE,
    VariableKind.EVENT: _EVENT,
}
_JOINTS = ("AND", "OR")

# What stands behind a word of a statement, and which words may follow that.
_AFTER: Mapping[tuple[str, str], tuple[Wanted, tuple[str, ...]]] = {
    ("MOVE", "MOVE"): (_MOBILE, ("TO",)),
    ("MOVE", "ON"): (_CONDITION, (*_JOINTS, "DO")),
    ("AFFIX", "AFFIX"): (_FRAME, ("TO",)),
    ("AFFIX", "TO"): (_MOBILE, ("AT", "RIGIDLY", "NONRIGIDLY")),
    ("AFFIX", "AT"): (_TRANS, ("RIGIDLY", "NONRIGIDLY")),
    ("UNFIX", "UNFIX"): (_FRAME, ("FROM",)),
    ("UNFIX", "FROM"): (_MOBILE, ()),
    ("OPEN", "OPEN"): (_ARM, ("TO",)),
    ("OPEN", "TO"): (_SCALAR, ()),
    ("GRASP", "GRASP"): (_ARM, ()),
    ("OPERATE", "OPERATE"): (Wanted(devices=True), ("ON", "OFF")),
    ("READ", "READ"): (Wanted(fixed=SENSORS), ()),
    ("SIGNAL", "SIGNAL"): (_EVENT, ()),
    ("WAIT", "WAIT"): (_EVENT, ()),
    ("PAUSE", "PAUSE"): (_SCALAR, ()),
    ("IF", "IF"): (_CONDITION, (*_JOINTS, "THEN")),
    ("WHILE", "WHILE"): (_CONDITION, (*_JOINTS, "DO")),
    ("UNTIL", "UNTIL"): (_CONDITION, _JOINTS),
    ("FOR", "FOR"): (_COUNTER, ()),
    ("FOR", "="): (_SCALAR, ("TO",)),
    ("FOR", "TO"): (_SCALAR, ("STEP", "DO")),
    ("FOR", "STEP"): (_SCALAR, ("DO",)),
    ("LOCK", "LOCK"): (_NOTHING, ("DO",)),
    ("UNITS", "UNITS"): (Wanted(fixed=DECLARABLE), ()),
}
# What stands in the parentheses behind a word.
_INSIDE: Mapping[str, Wanted] = {
    "VIA": _PLACE,
    "LOCK": Wanted(kinds=frozenset(VariableKind)),
    "PRINT": _ANYTHING,
    "VISIONS": _FRAME,
    "SYSTEM": _ARM,
}
_HEADERS = frozenset(("VAR", "UNITS", "IMPORT", "PROCEDURE"))
_CLOSERS = {"BEGIN": ("END",), "TRY": ("RECOVER",), "RECOVER": ("END",), "REPEAT": ("UNTIL",), "COBEGIN": ("COEND",)}


def wanted(before: Before, symbols: Symbols, std: Standard) -> Wanted:
    """Return what may stand at a place.

    Args:
        before: what stands in front of it.
        symbols: the names of the program.
        std: the language.
    """
    statement = _statement(before.tokens)
    if not statement:
        return _start(before, std)
    found = _inside(before, statement, symbols, std)
    at = len(before.tokens) - len(statement)
    if found.words and at > 0 and before.tokens[at - 1].key == "THEN":
        return attrs.evolve(found, words=(*found.words, "ELSE"))
    return found


def _inside(before: Before, statement: Sequence[Token], symbols: Symbols, std: Standard) -> Wanted:
    """Return what may stand at a place inside of a statement or header."""
    head, last = statement[0].key, statement[-1]
    if head in _HEADERS or _declares(before, statement):
        return _header(statement, std)
    behind = last.kind in _OPERANDS or last.key in (")", "]")
    asked = _bracket(statement, symbols)
    if asked is not None:
        return _NOTHING if behind else _behind_sign(asked, last)
    if head == "MOVE":
        found = _move(statement, before, std, behind=behind)
        if found is not None:
            return found
    if statement[0].kind in (TokenKind.NAME, TokenKind.ARM):
        return _assignment(statement, before, behind=behind)
    lead = _lead(statement)
    if (pair := _AFTER.get((head, lead))) is None:
        return _NOTHING
    asked, follows = pair
    return Wanted(words=_known(follows, std)) if behind else _behind_sign(asked, last)


def _known(words: Sequence[str], std: Standard) -> tuple[str, ...]:
    reserved = VOCABULARIES[std].reserved
    return tuple(word for word in words if word in reserved)


def _behind_sign(asked: Wanted, last: Token) -> Wanted:
    """Return what is wanted as the second part of an operation: behind `*` a step."""
    if last.key == "*" and VariableKind.FRAME in asked.kinds:
        return _STEP
    return _TRANS if last.key == "*" and VariableKind.TRANS in asked.kinds else asked


# ---- where the statement starts ------------------------------------------------------------------------------------


def _statement(tokens: Sequence[Token]) -> Sequence[Token]:
    """Return the tokens of the statement, or header, that is being written behind some tokens."""
    at = len(tokens)
    while at > 0:
        key, kind = tokens[at - 1].key, tokens[at - 1].kind
        if key in OPENERS and kind is not TokenKind.NAME:
            break
        if key == ":" and at > 2 and tokens[at - 3].key == "PRIORITY":
            break
        if kind is TokenKind.KEYWORD and key in ("END", "COEND"):
            break
        at -= 1
        if kind is TokenKind.KEYWORD and key in _STARTING and not _is_action(tokens, at):
            return tokens[at:]
    found = tokens[at:]
    if at and tokens[at - 1].key == "DO" and any(token.key == "," for token in _outside(found)):
        # The action of ON is over; what follows the comma is a clause of the MOVE around it.
        while at > 0 and tokens[at].key != "MOVE" and tokens[at].key != ";":
            at -= 1
        return tokens[at:] if tokens[at].key == "MOVE" else found
    return found


def _is_action(tokens: Sequence[Token], at: int) -> bool:
    return at > 0 and tokens[at - 1].key == "DO"


_STARTING = frozenset((*VOCABULARIES[Standard.RLO_2].statements, *_HEADERS, "UNTIL"))


def _outside(tokens: Sequence[Token]) -> list[Token]:
    """Return the tokens that stand in no brackets."""
    found, depth = [], 0
    for token in tokens:
        depth -= token.key in (")", "]")
        if depth <= 0:
            found.append(token)
        depth += token.key in ("(", "[")
    return found


def _lead(statement: Sequence[Token]) -> str:
    """Return the last word, or ``=`` of FOR, that stands in no brackets."""
    outside = _outside(statement)
    words = [
        token.key for token in outside if token.kind is TokenKind.KEYWORD and token.key not in ("AND", "OR", "NOT")
    ]
    if words and words[-1] == "FOR" and any(token.key == "=" for token in outside):
        return "="
    return words[-1] if words else ""


# ---- the parts of a program ----------------------------------------------------------------------------------------


def _start(before: Before, std: Standard) -> Wanted:
    """Return what may start here: a statement, or a part of the program in front of BEGIN."""
    vocabulary = VOCABULARIES[std]
    if before.depth <= 0:
        return Wanted(words=(*vocabulary.headers, "BEGIN"), starts=True)
    opened = _opened(before.tokens)
    words = (*vocabulary.statements, *_known(_CLOSERS.get(opened, ("END",)), std))
    if opened == "COBEGIN":
        return Wanted(words=("BEGIN", "PRIORITY", "COEND"), starts=True)
    if opened != "RECOVER":
        words = tuple(word for word in words if word != "RETRY")
    return Wanted(words=words, kinds=frozenset(VariableKind) - {VariableKind.EVENT}, procedures=True, starts=True)


def _opened(tokens: Sequence[Token]) -> str:
    """Return the innermost word that has opened a stretch of statements."""
    depth = 0
    for token in reversed(tokens):
        if token.kind is not TokenKind.KEYWORD:
            continue
        if token.key in ("END", "COEND", "UNTIL"):
            depth += 1
        elif token.key in ("BEGIN", "COBEGIN", "REPEAT", "TRY"):
            if depth == 0:
                return token.key
            depth -= 1
        elif token.key == "RECOVER" and depth == 0:
            return token.key
    return ""


def _declares(before: Before, statement: Sequence[Token]) -> bool:
    return before.depth <= 0 and statement[0].kind is TokenKind.NAME


def _header(statement: Sequence[Token], std: Standard) -> Wanted:
    vocabulary = VOCABULARIES[std]
    last = statement[-1].key
    if statement[0].key == "UNITS":
        return Wanted(fixed=DECLARABLE) if last in ("UNITS", ",") else _NOTHING
    if last in (":", "OF"):
        later = ("ARRAY",) if last == ":" and "ARRAY" in vocabulary.reserved else ()
        return Wanted(words=(*vocabulary.types, *later))
    return Wanted(words=("OF",)) if last == "]" else _NOTHING


# ---- the parts of a statement --------------------------------------------------------------------------------------


def _bracket(statement: Sequence[Token], symbols: Symbols) -> Wanted | None:
    """Return what the innermost open bracket wants; None where none is open, or it groups a part of a whole."""
    depth = 0
    for at in range(len(statement) - 1, 0, -1):
        key = statement[at].key
        if key in (")", "]"):
            depth += 1
        elif key in ("(", "["):
            if depth == 0:
                if key == "[":
                    return _COUNTER
                name = statement[at - 1]
                if name.key in _INSIDE:
                    return _INSIDE[name.key]
                return _argument(statement, symbols) if name.kind is TokenKind.NAME else None
            depth -= 1
    return None


def _argument(statement: Sequence[Token], symbols: Symbols) -> Wanted:
    found = open_call(statement)
    if found is None:
        return _NOTHING
    name, number = found
    procedure = symbols.procedures.get(name.key)
    if procedure is not None:
        if number >= len(procedure.parameters):
            return _NOTHING
        kind = procedure.types.get(procedure.parameters[number])
        return _ANYTHING if kind is None else _OF_KIND[kind.kind]
    return _TAKEN.get(name.key, _NOTHING)


_TAKEN: Mapping[str, Wanted] = {
    "FORCE": Wanted(fixed=AXES),
    "DIST": _PLACE,
    "INV": _STEP,
    **dict.fromkeys(("XYZ", "ROTX", "ROTY", "ROTZ"), _SCALAR),
}


def _assignment(statement: Sequence[Token], before: Before, *, behind: bool) -> Wanted:
    if behind or not any(token.key == "=" for token in _outside(statement)):
        return _NOTHING
    kind = before.scope.type(statement[0].key)
    return _behind_sign(_ANYTHING if kind is None else _OF_KIND[kind.kind], statement[-1])


def _move(statement: Sequence[Token], before: Before, std: Standard, *, behind: bool) -> Wanted | None:
    """Return what may stand in a MOVE behind its goal; None for what stands in front of that."""
    keys = [token.key for token in _outside(statement)]
    lead, last = _lead(statement), statement[-1]
    if "TO" not in keys or lead == "ON":
        return None
    vocabulary = VOCABULARIES[std]
    if last.key != ",":
        if lead == "TO" and not behind:
            return _behind_sign(_PLACE, last)
        if lead == "VIA" and last.key == "VIA":
            return _NOTHING
        if lead in vocabulary.with_clauses and not (behind and "=" in keys[_last_index(keys, lead) :]):
            return _NOTHING if last.key == lead or behind else _behind_sign(_of_clause(lead), last)
    rest = _outside(before.behind[: _end(before.behind)])
    given = frozenset((*keys, *(token.key for token in rest)))
    with_words = legal(vocabulary.with_clauses, given)
    if lead == "WITH":
        return Wanted(words=with_words)
    plain = legal(vocabulary.plain_clauses, given)
    return Wanted(words=(*plain, *(f"WITH {word}" for word in with_words)))


def _last_index(keys: Sequence[str], key: str) -> int:
    return len(keys) - 1 - keys[::-1].index(key)


def _of_clause(word: str) -> Wanted:
    return _PLACE if word in ("APPROACH", "DEPARTURE") else _SCALAR


def legal(clauses: Sequence[str], given: frozenset[str]) -> tuple[str, ...]:
    """Return the clauses that may stand in a MOVE beside those given."""
    return tuple(
        word
        for word in clauses
        if word == "ON" or (word not in given and not _EXCLUDES[word] & given and (word != "BLEND" or "VIA" in given))
    )


def _end(tokens: Sequence[Token]) -> int:
    """Return how many tokens belong to the rest of a statement."""
    for at, token in enumerate(tokens):
        if token.key == ";" or (token.kind is TokenKind.KEYWORD and token.key in _STOPS):
            return at
    return len(tokens)


_STOPS = frozenset(("END", "ELSE", "COEND", "UNTIL", "RECOVER", *VOCABULARIES[Standard.RLO_2].statements))
