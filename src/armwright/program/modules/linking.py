"""Linking: one program of all files, in which every name stands for one thing."""

from collections.abc import Collection, Mapping
from typing import get_args

import attrs

from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, labels
from armwright.program.language.names import is_arm, is_module
from armwright.program.language.units import DECLARABLE, dimension
from armwright.program.modules.files import ParsedFile, ProgramFiles, beside
from armwright.program.modules.names import FileNames, Meaning, file_names, unknown_member
from armwright.program.modules.rewriting import Rewriter
from armwright.program.semantics.builtins import FUNCTIONS, WITH_NAME
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax import tree

# What gives values to the variables of a module, and places its frames, before the program begins.
_INITIAL = (
    *(tree.Assign, tree.Affix, tree.Unfix, tree.Block, tree.If),
    *(tree.While, tree.Repeat, tree.For, tree.Poison),
)
_STATEMENTS = get_args(tree.Statement)


@attrs.frozen(kw_only=True)
class LinkedProgram:
    """A program with all its modules.

    Attributes:
        tree: the headers and statements of all files, those of modules first.
        exported: the names that modules give, by their keys in the tree.
        brought: the names that modules give to the program's own file, as it may write them, and their keys.
        names: of each file, by its number, its names that have other keys in the tree.
        diagnostics: what is wrong with the modules and their names, errors of syntax in modules included.
    """

    tree: tree.Program
    exported: frozenset[str]
    diagnostics: list[Diagnostic]
    brought: Mapping[str, str] = attrs.field(factory=dict)
    names: Mapping[int, Mapping[str, str]] = attrs.field(factory=dict)


def link(program: ProgramFiles, cell_frames: Collection[str] = ()) -> LinkedProgram:
    """Make one program of all files.

    Args:
        program: the files.
        cell_frames: the frames of the cell, as far as they are known.
    """
    diagnostics = DiagnosticList()
    main = program.main
    diagnostics += program.diagnostics
    names = file_names(program, cell_frames, diagnostics)
    headers: list[tree.Header] = []
    statements: list[tree.Statement] = []
    for path, file in program.files.items():
        if file is not main:
            diagnostics += file.diagnostics
        if file.tree.module is not None:
            _check_statements(file.tree.statements, diagnostics)
        _check_imports(program, path, diagnostics)
        linked = _Linker(program, path, names[path], diagnostics)
        headers += linked.headers()
        statements += linked.statements(file.tree.statements)
    _check_module_names(program, diagnostics)
    modules = [path for path, file in program.files.items() if file.tree.module is not None]
    exported = frozenset(meaning.key for path in modules for meaning in names[path].own.values())
    whole = attrs.evolve(main.tree, headers=tuple(headers), statements=tuple(statements))
    brought = names[main.path].brought()
    numbers = {module.path: number for number, module in enumerate(program.source.modules, 1)}
    # The program's own file has a name for everything, be it that of a module that only another module imports.
    whole_names = {
        f"{module.name.key}.{key}": meaning.key
        for path, file in program.files.items()
        if (module := file.tree.module) is not None
        for key, meaning in names[path].own.items()
    }
    renamed = {0: {**whole_names, **names[main.path].renamed()}}
    renamed |= {numbers[path]: names[path].renamed() for path in numbers if path in names}
    return LinkedProgram(
        tree=whole,
        exported=exported,
        diagnostics=diagnostics,
        brought=brought,
        names={number: seen for number, seen in renamed.items() if seen},
    )


