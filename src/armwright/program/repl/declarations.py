"""What an input declares, put together with what a session has declared before."""

from collections.abc import Callable, Collection, Mapping, Sequence

import attrs

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.units import UNITS, dimension
from armwright.program.language.words import VOCABULARIES, Standard
from armwright.program.repl.input import Entry
from armwright.program.repl.redefinition import Redeclared, declared, own_names, redeclare
from armwright.program.semantics.builtins import FUNCTIONS
from armwright.program.syntax import tree


class NotNowError(Exception):
    """An input cannot be taken any more, though it might have been earlier.

    Attributes:
        diagnostic: why.
    """

    def __init__(self, diagnostic: Diagnostic) -> None:
        """Keep the reason."""
        self.diagnostic = diagnostic
        super().__init__(diagnostic.message)


@attrs.frozen(kw_only=True)
class Heading:
    """The declarations of a session together with those of an input.

    Attributes:
        headers: all of them.
        statements: those of the session, with the names that they use now.
        spelling: of names that are declared here, and of new names for old ones, by key.
        renamed: new names of old variables and procedures, by their old ones.
        dropped: names that were declared anew before anything was done with them.
        imports: the paths of files that are imported now for the first time.
        remarks: what is to be said about it.
    """

    headers: tuple[tree.Header, ...]
    statements: tuple[tree.Statement, ...]
    spelling: Mapping[str, str] = attrs.field(factory=dict)
    renamed: Mapping[str, str] = attrs.field(factory=dict)
    dropped: frozenset[str] = frozenset()
    imports: tuple[tree.Import, ...] = ()
    remarks: tuple[str, ...] = ()


def merged(
    headers: Sequence[tree.Header],
    statements: Sequence[tree.Statement],
    entry: Entry,
    std: Standard,
    *,
    fixed: Collection[str],
    path_of: Callable[[str], str],
) -> Heading:
    """Put the headers of an input together with those of a session.

    Args:
        headers: of the session.
        statements: of the session.
        entry: the input.
        std: the language.
        fixed: names by which the cell itself knows frames, devices and what its camera sees.
        path_of: how the session shall name a file that the input imports.

    Raises:
        NotNowError: what it declares would change the meaning of what was done.
    """
    old = tuple(headers)
    new: list[tree.Header] = []
    imports: list[tree.Import] = []
    remarks: list[str] = []
    for header in entry.headers:
        if isinstance(header, tree.Import):
            path = attrs.evolve(header.path, value=path_of(header.path.value))
            if any(isinstance(known, tree.Import) and known.path.value == path.value for known in (*old, *imports)):
                remarks.append(f"`{path.value}` is imported already")
            else:
                imports.append(attrs.evolve(header, path=path))
            continue
        if isinstance(header, tree.Units):
            old = _with_units(old, statements, header)
        new.append(header)
    new = [*imports, *new]
    again = declared(old).keys() & declared(new).keys()
    words = VOCABULARIES[std]
    taken = {*declared((*old, *new)), *fixed, *words.reserved, *FUNCTIONS}
    for header in (*old, *new):
        taken |= own_names(header) if isinstance(header, tree.Procedure) else set()
    changed = redeclare(old, statements, again, taken=taken, longest=words.longest_name)
    for key in sorted(changed.renamed.keys() & again & set(fixed)):
        raise NotNowError(_known_to_the_cell(declared(new)[key]))
    return Heading(
        headers=(*changed.headers, *new),
        statements=changed.statements,
        spelling={**_spelling(changed), **{key: declared(new)[key].text for key in again}},
        renamed=changed.renamed,
        dropped=changed.dropped,
        imports=tuple(imports),
        remarks=(*remarks, *_messages(changed, declared(old), again)),
    )


def _spelling(changed: Redeclared) -> dict[str, str]:
    now = declared(changed.headers)
    return {key: now[key].text for key in changed.renamed.values()}


def _messages(changed: Redeclared, old: Mapping[str, tree.Name], again: Collection[str]) -> list[str]:
    now = _spelling(changed)
    called = {key: f"`{old[key].text}`" for key in {*again, *changed.renamed}}
    messages = {key: f"{called[key]} is declared again" for key in sorted(again)}
    for key, name in sorted(changed.renamed.items()):
        if key in again:
            messages[key] += f"; the previous one is now called `{now[name]}`"
        else:
            messages[key] = (
                f"{called[key]} uses the new declarations; the previous procedure is now called `{now[name]}`"
            )
    return [*messages.values()]


def _known_to_the_cell(name: tree.Name) -> Diagnostic:
    return Diagnostic(
        code="E203",
        message=f"`{name.text}` cannot be declared again: it is a name of the cell, and it has been used",
        span=name.span,
        label="declared again here",
        helps=("choose another name, or go back with `:undo` to its declaration",),
    )


# ---- units ---------------------------------------------------------------------------------------------------------


def _with_units(
    headers: tuple[tree.Header, ...], statements: Sequence[tree.Statement], new: tree.Units
) -> tuple[tree.Header, ...]:
    """Return the headers without the units that new ones take the place of.

    Raises:
        NotNowError: numbers have been read in the old ones.
    """
    now = {unit.key for unit in _units(headers)}
    changes = [unit for unit in new.units if unit.key in UNITS and unit.key not in now]
    began = statements or any(isinstance(header, tree.Procedure) for header in headers)
    standard = {"M", "DEG"}
    dimensions = {dimension(key) for key in now}
    changes = [change for change in changes if change.key not in standard or dimension(change.key) in dimensions]
    if began and changes:
        raise NotNowError(
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


def _units(headers: Sequence[tree.Header]) -> list[tree.Name]:
    return [unit for header in headers if isinstance(header, tree.Units) for unit in header.units]
