"""Completions at a position of a program: words of the language, names of the right kind, whole statements."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import takewhile

import attrs
from lsprotocol.types import CompletionItem, CompletionItemKind as Kind, InsertTextFormat, Range, TextEdit

from armwright.program.language.error_kinds import KINDS
from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_arm
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Source
from armwright.program.language.units import DECLARABLE
from armwright.program.language.words import (
    BLOCK_CLOSERS,
    QUEUE_CLAUSES_IN_CONTEXT,
    SENSORS,
    STATEMENT_PHRASES,
    STATEMENTS_ALONE,
    STATEMENTS_BEFORE_ARM,
    STATEMENTS_BEFORE_FRAME,
    STATEMENTS_BEFORE_NAME,
    STATEMENTS_BEFORE_TEXT,
    VALUES,
    VOCABULARIES,
    WITH_CLAUSES_IN_CONTEXT,
    WORDS_IN_CONTEXT,
    Standard,
)
from armwright.program.language_server.analysis import Analysis, LexicalContext, lexical_context
from armwright.program.language_server.hover import signature
from armwright.program.language_server.keyword_docs import WORDS, WordDoc, word_doc
from armwright.program.language_server.positions import span_range
from armwright.program.language_server.records import array_before_point
from armwright.program.language_server.signature_help import enclosing_call
from armwright.program.language_server.symbol_index import NameKind
from armwright.program.records.layout import RecordVariable
from armwright.program.semantics.builtins import AXES, FUNCTIONS, JOINTS, MEASURES, WITH_AXIS, WITH_INPUT, WITH_QUEUE
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.expression_types import ACCEPTED_TYPES, ExpressionType
from armwright.program.semantics.symbols import PREDECLARED, Scope, Symbols
from armwright.program.syntax.expected_tokens import ExpectedTokens
from armwright.program.syntax.lexer import Token, TokenKind
from armwright.program.syntax.nodes import Name
from armwright.program.syntax.parser import expected_tokens

# Whole statements; ``${1:name}`` are the parts to fill in, in order.
_MOVE_WITH = "MOVE ${1:ARM_1} TO ${2:goal} WITH APPROACH = ${3:above} ;"
_SNIPPETS = {
    "MOVE": (("MOVE ... WITH APPROACH", _MOVE_WITH), ("MOVE ... TO", "MOVE ${1:ARM_1} TO ${2:goal} ;")),
    "FOR": (("FOR ... DO", "FOR ${1:i} = ${2:1} TO ${3:10} DO\nBEGIN\n  $0\nEND ;"),),
    "IF": (
        ("IF ... THEN", "IF ${1:condition} THEN\nBEGIN\n  $0\nEND ;"),
        ("IF ... THEN ... ELSE", "IF ${1:condition} THEN\nBEGIN\n  $2\nEND\nELSE\nBEGIN\n  $0\nEND ;"),
    ),
    "WHILE": (("WHILE ... DO", "WHILE ${1:condition} DO\nBEGIN\n  $0\nEND ;"),),
    "REPEAT": (("REPEAT ... UNTIL", "REPEAT\n  $0\nUNTIL ${1:condition} ;"),),
    "COBEGIN": (("COBEGIN ... COEND", "COBEGIN\n  BEGIN\n    $1\n  END ;\n  BEGIN\n    $0\n  END\nCOEND ;"),),
    "TRY": (("TRY ... RECOVER", "TRY\n  $1\nRECOVER\n  $0\nEND ;"),),
    "LOCK": (("LOCK ... DO", "LOCK (${1:name}) DO\nBEGIN\n  $0\nEND ;"),),
    "WHEN": (
        ("WHEN ... DO", "WHEN ${1:condition} DO\nBEGIN\n  BRAKE ;\n  $0\n  RESUME\nEND ;"),
        ("WHEN ... OFF", "WHEN ${1:name} OFF ;"),
    ),
    "QUEUE": (
        (
            "QUEUE ... DO",
            "QUEUE ${1:ARM_1} WITH CAPACITY = ${2:8} DO\nBEGIN\n  PUT ${3:frame} TO ${1:ARM_1} ;\n  $0\nEND ;",
        ),
    ),
    "BEGIN": (("BEGIN ... END", "BEGIN\n  $0\nEND ;"),),
    "MODULE": (("MODULE ...", "MODULE ${1:name} ;"),),
    "RECORD": (("RECORD ...", "RECORD ${1:name} ;\n  ${2:field} : ${3:SCALAR} ;\nEND ;"),),
    "PROCEDURE": (("PROCEDURE ...", "PROCEDURE ${1:name} (${2:part : FRAME}) ;\nBEGIN\n  $0\nEND ;"),),
    "FUNCTION": (("FUNCTION ...", "FUNCTION ${1:name} (${2:n : SCALAR}) : SCALAR ;\nBEGIN\n  RETURN $0\nEND ;"),),
    "VAR": (("VAR ...", "VAR ${1:part} : ${2|FRAME,TRANS,SCALAR,BOOLEAN,TEXT,EVENT|} ;"),),
    "CONST": (("CONST ...", "CONST ${1:name} = ${2:value} ;"),),
}
_WITH_CLAUSES = (*VOCABULARIES[Standard.RLO_2].with_clauses, *WITH_CLAUSES_IN_CONTEXT, *QUEUE_CLAUSES_IN_CONTEXT)
# How a word that wants more is written on.
_WORD_SNIPPETS = {
    "VIA": "VIA (${1:point})",
    **{word: f"{word} = ${{1:value}}" for word in (*_WITH_CLAUSES,)},
    "ON": "ON ${1:condition} DO ${2:HALT}",
    "VISIONS": "VISIONS (${1:frame})",
    "SYSTEM": "SYSTEM (${1:ARM_1})",
    "FORCE": "FORCE ${1:ARM_1}",
    "RAISE": "RAISE ${1:kind} WITH ${2:text}",
    "PULSE": "PULSE ${1:device} FOR ${2:0.5s}",
    "TIMER": "TIMER ${1:name} ${2|ON,OFF,TO 0|}",
    "PUT": "PUT ${1:frame} TO ${2:ARM_1}",
    "LOG": 'LOG "${1:name}" (${2:value})',
}
_KINDS = {VariableKind.FRAME: Kind.Struct, VariableKind.EVENT: Kind.Event}
_TYPES = frozenset((*VariableKind, "ARRAY"))
_VOCABULARY = VOCABULARIES[Standard.RLO_2]
_CLAUSES = frozenset(("DIRECTLY", "STRAIGHTLY", "CIRCULARLY", "SMOOTHLY", "VIA", *_WITH_CLAUSES))
_CLAUSE_ENDS = frozenset((";", *_VOCABULARY.block_ends, *_VOCABULARY.statements))
_BESIDE_CORRECTION = frozenset(
    ("DIRECTLY", "CIRCULARLY", "SMOOTHLY", "VIA", "APPROACH", "DEPARTURE", "BLEND", "TRACKING")
)
# Clauses that exclude others.
_EXCLUDES: Mapping[str, frozenset[str]] = {
    "DIRECTLY": frozenset(("STRAIGHTLY", "CIRCULARLY", "VIA", "APPROACH", "DEPARTURE", "TRACKING")),
    "STRAIGHTLY": frozenset(("DIRECTLY", "CIRCULARLY", "VIA", "APPROACH", "DEPARTURE")),
    "CIRCULARLY": frozenset(("DIRECTLY", "STRAIGHTLY", "SMOOTHLY", "APPROACH", "DEPARTURE", "BLEND", "TRACKING")),
    "SMOOTHLY": frozenset(("CIRCULARLY", "VIA", "BLEND", "TRACKING", "CORRECTION", "BOUND", "RATE")),
    "VIA": frozenset(("DIRECTLY", "STRAIGHTLY", "SMOOTHLY", "TRACKING")),
    **dict.fromkeys(("APPROACH", "DEPARTURE"), frozenset(("DIRECTLY", "STRAIGHTLY", "CIRCULARLY", "TRACKING"))),
    "BLEND": frozenset(("CIRCULARLY", "SMOOTHLY", "TRACKING")),
    "SPEED": frozenset(("DURATION", "VELOCITY")),
    "DURATION": frozenset(("SPEED", "VELOCITY")),
    "VELOCITY": frozenset(("SPEED", "DURATION", "TRACKING")),
    **dict.fromkeys(("ROTATION", "ACCELERATION"), frozenset(("TRACKING",))),
    "CORRECTION": _BESIDE_CORRECTION,
    **dict.fromkeys(("BOUND", "RATE"), _BESIDE_CORRECTION),
    "TRACKING": frozenset(
        (
            *("DIRECTLY", "CIRCULARLY", "SMOOTHLY", "VIA", "APPROACH", "DEPARTURE", "BLEND"),
            *("VELOCITY", "ROTATION", "ACCELERATION"),
        )
    ),
}


@attrs.frozen(kw_only=True)
class _OperandRule:
    """What may stand for a value or a name.

    Attributes:
        kinds: of variables; an array of elements of the kind may stand there too.
        arms: whether an arm may.
        devices: whether a device may.
        inputs: whether an input may.
        targets: whether a joint target may.
        functions: which functions of the language may.
        values: which values of the language may.
        words: other words with a meaning at this position.
    """

    kinds: frozenset[VariableKind] = frozenset()
    arms: bool = False
    devices: bool = False
    inputs: bool = False
    targets: bool = False
    functions: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    words: tuple[str, ...] = ()


_TRUTHS = ("FALSE", "TRUE")
_STEPS = tuple(name for name, signature in FUNCTIONS.items() if signature.result is ExpressionType.TRANS)
_NUMBERS = tuple(name for name, signature in FUNCTIONS.items() if signature.result is ExpressionType.SCALAR)
_FRAME, _SCALAR = frozenset((VariableKind.FRAME,)), frozenset((VariableKind.SCALAR,))
_ANY_VALUE = _OperandRule(
    kinds=frozenset(VariableKind) - {VariableKind.EVENT},
    arms=True,
    functions=tuple(name for name in FUNCTIONS if name != JOINTS),
    values=tuple(sorted(VALUES)),
)
_NUMBER = _OperandRule(kinds=_SCALAR, functions=_NUMBERS, values=("PI", "TIME"))
_CONDITION = _OperandRule(kinds=frozenset((VariableKind.SCALAR, VariableKind.BOOLEAN)), functions=_NUMBERS)
_TESTS = tuple(name for name, signature in FUNCTIONS.items() if signature.result is ExpressionType.CONDITION)
_CONDITION = attrs.evolve(_CONDITION, functions=(*_NUMBERS, *_TESTS), values=("PI", "TIME", *_TRUTHS), words=("NOT",))
_TEXT = _OperandRule(kinds=frozenset((VariableKind.TEXT,)), functions=("TEXT",), values=("MESSAGE",))
_POSE = _OperandRule(kinds=_FRAME, arms=True)
_TRANS = _OperandRule(kinds=frozenset((VariableKind.TRANS,)), functions=_STEPS)
_STEP = _OperandRule(kinds=frozenset((VariableKind.TRANS, VariableKind.FRAME)), arms=True, functions=_STEPS)
_EVENT = _OperandRule(kinds=frozenset((VariableKind.EVENT,)))
_RULES_BY_KIND = {
    VariableKind.SCALAR: _NUMBER,
    VariableKind.TRANS: _STEP,
    VariableKind.FRAME: _POSE,
    VariableKind.EVENT: _EVENT,
    VariableKind.BOOLEAN: _CONDITION,
    VariableKind.TEXT: _TEXT,
}
# By what the parser calls it in its messages.
_RULES_BY_NAME: Mapping[str, _OperandRule] = {
    "a value or a text": _ANY_VALUE,
    "a condition": _CONDITION,
    **dict.fromkeys(("a number", "a number of seconds", "a width"), _NUMBER),
    **dict.fromkeys(("an index", "the name of a SCALAR"), _OperandRule(kinds=_SCALAR)),
    **dict.fromkeys(("a pose", "the name of a FRAME or an arm"), _POSE),
    "a TRANS": _TRANS,
    "the name of a FRAME": _OperandRule(kinds=_FRAME),
    "the name of an EVENT": _EVENT,
    "the name of a variable": _OperandRule(kinds=frozenset(VariableKind)),
    "the name of a device": _OperandRule(devices=True),
    "an arm such as ARM_1": _OperandRule(arms=True),
    "a sensor": _OperandRule(words=SENSORS),
    "a unit": _OperandRule(words=DECLARABLE),
    "a kind of error": _OperandRule(words=tuple(KINDS)),
}
# What functions take.
_ARGUMENT_RULES: Mapping[str, _OperandRule] = {
    **dict.fromkeys(WITH_AXIS, _OperandRule(words=AXES)),
    "TEXT": _ANY_VALUE,
    **dict.fromkeys(WITH_INPUT, _OperandRule(inputs=True)),
    **dict.fromkeys(("OUTPUT", "SETTING"), _OperandRule(devices=True)),
    "TIMER": _OperandRule(),
    **dict.fromkeys(WITH_QUEUE, _OperandRule(arms=True)),
    "DIST": _POSE,
    **dict.fromkeys(("INV", *MEASURES), _STEP),
    **{
        name: _NUMBER
        for name, signature in FUNCTIONS.items()
        if signature.argument_types == ACCEPTED_TYPES[ExpressionType.SCALAR]
    },
    JOINTS: attrs.evolve(_NUMBER, targets=True),
}


def completions(codec: PositionCodec, analysis: Analysis, offset: int, *, snippets: bool) -> list[CompletionItem]:
    """Return what can be written at a position, the likeliest first: what the parser would accept there.

    Args:
        codec: of the program as it is now.
        analysis: of the program, or of what it was before, for its names.
        offset: the position.
        snippets: whether the editor leads from part to part of what is to be filled in.
    """
    compiled = analysis.compiled
    context = lexical_context(codec.text, offset, compiled.standard)
    if context is None:
        return []
    end = Token(TokenKind.END, "", "", context.word.start, context.word.start)
    source = Source(compiled.source.name, codec.text)
    expected = expected_tokens(source, (*context.preceding, end), compiled.standard, declared=compiled.symbols.types)
    procedure = expected.enclosing_procedure
    scope = compiled.symbols.scope(procedure if procedure in compiled.symbols.procedures else None)
    factory = _ItemFactory(analysis, span_range(codec, context.word), scope, snippets=snippets)
    operand = _operand_rule(expected, context.preceding, scope)
    words = (*operand.words, *_allowed_words(expected, context, compiled.standard))
    array = array_before_point(context.preceding)
    if array is not None:
        items = list(factory.fields(array.key, operand))
    elif expected.starts_statement:
        items = list(factory.words(words, starts=True))
        if "MOVE" in words or "HALT" in words:
            items += [*factory.procedures(), *factory.names(_ANY_VALUE.kinds, starts=True)]
    else:
        items = [*factory.arms(operand), *factory.names(operand.kinds), *factory.devices(operand)]
        items += factory.own_functions(operand)
        items += [*factory.functions(operand), *factory.values(operand), *factory.words(words)]
        items += factory.record_types() if "FRAME" in words else ()
    qualifier = codec.text[context.word.start : context.word.end].rpartition(".")[0].upper()
    if qualifier:
        # Behind the point of a record or a module its own names follow.
        items = [item for item in items if item.label.upper().startswith(f"{qualifier}.")]
    for number, item in enumerate(items):
        item.sort_text = f"{number:04d}"
    return items


def _operand_rule(expected: ExpectedTokens, tokens: Sequence[Token], scope: Scope) -> _OperandRule:
    """Return what may stand for the value or name that is looked for."""
    if expected.operand is None:
        return _OperandRule()
    operand, where = expected.operand
    rule = _RULES_BY_NAME.get(operand)
    call = enclosing_call(tokens)
    if call is not None and operand not in ("an index", "the name of a FRAME", "an arm such as ARM_1"):
        rule = _argument_rule(*call, scope.symbols)
    elif where in (f"after {word} =" for word in _WITH_CLAUSES if word not in ("APPROACH", "DEPARTURE")):
        rule = _NUMBER
    elif rule is None:
        # Behind a comma stands a number of a matrix.
        rule = _NUMBER if tokens[-1].key == "," else _rule_of_type(scope.type(expected.assignment_target))
    if operand == "a pose" and where == "after TO" and call is None:
        rule = attrs.evolve(rule, functions=(JOINTS,))
    if tokens and tokens[-1].key == "*":
        # Behind `*` stands a step.
        return _STEP if VariableKind.FRAME in rule.kinds else _TRANS if VariableKind.TRANS in rule.kinds else rule
    return rule


def _argument_rule(name: Token, number: int, symbols: Symbols) -> _OperandRule:
    procedure = symbols.procedures.get(name.key)
    if procedure is None or number >= len(procedure.parameters):
        return _ARGUMENT_RULES.get(name.key, _OperandRule()) if procedure is None else _OperandRule()
    return _rule_of_type(procedure.types.get(procedure.parameters[number]))


def _rule_of_type(variable: VariableType | None) -> _OperandRule:
    return _ANY_VALUE if variable is None else _RULES_BY_KIND[variable.kind]


def _allowed_words(expected: ExpectedTokens, context: LexicalContext, std: Standard) -> Iterator[str]:
    """Give the words that are valid at a position; of clauses those that go with the others of their MOVE."""
    following = takewhile(lambda token: token.key not in _CLAUSE_ENDS, context.following)
    written = expected.present_clauses | {token.key for token in following}
    allowed = VOCABULARIES[std].reserved | (WORDS_IN_CONTEXT if std is Standard.RLO_2 else frozenset())
    # What ends a block is not offered after each of its statements, unless it is being written.
    if not expected.starts_statement and context.word.start == context.word.end:
        allowed = allowed - BLOCK_CLOSERS - {"RECOVER"}
    if context.preceding and context.preceding[-1].key == "WAIT":
        allowed = allowed | {"UNTIL"}
    for word in dict.fromkeys(expected.words):
        last = word.rpartition(" ")[2]
        # The action of ON has ended before the position, or starts after it.
        if last in _CLAUSES and (last in written or _EXCLUDES.get(last, frozenset()) & written):
            continue
        if last in allowed and (word != "RETRY" or expected.is_in_recovery):
            yield word
    if expected.starts_statement and "READ" in expected.words and std is Standard.RLO_2:
        yield from (f"{word} {other}" for word, other in STATEMENT_PHRASES.items())
        yield from (*STATEMENTS_BEFORE_TEXT, *STATEMENTS_BEFORE_NAME, "WHEN", *STATEMENTS_ALONE)
        yield from (*STATEMENTS_BEFORE_ARM, *STATEMENTS_BEFORE_FRAME)


class _ItemFactory:
    """Makes completions for one position."""

    def __init__(self, analysis: Analysis, word: Range, scope: Scope, *, snippets: bool) -> None:
        self._analysis, self._word, self._scope, self._snippets = analysis, word, scope, snippets

    def _item(self, label: str, kind: Kind, text: str = "", detail: str = "", meaning: str = "") -> CompletionItem:
        """Return one thing that can be written; a text with parts to fill in is a snippet."""
        text_format = InsertTextFormat.PlainText
        if "$" in text:
            text, text_format = (text, InsertTextFormat.Snippet) if self._snippets else ("", text_format)
        return CompletionItem(
            label=label,
            kind=kind,
            detail=detail or None,
            documentation=meaning or None,
            insert_text_format=text_format,
            text_edit=TextEdit(self._word, text or label),
        )

    def _match_case(self, text: str) -> str:
        """Return words of the language as this program writes them; names to be filled in are lower case anyway."""
        return text.lower() if self._analysis.uses_lower_case else text

    def words(self, words: Iterable[str], *, starts: bool = False) -> Iterator[CompletionItem]:
        """Give words of the language and, where a statement starts, statements that begin with them."""
        for word in words:
            last = word.rpartition(" ")[2]
            doc = word_doc(word) or word_doc(last, "MOVE") or WordDoc("", "")
            # What stands before the last word, such as WITH, stays before its snippet.
            text = word.removesuffix(last) + _WORD_SNIPPETS.get(last, last)
            entries = [(word, Kind.TypeParameter if word in _TYPES else Kind.Keyword, text)]
            if starts and self._snippets:
                entries += [(label, Kind.Snippet, snippet) for label, snippet in _SNIPPETS.get(word, ())]
            for label, kind, text in entries:
                yield self._item(self._match_case(label), kind, self._match_case(text), doc.syntax, doc.text)

    def names(self, kinds: frozenset[VariableKind], *, starts: bool = False) -> Iterator[CompletionItem]:
        """Give the variables that can be seen and are of the right kind."""
        symbols, local = self._scope.symbols, self._scope.procedure
        local_types = {} if local is None else local.types
        global_types = [(key, kind) for key, kind in symbols.types.items() if key not in local_types]
        # What the program declares comes before what there is without it.
        global_types.sort(key=lambda item: item[0] not in symbols.declared)
        for key, kind in (*local_types.items(), *global_types):
            if kind is None or kind.kind not in kinds or (starts and key == WORLD):
                continue
            declared = self._scope.declared(key)
            name = self._written(key, declared) if declared else self._match_case(key)
            if not name:
                continue
            origin = "" if declared else "predeclared" if key in PREDECLARED else "imported"
            origin = f"of {local.node.name.text}" if local is not None and key in local_types else origin
            text = f"{name}[${{1:1}}]" if kind.sizes else name
            if kind.sizes and self._record_of(key) is not None:
                owner, _, field = name.rpartition(".")
                name, text = f"{owner}[].{field}", f"{owner}[${{1:1}}].{field}"
            item, detail = _KINDS.get(kind.kind, Kind.Variable), f"{kind} {origin}".rstrip()
            yield self._item(name, item, text, detail, self._parent(key, kind))

    def _record_of(self, key: str) -> RecordVariable | None:
        """Return the record that a variable is a field of; None where it is none."""
        owner, local = key.rpartition(".")[0], self._scope.procedure
        records = self._analysis.compiled.records
        own = {} if local is None else records.get(local.node.name.key, {})
        return own.get(owner) or records.get("", {}).get(owner)

    def fields(self, array: str, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give the fields of the elements of an array of records that are of the right kind, or all."""
        record = self._record_of(f"{array}.") or self._record_of(f"{self._analysis.scopes.meant(array, self._scope)}.")
        fields = {} if record is None else record.type.fields
        fits = {name: kind for name, kind in fields.items() if kind.key in operand.kinds}
        for name, kind in (fits or fields).items():
            assert record is not None  # noqa: S101 - it has fields
            yield self._item(record.type.names[name].text, Kind.Field, "", f"{kind.text} of {record.type.name.text}")

    def record_types(self) -> Iterator[CompletionItem]:
        """Give the types of records that the program sees."""
        compiled = self._analysis.compiled
        for key, kind in compiled.record_types.items():
            if name := self._written(key, kind.name):
                fields = ", ".join(field.text for field in kind.names.values())
                yield self._item(name, Kind.Struct, "", f"RECORD of {fields}")

    def _written(self, key: str, declared: Name) -> str:
        """Return how the program may write a name; empty for one of a module that it does not see."""
        compiled = self._analysis.compiled
        if self._scope.is_local(key) or not compiled.source.file_number(declared.span.start):
            return declared.text
        written = [name for name, meant in compiled.brought.items() if meant == key]
        if not written or any("." not in name for name in written):
            return declared.text if written else ""
        return f"{written[0].partition('.')[0].lower()}.{declared.text}"

    def _parent(self, key: str, kind: VariableType) -> str:
        frames = self._analysis.frames
        if kind != VariableType(VariableKind.FRAME) or frames is None or key not in frames or self._scope.is_local(key):
            return ""
        return f"attached to {frames.parent(key)} in the cell"

    def arms(self, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give the arms of the cell, or those of the program where there is none."""
        if not operand.arms:
            return
        cell = self._analysis.cell
        written = (occurrence.key for occurrence in self._analysis.occurrences if occurrence.kind is NameKind.ARM)
        used = dict.fromkeys(("ARM_1", *filter(is_arm, written)), "arm")
        arms = used if cell is None else {name: arm.arm.name for name, arm in cell.arms.items()}
        for name in sorted(arms):
            yield self._item(name, Kind.Constant, "", arms[name])

    def devices(self, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give the devices, inputs and joint targets of the cell."""
        if operand.targets and self._analysis.cell is not None:
            for name, target in sorted(self._analysis.cell.joint_targets.items()):
                yield self._item(self._match_case(name), Kind.Property, "", f"joint target of {target.arm}")
        if operand.inputs and self._analysis.cell is not None:
            for name in sorted(self._analysis.cell.inputs):
                yield self._item(self._match_case(name), Kind.Property, "", "input")
        if operand.devices and self._analysis.cell is not None:
            for name in sorted(self._analysis.cell.devices or ()):
                yield self._item(self._match_case(name), Kind.Property, "", "device")

    def functions(self, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give functions of the language, which RLO-83 has none of."""
        for name in operand.functions if self._analysis.compiled.standard is Standard.RLO_2 else ():
            cased, meaning = self._match_case(name), WORDS[name]
            yield self._item(cased, Kind.Function, f"{cased}($1)", meaning.syntax, meaning.text)

    def values(self, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give values of the language that nothing else is called like."""
        for name in filter(self._scope.is_value, operand.values):
            yield self._item(self._match_case(name), Kind.Constant, "", WORDS[name].syntax, WORDS[name].text)

    def own_functions(self, operand: _OperandRule) -> Iterator[CompletionItem]:
        """Give the functions of the program that have a value of the right kind."""
        for procedure in self._scope.symbols.procedures.values():
            name = self._written(procedure.node.name.key, procedure.node.name)
            if name and procedure.result is not None and procedure.result.kind in operand.kinds:
                yield self._item(name, Kind.Function, f"{name}($1)", signature(procedure.node)[0])

    def procedures(self) -> Iterator[CompletionItem]:
        """Give the procedures of the program."""
        for procedure in self._scope.symbols.procedures.values():
            name = self._written(procedure.node.name.key, procedure.node.name)
            if procedure.is_function or not name:
                continue
            text = f"{name}($1) ;" if procedure.parameters else f"{name}() ;"
            yield self._item(name, Kind.Function, text, signature(procedure.node)[0])
