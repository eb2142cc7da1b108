"""What can be written at a place of a program: words of the language, names of the right kind, whole statements."""

import enum
from collections.abc import Iterator

import attrs

from armwright.program.language.kinds import VariableKind, VariableType
from armwright.program.language.names import is_arm
from armwright.program.language.source import Span
from armwright.program.language_server.analysis import Before, View
from armwright.program.language_server.expected import Wanted, wanted
from armwright.program.language_server.hover import signature
from armwright.program.language_server.keyword_docs import explained
from armwright.program.semantics.cell_symbols import WORLD
from armwright.program.semantics.symbols import PREDECLARED


class Sort(enum.Enum):
    """What is offered."""

    WORD = "word"
    SNIPPET = "snippet"
    TYPE = "type"
    VARIABLE = "variable"
    FRAME = "frame"
    EVENT = "event"
    ARM = "arm"
    DEVICE = "device"
    PROCEDURE = "procedure"
    FUNCTION = "function"


@attrs.frozen(kw_only=True)
class Completion:
    """One thing that can be written.

    Attributes:
        label: how it is shown.
        text: what is written; in a snippet ``${1:name}`` are the places to fill in, in order.
        sort: what it is.
        span: what it takes the place of.
        detail: what it is, in a word or two.
        documentation: what it does.
        snippet: whether the text has places to fill in.
    """

    label: str
    text: str
    sort: Sort
    span: Span
    detail: str = ""
    documentation: str = ""
    snippet: bool = False


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
    "BEGIN": (("BEGIN ... END", "BEGIN\n  $0\nEND ;"),),
    "PROCEDURE": (("PROCEDURE ...", "PROCEDURE ${1:name} (${2:part : FRAME}) ;\nBEGIN\n  $0\nEND ;"),),
    "VAR": (("VAR ...", "VAR ${1:part} : ${2|FRAME,TRANS,SCALAR,EVENT|} ;"),),
}
# How a word that wants more is written on.
_GOES_ON = {
    "VIA": "VIA (${1:point})",
    **{word: f"{word} = ${{1:value}}" for word in ("APPROACH", "DEPARTURE", "SPEED", "BLEND", "DURATION")},
    "ON": "ON ${1:condition} DO ${2:HALT}",
    "VISIONS": "VISIONS (${1:frame})",
    "SYSTEM": "SYSTEM (${1:ARM_1})",
}
_SORTS = {
    VariableKind.SCALAR: Sort.VARIABLE,
    VariableKind.TRANS: Sort.VARIABLE,
    VariableKind.FRAME: Sort.FRAME,
    VariableKind.EVENT: Sort.EVENT,
}
_TYPES = frozenset((*VariableKind, "ARRAY"))


def completions(view: View, offset: int) -> list[Completion]:
    """Return what can be written at a place, the likeliest first."""
    if view.in_comment(offset):
        return []
    before = view.before(offset)
    compiled = view.analysis.compiled
    asked = wanted(before, compiled.symbols, compiled.standard)
    maker = _Maker(view, before)
    found = [*maker.arms(asked), *maker.names(asked)] if not asked.starts else []
    found += [*maker.devices(asked), *maker.functions(asked), *maker.words(asked)]
    if asked.starts:
        found += [*maker.procedures(asked), *maker.names(asked)]
    return found


