"""From records to their fields: ``p : part`` becomes ``p.weight``, ``p.place``, and so does whatever is done with it.

Nothing behind this pass knows records. An array of records is an array for each field.
"""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import attrs

from armwright.errors import closest, counted
from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, Label, did_you_mean
from armwright.program.language.kinds import VariableKind
from armwright.program.language.words import VALUES
from armwright.program.modules.rewriting import Rewriter
from armwright.program.semantics.builtins import FUNCTIONS, WITH_NAME
from armwright.program.semantics.expression_types import quote_expression
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax import tree

# What a field may be: an EVENT has no value that could be assigned.
_FIELD_KINDS = frozenset(VariableKind) - {VariableKind.EVENT}
# The frame of that name belongs to an arm.
_NO_FIELD = "BASE"


@attrs.frozen(eq=False)
class RecordType:
    """A RECORD.

    Attributes:
        name: of the type.
        fields: the types of the fields, by key.
        names: the fields as they are declared, by key.
    """

    name: tree.Name
    fields: Mapping[str, tree.TypeName]
    names: Mapping[str, tree.Name]


@attrs.frozen(eq=False)
class RecordVariable:
    """A variable that is a record, or an array of records.

    Attributes:
        name: its declaration.
        type: what it is, or each element.
        sizes: of an array; empty for a single one.
    """

    name: tree.Name
    type: RecordType
    sizes: tuple[tree.Number, ...] = ()

    def __str__(self) -> str:
        """Return the type as a declaration writes it."""
        sizes = ",".join(number.text for number in self.sizes)
        return f"ARRAY [{sizes}] OF {self.type.name.text}" if sizes else self.type.name.text


Variables: TypeAlias = dict[str, RecordVariable]


@attrs.frozen(kw_only=True)
class LaidOutProgram:
    """A program without records.

    Attributes:
        tree: what it says, with a variable for each field.
        variables: the records of the program, by key, and those of each procedure, by its key and theirs.
        types: the types of records, by key.
        diagnostics: what is wrong with its records.
    """

    tree: tree.Program
    variables: Mapping[str, Mapping[str, RecordVariable]] = attrs.field(factory=dict)
    types: Mapping[str, RecordType] = attrs.field(factory=dict)
    diagnostics: list[Diagnostic] = attrs.field(factory=list)


def lay_out(program: tree.Program) -> LaidOutProgram:
    """Put fields in the place of records; a program without records stays as it is."""
    own = [(*node.parameters, *node.declarations) for node in program.procedures]
    declarations = [*program.declarations, *(declaration for part in own for declaration in part)]
    has_records = any(isinstance(header, tree.Record) for header in program.headers)
    if not has_records and all(declaration.type.record is None for declaration in declarations):
        return LaidOutProgram(tree=program)
    return _Layout(program).result()