class _Linker:
    """The renaming of one file."""

    def __init__(self, program: ProgramFiles, path: str, names: FileNames, diagnostics: DiagnosticList) -> None:
        self._file, self._path, self._names = program.files[path], path, names
        self._is_main = self._file is program.main
        self._has_unknown_names = program.has_unknown_names
        self._report = diagnostics.report
        self._reported: set[str] = set()
        self._local: frozenset[str] = frozenset()
        self._rewriter = Rewriter(self._variable, self._procedure, self._is_special)

    def headers(self) -> list[tree.Header]:
        """Return its declarations, under their names in the whole program."""
        return [linked for header in self._file.tree.headers if (linked := self._header(header)) is not None]

    def statements(self, nodes: tuple[tree.Statement, ...]) -> list[tree.Statement]:
        """Return statements with other names."""
        return [self._rewriter(node) for node in nodes]

    def _header(self, header: tree.Header) -> tree.Header | None:
        linked: tree.Header | None = header
        match header:
            case tree.Import() if is_module(header.path.value):
                linked = None
            case tree.Import():
                path = attrs.evolve(header.path, value=beside(self._path, header.path.value))
                linked = header if self._is_main else attrs.evolve(header, path=path)
            case tree.Module() | tree.Units():
                linked = header if self._is_main else None
            case tree.Declaration():
                names = tuple(map(self._declared, header.names))
                linked = attrs.evolve(header, names=names, type=self._type(header.type))
            case tree.Record():
                fields = tuple(attrs.evolve(field, type=self._type(field.type)) for field in header.fields)
                linked = attrs.evolve(header, name=self._declared(header.name), fields=fields)
            case tree.Constant():
                linked = tree.Constant(header.span, self._declared(header.name), self._rewriter(header.value))
            case tree.Procedure():
                linked = self._linked_procedure(header)
        return linked

    def _linked_procedure(self, node: tree.Procedure) -> tree.Procedure:
        own = (*node.parameters, *node.declarations)
        self._local = frozenset(name.key for declaration in own for name in declaration.names)
        body = attrs.evolve(node.body, statements=tuple(self.statements(node.body.statements)))
        self._local = frozenset()
        parameters, declarations = (
            tuple(attrs.evolve(one, type=self._type(one.type)) for one in part)
            for part in (node.parameters, node.declarations)
        )
        return attrs.evolve(
            node, name=self._declared(node.name), parameters=parameters, declarations=declarations, body=body
        )

    def _type(self, node: tree.TypeName) -> tree.TypeName:
        """Return a type with the name that a record has in the whole program."""
        if node.record is None:
            return node
        record = self._linked(node.record)
        return attrs.evolve(node, record=record if isinstance(record, tree.Name) else None)

    def _declared(self, name: tree.Name) -> tree.Name:
        meaning = self._names.own.get(name.key)
        return name if meaning is None or meaning.key == name.key else attrs.evolve(name, key=meaning.key)

    def _is_special(self, node: tree.Function) -> bool:
        return node.name.key in WITH_NAME and self._meanings(node.name.key) == []

    def _meanings(self, key: str) -> list[Meaning]:
        """Return what a name stands for in the file, outside of its procedures; several where modules clash."""
        module, point, member = key.partition(".")
        if point and (brought := self._names.modules.get(module)) is not None:
            return [brought[member]] if member in brought else []
        own = self._names.own.get(key)
        return self._names.visible.get(key, []) if own is None else [own]

    def _variable(self, name: tree.Name) -> tree.Name | tree.Poison:
        owner, field = self._split(name.key)
        if owner in self._local or is_arm(name.key):
            return name
        if not field:
            return self._linked(name)
        linked = self._linked(attrs.evolve(name, key=owner))
        return attrs.evolve(name, key=f"{linked.key}.{field}") if isinstance(linked, tree.Name) else linked

    def _split(self, key: str) -> tuple[str, str]:
        """Return a variable and the field of it that a name stands for; empty without one."""
        parts = key.split(".")
        count = 2 if parts[0] in self._names.modules and parts[0] not in self._local else 1
        return ".".join(parts[:count]), ".".join(parts[count:])

    def _procedure(self, name: tree.Name) -> tree.Name | tree.Poison:
        linked = self._linked(name)
        may_be_unread = self._has_unknown_names and linked is name and name.key not in FUNCTIONS
        return tree.Poison(name.span) if may_be_unread and not self._meanings(name.key) else linked

    def _linked(self, name: tree.Name) -> tree.Name | tree.Poison:
        """Return a name with its key in the whole program; report one that the file does not see."""
        key = name.key
        if key in PREDECLARED:
            return name
        meanings = self._meanings(key)
        if len(meanings) == 1:
            return name if meanings[0].key == key else attrs.evolve(name, key=meanings[0].key)
        first_time = key not in self._reported
        self._reported.add(key)
        if meanings:
            if first_time:
                self._report_ambiguous(name, meanings)
            return tree.Poison(name.span)
        if key.partition(".")[0] in self._names.modules:
            if first_time:
                text, label, advice = unknown_member(self._names, name)
                self._report("E253", text, name.span, label, advice=advice)
            return tree.Poison(name.span)
        hidden = self._names.hidden.get(key)
        if hidden is None or key in FUNCTIONS:
            return name
        if first_time:
            here = labels(hidden.declared.span, "declared here")
            advice = f"import `{hidden.path}` in this file, or declare `{name.text}` here"
            called = [module for module, brought in self._names.modules.items() if hidden in brought.values()]
            if called:
                advice = f"write `{called[0].lower()}.{name.text}`"
            text = f"`{name.text}` is not declared in this file"
            self._report("E253", text, name.span, "a name of another file", secondary=here, advice=advice)
        return tree.Poison(name.span)

    def _report_ambiguous(self, name: tree.Name, meanings: list[Meaning]) -> None:
        here = tuple(label for meaning in meanings for label in labels(meaning.declared.span, "one of them"))
        qualified = [
            f"`{module.lower()}.{name.text}`"
            for module, brought in self._names.modules.items()
            if brought.get(name.key) in meanings
        ]
        text = f"{len(meanings)} modules give the name `{name.text}`"
        self._report("E252", text, name.span, "which?", secondary=here, advice=f"write {' or '.join(qualified)}")