class _Maker:
    """Makes completions for one place."""

    def __init__(self, view: View, before: Before) -> None:
        self._analysis, self._span, self._scope = view.analysis, before.word, before.scope
        self._lower = view.analysis.lower

    def _one(self, label: str, sort: Sort, text: str = "", detail: str = "", documentation: str = "") -> Completion:
        return Completion(
            label=label,
            text=text or label,
            sort=sort,
            span=self._span,
            detail=detail,
            documentation=documentation,
            snippet="$" in text,
        )

    def _cased(self, text: str) -> str:
        """Return words of the language as this program writes them; what is to be filled in stays."""
        return text.lower() if self._lower else text

    def words(self, asked: Wanted) -> Iterator[Completion]:
        """Give words of the language, and statements that begin with them."""
        for word in (*asked.words, *asked.fixed):
            last = word.rpartition(" ")[2]
            meaning = explained(last, "MOVE")
            form, text = (meaning.form, meaning.text) if meaning else ("", "")
            written = _GOES_ON.get(last, "")
            written = (f"WITH {written}" if word != last else written) if written else ""
            sort = Sort.TYPE if word in _TYPES else Sort.WORD
            yield self._one(self._cased(word), sort, self._snippet(written) or self._cased(word), form, text)
            if asked.starts:
                for label, snippet in _SNIPPETS.get(word, ()):
                    yield self._one(self._cased(label), Sort.SNIPPET, self._snippet(snippet), form, text)

    def _snippet(self, text: str) -> str:
        if not self._lower:
            return text
        # A choice of types is a choice of words; names to be filled in are lower case anyway.
        return text.lower()

    def names(self, asked: Wanted) -> Iterator[Completion]:
        """Give the variables that can be seen and are of the right kind."""
        symbols, local = self._scope.symbols, self._scope.procedure
        own = {} if local is None else local.types
        others = [(key, kind) for key, kind in symbols.types.items() if key not in own]
        # What the program declares comes before what there is without it.
        others.sort(key=lambda one: one[0] not in symbols.declared)
        for key, kind in (*own.items(), *others):
            if kind is None or kind.kind not in asked.kinds or (asked.starts and key == WORLD):
                continue
            declared = self._scope.declared(key)
            name = declared.text if declared else self._cased(key)
            where = "predeclared" if declared is None and key in PREDECLARED else "imported" if declared is None else ""
            where = f"of {local.node.name.text}" if local is not None and key in own else where
            text = f"{name}[${{1:1}}]" if kind.sizes else name
            yield self._one(name, _SORTS[kind.kind], text, f"{kind} {where}".rstrip(), self._place(key, kind))

    def _place(self, key: str, kind: VariableType) -> str:
        frames = self._analysis.frames
        if kind != VariableType(VariableKind.FRAME) or frames is None or key not in frames or self._scope.is_local(key):
            return ""
        return f"hangs on {frames.parent(key)} in the cell"

    def arms(self, asked: Wanted) -> Iterator[Completion]:
        """Give the arms of the cell, or those of the program where there is none."""
        if not asked.arms:
            return
        cell = self._analysis.cell
        if cell is not None:
            for name in sorted(cell.arms):
                yield self._one(name, Sort.ARM, "", cell.arms[name].arm.name)
            return
        used = {key for key in self._analysis.by_key if is_arm(key)}
        for name in sorted(used | {"ARM_1"}):
            yield self._one(name, Sort.ARM, "", "arm")

    def devices(self, asked: Wanted) -> Iterator[Completion]:
        """Give the devices of the cell."""
        if asked.devices and self._analysis.cell is not None:
            for name in sorted(self._analysis.cell.devices or ()):
                yield self._one(self._cased(name), Sort.DEVICE, "", "device")

    def functions(self, asked: Wanted) -> Iterator[Completion]:
        """Give functions of the language."""
        for name in asked.functions:
            meaning = explained(name)
            form, text = (meaning.form, meaning.text) if meaning else ("", "")
            yield self._one(self._cased(name), Sort.FUNCTION, f"{self._cased(name)}($1)", form, text)

    def procedures(self, asked: Wanted) -> Iterator[Completion]:
        """Give the procedures of the program."""
        if asked.procedures:
            for procedure in self._scope.symbols.procedures.values():
                name = procedure.node.name.text
                text = f"{name}($1) ;" if procedure.parameters else f"{name}() ;"
                yield self._one(name, Sort.PROCEDURE, text, signature(procedure.node)[0])