class _Layout:
    """One pass over a program."""

    def __init__(self, program: tree.Program) -> None:
        self._program = program
        self._diagnostics = DiagnosticList()
        self._report = self._diagnostics.report
        self._types: dict[str, RecordType] = {}
        self._used: set[int] = set()
        self._reported: set[tuple[int, str]] = set()
        for header in program.headers:
            if isinstance(header, tree.Record):
                self._declare_type(header)
        self._globals = self._variables(program.declarations)
        constants, procedures = program.constants, program.procedures
        others = (*(node.name for node in constants), *(node.name for node in procedures))
        self._report_duplicates(program.declarations, (*(one.name for one in self._types.values()), *others))
        self._procedures = {node.name.key: node for node in program.procedures}
        self._parameters = {key: self._variables(node.parameters) for key, node in self._procedures.items()}
        declared = (name for one in program.declarations for name in one.names)
        self._known = {*(name.key for name in (*declared, *others)), *PREDECLARED, *VALUES, *FUNCTIONS}
        self._locals: Variables = {}
        self._hidden: frozenset[str] = frozenset()
        self._all: dict[str, Variables] = {"": self._globals}
        self._rewriter = Rewriter(self._variable, lambda name: name, self._is_special, self._replaced)

    def result(self) -> LaidOutProgram:
        """Lay the whole program out."""
        headers = [part for header in self._program.headers for part in self._header(header)]
        statements = tuple(map(self._rewriter, self._program.statements))
        whole = attrs.evolve(self._program, headers=tuple(headers), statements=statements)
        for variables in self._all.values():
            for variable in variables.values():
                if id(variable) not in self._used:
                    text = f"`{variable.name.text}` is never used"
                    self._report("L304", text, variable.name.span, "declared here")
        return LaidOutProgram(tree=whole, variables=self._all, types=self._types, diagnostics=self._diagnostics)

    # ---- declarations ----------------------------------------------------------------------------------------------

    def _declare_type(self, node: tree.Record) -> None:
        fields: dict[str, tree.TypeName] = {}
        names: dict[str, tree.Name] = {}
        for declaration in node.fields:
            kind = declaration.type
            if kind.record is not None or kind.sizes or (kind.key is not None and kind.key not in _FIELD_KINDS):
                text = f"a field is {', '.join(sorted(_FIELD_KINDS))}, and not {kind.text}"
                self._report("E260", text, kind.span, "no type of a field")
                kind = attrs.evolve(kind, key=None, sizes=(), record=None)
            for name in declaration.names:
                if name.key in fields or name.key == _NO_FIELD:
                    twice = name.key in fields
                    text = f"field `{name.text}` is declared twice" if twice else f"no field is called `{name.text}`"
                    note = "" if twice else "this is the name of the base of an arm"
                    self._report("E260", text, name.span, "again here" if twice else "another name", note=note)
                    continue
                fields[name.key], names[name.key] = kind, name
        first = self._types.setdefault(node.name.key, RecordType(node.name, fields, names))
        if first.name is not node.name:
            text, here = f"`{node.name.text}` is declared twice", (Label(first.name.span, "first declared here"),)
            self._report("E203", text, node.name.span, "again here", secondary=here)

    def _variables(self, declarations: tuple[tree.Declaration, ...]) -> Variables:
        """Return the records among the variables of declarations."""
        found: Variables = {}
        for declaration in declarations:
            written = declaration.type.record
            if written is None:
                continue
            known = self._types.get(written.key)
            if known is None:
                continue  # names are checked later
            for name in declaration.names:
                found.setdefault(name.key, RecordVariable(name, known, declaration.type.sizes))
        return found

    def _report_duplicates(
        self, declarations: tuple[tree.Declaration, ...], others: tuple[tree.Name, ...] = ()
    ) -> None:
        """Report a name of a record that stands for something else too, as later nobody knows the name."""
        names = [(name, one.type.record is not None) for one in declarations for name in one.names]
        records = {name.key for name, is_record in names if is_record} | {one.name.key for one in self._types.values()}
        first: dict[str, tree.Name] = {}
        for name in sorted((*others, *(name for name, _ in names)), key=lambda name: name.span):
            if name.key in records and first.setdefault(name.key, name) is not name:
                text, here = f"`{name.text}` is declared twice", (Label(first[name.key].span, "first declared here"),)
                self._report("E203", text, name.span, "again here", secondary=here)

    def _header(self, header: tree.Header) -> Iterator[tree.Header]:
        match header:
            case tree.Record():
                return
            case tree.Declaration():
                yield from self._declaration(header, self._globals)
            case tree.Procedure():
                yield self._procedure(header)
            case _:
                yield header

    def _procedure(self, node: tree.Procedure) -> tree.Procedure:
        own = (*node.parameters, *node.declarations)
        self._locals = self._variables(own)
        self._report_duplicates(own)
        self._all[node.name.key] = self._locals
        self._hidden = frozenset(name.key for declaration in own for name in declaration.names)
        body = attrs.evolve(node.body, statements=tuple(map(self._rewriter, node.body.statements)))
        parts = [
            tuple(part for one in declarations for part in self._declaration(one, self._locals))
            for declarations in (node.parameters, node.declarations)
        ]
        result = node.result
        if result is not None and result.record is not None:
            text, advice = "the value of a FUNCTION cannot be a record", "let a PROCEDURE set an INOUT parameter"
            self._report("E260", text, result.span, "no value", advice=advice)
            result = attrs.evolve(result, key=None, record=None)
        # A parameter may be there for the sake of others.
        names = (name.key for declaration in node.parameters for name in declaration.names)
        self._used |= {id(self._locals[key]) for key in names if key in self._locals}
        self._locals, self._hidden = {}, frozenset()
        return attrs.evolve(node, parameters=parts[0], declarations=parts[1], body=body, result=result)

    def _declaration(self, node: tree.Declaration, variables: Variables) -> Iterator[tree.Declaration]:
        """Give a declaration, or one for each field of each record that it declares."""
        if node.type.record is None:
            yield node
            return
        if node.type.record.key not in self._types:
            near = closest(node.type.record.text, [one.name.text for one in self._types.values()])
            if near is None:
                yield node
                return
            text = f"unknown type `{node.type.record.text}`"
            self._report("E205", text, node.type.record.span, "no type", advice=did_you_mean(near))
            yield attrs.evolve(node, type=attrs.evolve(node.type, key=None, record=None))
            return
        for name in node.names:
            variable = variables[name.key]
            if variable.name is not name:
                continue
            for key, kind in variable.type.fields.items():
                field = _part(name, key, variable)
                typed = attrs.evolve(kind, sizes=node.type.sizes)
                yield attrs.evolve(node, names=(field,), type=typed)

    # ---- names -----------------------------------------------------------------------------------------------------

    def _found(self, key: str) -> RecordVariable | None:
        """Return a record that a name stands for here."""
        if key in self._hidden:
            return self._locals.get(key)
        return self._globals.get(key)

    def _variable(self, name: tree.Name) -> tree.Name | tree.Poison:
        """Check the name of a variable: a field of a record is one, a record is none."""
        if (variable := self._found(name.key)) is not None:
            self._used.add(id(variable))
            self._report_whole(name, variable)
            return tree.Poison(name.span)
        owner, point, field = name.key.rpartition(".")
        variable = self._found(owner) if point else None
        if variable is None:
            return name
        self._used.add(id(variable))
        if field in variable.type.fields:
            return name
        if (id(variable), field) not in self._reported:
            self._reported.add((id(variable), field))
            written = name.text.rpartition(".")[2]
            near = closest(written, [one.text for one in variable.type.names.values()])
            known = ", ".join(one.text for one in variable.type.names.values())
            text = f"`{variable.name.text}` is a {variable.type.name.text} and has no field `{written}`"
            advice = did_you_mean(near) or f"its fields are {known}"
            here = (Label(variable.type.name.span, "declared here"),)
            self._report("E261", text, name.span, "unknown field", secondary=here, advice=advice)
        return tree.Poison(name.span)

    def _report_whole(self, node: tree.Expression, variable: RecordVariable) -> None:
        first = next(iter(variable.type.names.values()), variable.name)
        text = f"{quote_expression(node)} is {_phrase(variable)}, and one of its fields is needed here"
        index = f"[{','.join('1' * len(variable.sizes))}]" if variable.sizes and isinstance(node, tree.Name) else ""
        written = quote_expression(node).strip("`")
        advice = f"write `{written}{index}.{first.text}`"
        self._report("E262", text, node.span, "a whole record", advice=advice)

    def _is_unknown(self, name: tree.Name) -> bool:
        """Whether nothing has a name; files that are imported may have frames of any name."""
        is_known = name.key in self._known or name.key in self._hidden or "." in name.key
        return not is_known and not self._program.imports

    def _is_special(self, node: tree.Function) -> bool:
        return node.name.key in WITH_NAME and node.name.key not in self._procedures

    def _record(self, node: tree.Node) -> RecordVariable | None:
        """Return the record that an expression is as a whole: a variable, or an element of an array."""
        name = node.name if isinstance(node, tree.Index) else node
        variable = self._found(name.key) if isinstance(name, tree.Name) else None
        if variable is None or (isinstance(node, tree.Index) and not variable.sizes):
            return None
        return attrs.evolve(variable, sizes=()) if isinstance(node, tree.Index) else variable

    def _fields(self, node: Any, variable: RecordVariable) -> list[tree.Expression]:
        """Return the fields of a record, one expression each."""
        name = node.name if isinstance(node, tree.Index) else node
        found = self._found(name.key)
        if found is not None:
            self._used.add(id(found))
        parts = [_part(name, key, variable) for key in variable.type.fields]
        if isinstance(node, tree.Index):
            indices = tuple(map(self._rewriter, node.indices))
            return [attrs.evolve(node, name=part, indices=indices) for part in parts]
        return list(parts)

    # ---- statements and values -------------------------------------------------------------------------------------

    def _replaced(self, node: tree.Node) -> tree.Node | None:
        """Return what stands for a statement or value about whole records; None for any other."""
        replaced: tree.Node | None = None
        match node:
            case tree.Assign():
                replaced = self._assignment(node)
            case tree.Index() if (variable := self._record(node)) is not None:
                self._fields(node, variable)
                self._report_whole(node, variable)
                replaced = tree.Poison(node.span)
            case tree.Call() | tree.Function() if node.name.key in self._procedures:
                replaced = self._call(node)
            case tree.Print() | tree.Log():
                replaced = attrs.evolve(node, items=self._spread(node.items))
            case tree.Function() if node.name.key == "TEXT":
                replaced = attrs.evolve(node, arguments=self._spread(node.arguments))
            case tree.Lock():
                replaced = attrs.evolve(node, targets=self._spread(node.targets), body=self._rewriter(node.body))
        return replaced

    def _spread(self, nodes: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return expressions with the fields of a record in its place."""
        spread: list[Any] = []
        for node in nodes:
            variable = self._record(node)
            spread += [self._rewriter(node)] if variable is None else self._fields(node, variable)
        return tuple(spread)

    def _assignment(self, node: tree.Assign) -> tree.Node | None:
        target, value = self._record(node.target), self._record(node.value)
        if target is None and value is None:
            return None
        is_one = target is not None and not target.sizes and value is not None and not value.sizes
        if target is None or value is None or not is_one or target.type is not value.type:
            for part, variable in ((node.target, target), (node.value, value)):
                if variable is not None:
                    self._fields(part, variable)
            what = "no record" if target is None else _phrase(target)
            other = "none" if value is None else _phrase(value)
            text = f"{quote_expression(node.target)} is {what}, but {quote_expression(node.value)} is {other}"
            if target is not None and value is not None and _alike(target, value):
                text = f"{quote_expression(node.target)} is {what}, which is not assigned as a whole"
            advice = "assign the elements one by one" if target is not None and target.sizes else ""
            self._report("E262", text, node.value.span, "another type", advice=advice)
            return tree.Poison(node.span)
        pairs = zip(self._fields(node.target, target), self._fields(node.value, value), strict=True)
        parts = tuple(tree.Assign(node.span, to, part) for to, part in pairs)  # type: ignore[arg-type]
        return tree.Block(node.span, parts, node.span)

    def _call(self, node: tree.Call | tree.Function) -> tree.Node | None:
        """Return a call with the fields of records as its arguments."""
        procedure = self._procedures[node.name.key]
        records = self._parameters[node.name.key]
        parameters = [name for declaration in procedure.parameters for name in declaration.names]
        if not records and not any(self._record(argument) for argument in node.arguments):
            return None
        if len(parameters) != len(node.arguments):
            for argument in node.arguments:
                if (given := self._record(argument)) is not None:
                    self._fields(argument, given)
            takes, count = counted(len(parameters), "argument"), len(node.arguments)
            text, here = f"`{node.name.text}` takes {takes}, not {count}", (Label(procedure.head, "declared here"),)
            self._report("E220", text, node.span, f"{count} given here", secondary=here)
            return tree.Poison(node.span)
        arguments: list[Any] = []
        for parameter, argument in zip(parameters, node.arguments, strict=True):
            wanted, given = records.get(parameter.key), self._record(argument)
            if given is not None:
                arguments += self._fields(argument, given)
            elif wanted is None:
                arguments.append(self._rewriter(argument))
            if wanted is not None and isinstance(argument, tree.Name) and self._is_unknown(argument):
                near = did_you_mean(closest(argument.text, [one.name.text for one in self._globals.values()]))
                text = f"`{argument.text}` is not declared"
                self._report("E202", text, argument.span, "unknown name", advice=near)
                return tree.Poison(node.span)
            if (wanted is None) != (given is None) or (wanted and given and not _alike(wanted, given)):
                what, written = _phrase(wanted) if wanted else "no record", quote_expression(argument)
                text = f"parameter `{parameter.text}` of `{node.name.text}` is {what}"
                text += f", but {written} is {_phrase(given) if given else 'none'}"
                here = (Label(parameter.span, "declared here"),)
                self._report("E262", text, argument.span, "another type", secondary=here)
                return tree.Poison(node.span)
        return attrs.evolve(node, arguments=tuple(arguments))


def _part(name: tree.Name, field: str, variable: RecordVariable) -> tree.Name:
    """Return the variable of a field."""
    text = variable.type.names[field].text
    return tree.Name(name.span, f"{name.text}.{text}", f"{name.key}.{field}")


def _alike(first: RecordVariable, second: RecordVariable) -> bool:
    """Whether two records are of one type; modules may have types of the same name."""
    return first.type is second.type and str(first) == str(second)


def _phrase(variable: RecordVariable) -> str:
    article = "an" if variable.sizes or variable.type.name.text[:1].lower() in "aeiou" else "a"
    return f"{article} {variable}"


__all__ = ["LaidOutProgram", "RecordType", "RecordVariable", "lay_out"]
