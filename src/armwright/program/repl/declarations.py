"""What an input declares, put together with what a session has declared before."""

from collections.abc import Callable, Collection, Mapping, Sequence

import attrs

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.units import UNITS, dimension
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.repl.input import ParsedInput
from armwright.program.repl.redefinition import RenamedProgram, declared_names, local_names, redeclare
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.syntax import tree


class RedefinitionError(Exception):
    """An input cannot be taken any more, though it might have been earlier.

    Attributes:
        diagnostic: why.
    """

    def __init__(self, diagnostic: Diagnostic) -> None:
        """Keep the reason."""
        self.diagnostic = diagnostic
        super().__init__(diagnostic.message)


@attrs.frozen(kw_only=True)
class MergedHeaders:
    """The declarations of a session together with those of an input.

    Attributes:
        headers: all of them.
        statements: those of the session, with the names that they use now.
        spelling: of names that are declared here, and of new names for old ones, by key.
        new_names: new names of old variables and procedures, by their old ones.
        unused_names: names that were declared again before they were used.
        imports: the paths of files that are imported now for the first time.
        remarks: what is to be said about it.
    """

    headers: tuple[tree.Header, ...]
    statements: tuple[tree.Statement, ...]
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    new_names: Mapping[str, str] = attrs.field(factory=dict)
    unused_names: frozenset[str] = frozenset()
    imports: tuple[tree.Import, ...] = ()
    remarks: tuple[str, ...] = ()


def merge_headers(
    headers: Sequence[tree.Header],
    statements: Sequence[tree.Statement],
    entry: ParsedInput,
    std: Standard,
    *,
    cell_names: Collection[str],
    import_path: Callable[[str], str],
) -> MergedHeaders:
    """Put the headers of an input together with those of a session.

    Args:
        headers: of the session.
        statements: of the session.
        entry: the input.
        std: the language.
        cell_names: names by which the cell itself knows frames, devices and what its camera sees.
        import_path: how the session shall name a file that the input imports.

    Raises:
        NotNowError: what it declares would change the meaning of what was done.
    """
    old = tuple(headers)
    new: list[tree.Header] = []
    imports: list[tree.Import] = []
    remarks: list[str] = []
    for header in entry.headers:
        if isinstance(header, tree.Import):
            path = attrs.evolve(header.path, value=import_path(header.path.value))
            if any(isinstance(known, tree.Import) and known.path.value == path.value for known in (*old, *imports)):
                remarks.append(f"`{path.value}` is imported already")
            else:
                imports.append(attrs.evolve(header, path=path))
            continue
        if isinstance(header, tree.Units):
            old = _replace_units(old, statements, header)
        new.append(header)
    new = [*imports, *new]
    redeclared = declared_names(old).keys() & declared_names(new).keys()
    words = VOCABULARIES[std]
    taken = {*declared_names((*old, *new)), *cell_names, *words.reserved, *FUNCTIONS}
    for header in (*old, *new):
        taken |= local_names(header) if isinstance(header, tree.Procedure) else set()
    changed = redeclare(old, statements, redeclared, unavailable=taken, max_length=words.longest_name)
    for key in sorted(changed.new_names.keys() & redeclared & set(cell_names)):
        raise RedefinitionError(_cell_name_error(declared_names(new)[key]))
    return MergedHeaders(
        headers=(*changed.headers, *new),
        statements=changed.statements,
        spelling={**_spelling(changed), **{key: declared_names(new)[key].text for key in redeclared}},
        new_names=changed.new_names,
        unused_names=changed.unused_names,
        imports=tuple(imports),
        remarks=(*remarks, *_redefinition_messages(changed, declared_names(old), redeclared)),
    )


def _spelling(changed: RenamedProgram) -> dict[str, str]:
    names = declared_names(changed.headers)
    return {key: names[key].text for key in changed.new_names.values()}


def _redefinition_messages(
    changed: RenamedProgram, old: Mapping[str, tree.Name], redeclared: Collection[str]
) -> list[str]:
    new_spellings = _spelling(changed)
    spellings = {key: f"`{old[key].text}`" for key in {*redeclared, *changed.new_names}}
    messages = {key: f"{spellings[key]} is declared again" for key in sorted(redeclared)}
    for key, name in sorted(changed.new_names.items()):
        renaming = f"is now called `{new_spellings[name]}`"
        if key in redeclared:
            messages[key] += f"; the previous one {renaming}"
        else:
            messages[key] = f"{spellings[key]} uses the new declarations; the previous procedure {renaming}"
    return [*messages.values()]


def _cell_name_error(name: tree.Name) -> Diagnostic:
    return Diagnostic(
        code="E203",
        message=f"`{name.text}` cannot be declared again: it is a name of the cell, and it has been used",
        span=name.span,
        label="declared again here",
        helps=("choose another name, or go back with `:undo` to its declaration",),
    )


# ---- units ---------------------------------------------------------------------------------------------------------


def _replace_units(
    headers: tuple[tree.Header, ...], statements: Sequence[tree.Statement], new: tree.Units
) -> tuple[tree.Header, ...]:
    """Return the headers without the units that new ones replace.

    Raises:
        NotNowError: numbers have been read in the old ones.
    """
    current = {unit.key for header in headers if isinstance(header, tree.Units) for unit in header.units}
    # Where no unit of a dimension is declared, the metre and the degree are the units.
    current |= {"M", "DEG"} - {key for key in ("M", "DEG") if dimension(key) in set(map(dimension, current))}
    changes = [unit for unit in new.units if unit.key in UNITS and unit.key not in current]
    has_numbers = statements or any(isinstance(header, tree.Procedure) for header in headers)
    if has_numbers and changes:
        raise RedefinitionError(
            Diagnostic(
                code="E224",
                message="UNITS must precede all statements: the numbers before it were read in other units",
                span=new.span,
                label="units can be changed only before the first statement",
                helps=(f"write the unit after a number, such as `25{changes[0].text.lower()}`",),
            )
        )
    replaced = {dimension(unit.key) for unit in new.units if unit.key in UNITS}
    remaining: list[tree.Header] = []
    for header in headers:
        if isinstance(header, tree.Units):
            units = tuple(unit for unit in header.units if dimension(unit.key) not in replaced)
            remaining += [attrs.evolve(header, units=units)] if units else []
        else:
            remaining.append(header)
    return tuple(remaining)
