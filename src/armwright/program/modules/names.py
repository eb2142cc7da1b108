"""What names a file sees: its own, those of the modules that it imports, and none of other files."""

from collections import Counter
from collections.abc import Collection, Mapping

import attrs

from armwright.errors import closest
from armwright.program.language.diagnostic import DiagnosticList, did_you_mean, labels
from armwright.program.language.words import VALUES
from armwright.program.modules.files import ParsedFile, ProgramFiles
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.semantics.symbols import PREDECLARED
from armwright.program.syntax import tree

# What the names of the program's own file are qualified with, where that must be.
_PROGRAM = "PROGRAM"


@attrs.frozen(kw_only=True)
class Meaning:
    """What a name stands for in a file.

    Attributes:
        key: of the thing in the whole program.
        declared: where it is declared.
        path: of that file.
    """

    key: str
    declared: tree.Name
    path: str


@attrs.define(kw_only=True, eq=False)
class FileNames:
    """The names of the program's level that a file sees.

    Attributes:
        own: what the file declares, by key as it is written there.
        visible: what its imports bring, by key as it is written in this file; several where modules clash.
        modules: by key what the file calls each of its modules, with the names of that.
        hidden: keys of the whole program that stand for names of other files, which this one does not see.
    """

    own: dict[str, Meaning] = attrs.field(factory=dict)
    visible: dict[str, list[Meaning]] = attrs.field(factory=dict)
    modules: dict[str, Mapping[str, Meaning]] = attrs.field(factory=dict)
    hidden: dict[str, Meaning] = attrs.field(factory=dict)

    def brought(self) -> dict[str, str]:
        """Return the names that modules give, as the file may write them, with their keys in the whole program."""
        keys = {key: meanings[0].key for key, meanings in self.visible.items() if len(meanings) == 1}
        for module, names in self.modules.items():
            keys |= {f"{module}.{key}": meaning.key for key, meaning in names.items()}
        return keys

    def renamed(self) -> dict[str, str]:
        """Return all names of the program's level that the file may write and that have other keys in the program."""
        own = {key: meaning.key for key, meaning in self.own.items()}
        return {written: key for written, key in {**self.brought(), **own}.items() if written != key}


def declared_names(program: tree.Program) -> dict[str, tree.Name]:
    """Return the names of the program's level that a file declares, by key."""
    variables = (name for declaration in program.declarations for name in declaration.names)
    constants = (constant.name for constant in program.constants)
    records = (record.name for record in program.records)
    names = (*variables, *constants, *records, *(procedure.name for procedure in program.procedures))
    return {name.key: name for name in reversed(names) if name.key not in PREDECLARED}


def file_names(
    program: ProgramFiles, cell_frames: Collection[str], diagnostics: DiagnosticList
) -> dict[str, FileNames]:
    """Return what each file sees, by path; report names that clash.

    Args:
        program: the files.
        cell_frames: the frames of the cell, which are found by their names.
        diagnostics: where clashes are reported.
    """
    declared = {path: declared_names(file.tree) for path, file in program.files.items()}
    # A name that only one file uses for anything stays as it is: code, messages and cells know it by that.
    uses = Counter(key for path, file in program.files.items() for key in {*declared[path], *_local_names(file.tree)})
    seen: dict[str, FileNames] = {}
    for path, file in program.files.items():
        is_main, module = file is program.main, file.tree.module
        qualifier = _PROGRAM if is_main or module is None else module.name.key
        procedures = {node.name.key for node in file.tree.procedures}
        names = FileNames()
        for key, name in declared[path].items():
            # Other files mean the word of the language.
            hides_word = key in VALUES or (key in FUNCTIONS and key in procedures)
            differs = hides_word or (uses[key] > 1 and not is_main)
            names.own[key] = Meaning(key=f"{qualifier}.{key}" if differs else key, declared=name, path=path)
            if key in cell_frames:
                _report_shared_frame(seen, name, diagnostics)
        seen[path] = names
    for path, names in seen.items():
        _import_names(program, seen, path, diagnostics)
        names.hidden = {
            meaning.key: meaning
            for other, theirs in seen.items()
            if other != path
            for key, meaning in theirs.own.items()
            if meaning.key == key and key not in names.own
        }
    return seen


def _local_names(program: tree.Program) -> set[str]:
    """Return the parameters and own variables of the procedures of a file."""
    own = ((*procedure.parameters, *procedure.declarations) for procedure in program.procedures)
    return {name.key for declarations in own for declaration in declarations for name in declaration.names}


def _report_shared_frame(seen: Mapping[str, FileNames], name: tree.Name, diagnostics: DiagnosticList) -> None:
    """Report a frame of the cell that an earlier file declares too: it would be two frames."""
    first = next((names.own[name.key] for names in seen.values() if name.key in names.own), None)
    if first is None:
        return
    text = f"`{name.text}` is one frame of the cell, but two files declare it"
    advice = "declare it in one module, and import that where the frame is used"
    here = labels(first.declared.span, "declared here too")
    diagnostics.report("E252", text, name.span, "declared here", secondary=here, advice=advice)


def _import_names(program: ProgramFiles, seen: Mapping[str, FileNames], path: str, diagnostics: DiagnosticList) -> None:
    names = seen[path]
    for imported in program.imports[path]:
        node, module = imported.node, program.files[imported.path].tree.module
        if module is None:
            continue
        brought = seen[imported.path].own
        called = node.alias or module.name
        if (other := names.modules.setdefault(called.key, brought)) is not brought:
            text = f"two modules are called `{called.text}` here"
            advice = f'write `IMPORT "{node.path.value}" AS name`, with a name of its own'
            diagnostics.report("E252", text, (node.alias or node.path).span, "the second", advice=advice)
        if (own := names.own.get(called.key)) is not None:
            text, here = f"`{called.text}` is a module here and something else", labels(own.declared.span, "the other")
            advice = f'write `IMPORT "{node.path.value}" AS name`, with a name of its own'
            diagnostics.report("E252", text, (node.alias or node.path).span, "one name", secondary=here, advice=advice)
        if node.alias is not None or other is not brought:
            continue
        for key, meaning in brought.items():
            meanings = names.visible.setdefault(key, [])
            if meaning not in meanings:
                meanings.append(meaning)
            if (own := names.own.get(key)) is not None:
                text = f"`{own.declared.text}` is declared here, and `{node.path.value}` gives this name too"
                here = labels(meaning.declared.span, "the other")
                advice = f'write `IMPORT "{node.path.value}" AS {called.text}`, and `{called.text}.{own.declared.text}`'
                diagnostics.report("E252", text, own.declared.span, "one name", secondary=here, advice=advice)


def unknown_member(names: FileNames, name: tree.Name) -> tuple[str, str, str]:
    """Return message, label and advice for a name of a module that the module does not have, or for none."""
    module, _, member = name.text.partition(".")
    brought = names.modules[module.upper()]
    if not member:
        first = next((meaning.declared.text for meaning in brought.values()), "name")
        return f"`{module}` is a module, and one of its names is needed here", "a module", f"write `{module}.{first}`"
    near = closest(member, [meaning.declared.text for meaning in brought.values()])
    return f"module `{module}` has no `{member}`", "unknown name", did_you_mean(near and f"{module}.{near}")


__all__ = ["FileNames", "Meaning", "ParsedFile", "declared_names", "file_names", "unknown_member"]