def check_module(program: tree.Program) -> list[Diagnostic]:
    """Return what is wrong with the statements of a module that imports no other."""
    diagnostics = DiagnosticList()
    if program.module is not None:
        _check_statements(program.statements, diagnostics)
    return diagnostics


def _check_statements(statements: tuple[tree.Statement, ...], diagnostics: DiagnosticList) -> None:
    """Report statements of a module that do more than give values."""
    waiting = [*reversed(statements)]
    while waiting:
        statement = waiting.pop()
        if isinstance(statement, _INITIAL):
            inner = (part for part in tree.child_nodes(statement) if isinstance(part, _STATEMENTS))
            waiting += reversed([*inner])
            continue
        text = "the statements of a module give values to its variables, and do no more"
        note = "they run before the program that imports it begins"
        advice = "put this into a PROCEDURE, and call that in the program"
        diagnostics.report("E255", text, statement.span, "this does more", note=note, advice=advice)


def _check_module_names(program: ProgramFiles, diagnostics: DiagnosticList) -> None:
    first: dict[str, tree.Name] = {}
    for file in program.files.values():
        if file.tree.module is None:
            continue
        name = file.tree.module.name
        if (other := first.setdefault(name.key, name)) is not name:
            text, here = f"two files are the module `{name.text}`", labels(other.span, "the first")
            diagnostics.report("E250", text, name.span, "the second", secondary=here, advice="give one another name")


def _check_imports(program: ProgramFiles, path: str, diagnostics: DiagnosticList) -> None:
    """Report imports of what is no module, and modules that count in other units."""
    importer = program.files[path]
    for imported in program.imports[path]:
        node, file = imported.node, program.files[imported.path]
        if file.tree.module is None:
            text = f"`{node.path.value}` is a program and no module"
            advice = f"begin it with `MODULE name ;` if it is to be imported: {imported.path}"
            diagnostics.report("E250", text, node.path.span, "no module", advice=advice)
        elif (own := _units(importer)) != (theirs := _units(file)):
            text = f"`{node.path.value}` counts in {_units_text(theirs)}, and this file in {_units_text(own)}"
            note = "a number that goes from one to the other would mean something else there"
            advice = "write the same UNITS line in both"
            diagnostics.report("E254", text, node.path.span, "other units", note=note, advice=advice)


def _units(file: ParsedFile) -> tuple[str, str]:
    """Return the units of length and angle of a file."""
    found = {"length": "M", "angle": "DEG"}
    written = [unit.key for header in file.tree.headers if isinstance(header, tree.Units) for unit in header.units]
    found |= {dimension(unit): unit for unit in reversed(written) if unit in DECLARABLE}
    return found["length"], found["angle"]


def _units_text(units: tuple[str, str]) -> str:
    return " and ".join(units)
