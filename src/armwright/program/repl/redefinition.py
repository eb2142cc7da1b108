"""Names that are declared again in a session: earlier statements keep the old one, under another name."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import count
from typing import Any

import attrs

from armwright.program.language.source import Span
from armwright.program.semantics.builtins import WITH_NAME
from armwright.program.syntax import tree


@attrs.frozen(kw_only=True)
class RenamedProgram:
    """A session after names are declared again.

    Attributes:
        headers: without what they declared of these names.
        statements: with other names for what they use of them.
        new_names: new names of old variables and procedures that statements use, by their old ones.
        unused_names: names that no statement has used: there is nothing left of them.
    """

    headers: tuple[tree.Header, ...]
    statements: tuple[tree.Statement, ...]
    new_names: Mapping[str, str]
    unused_names: frozenset[str]


def declared_names(headers: Iterable[tree.Header]) -> dict[str, tree.Name]:
    """Return the names that headers declare, variables and procedures, by key."""
    names_: dict[str, tree.Name] = {}
    for header in headers:
        if isinstance(header, tree.Declaration):
            names_.update((name.key, name) for name in header.names)
        elif isinstance(header, tree.Procedure | tree.Constant):
            names_[header.name.key] = header.name
    return names_


def redeclare(
    headers: Sequence[tree.Header],
    statements: Sequence[tree.Statement],
    names: Collection[str],
    *,
    unavailable: Collection[str],
    max_length: int,
) -> RenamedProgram:
    """Rename what earlier statements use of names that are declared again.

    Procedures mean the new ones from then on; the statements before get procedures of their own where these meant
    an old one, so that the session remains the program that it was.

    Args:
        headers: of the session so far.
        statements: of the session so far.
        names: declared before, and now again.
        unavailable: names that cannot be given.
        max_length: how long a name may be.
    """
    if not names:
        return RenamedProgram(
            headers=tuple(headers), statements=tuple(statements), new_names={}, unused_names=frozenset()
        )
    procedures = {header.name.key: header for header in headers if isinstance(header, tree.Procedure)}
    mentions = {key: used_names(procedure) - {key} for key, procedure in procedures.items()}
    used = _reachable_names(used_names(tuple(statements)), mentions)
    old = {key for key in names if key in used}
    affected = {key for key in procedures if key in used and _reachable_names(mentions[key], mentions) & old} - old
    names_, unavailable = declared_names(headers), set(unavailable)
    new = {key: _unused_name(names_[key].text, unavailable, max_length) for key in sorted(old | affected)}
    remaining: list[tree.Header] = []
    for header in headers:
        if isinstance(header, tree.Procedure):
            key = header.name.key
            if key in new:
                remaining.append(rename_names(header, new))
            if key not in names:
                remaining.append(header)
        elif isinstance(header, tree.Constant):
            if header.name.key not in names or header.name.key in new:
                remaining.append(rename_names(header, new))
        elif isinstance(header, tree.Declaration):
            in_use = tuple(_rename(name, new) for name in header.names if name.key not in names or name.key in new)
            remaining += [attrs.evolve(header, names=in_use)] if in_use else []
        else:
            remaining.append(header)
    return RenamedProgram(
        headers=tuple(remaining),
        statements=tuple(rename_names(statement, new) for statement in statements),
        new_names={key: new[key].key for key in new},
        unused_names=frozenset(names) - old,
    )


def _reachable_names(names: Collection[str], mentions: Mapping[str, Collection[str]]) -> set[str]:
    """Return the names that some names lead to, through the procedures among them."""
    reached, stack = set(names), list(names)
    while stack:
        for name in mentions.get(stack.pop(), ()):
            if name not in reached:
                reached.add(name)
                stack.append(name)
    return reached


def _unused_name(text: str, unavailable: set[str], max_length: int) -> tree.Name:
    """Return a name like another that is not taken, and take it."""
    ends = (f"_{number}" for number in count(1))
    candidates = (text[: max_length - len(end)] + end for end in ends)
    name = next(candidate for candidate in candidates if candidate.upper() not in unavailable)
    unavailable.add(name.upper())
    return tree.Name(Span(0, 0), name, name.upper())


# ---- trees ---------------------------------------------------------------------------------------------------------


def local_names(procedure: tree.Procedure) -> set[str]:
    """Return the names that a procedure declares for itself."""
    return {name.key for part in (*procedure.parameters, *procedure.declarations) for name in part.names}


def used_names(node: object) -> set[str]:
    """Return the keys of the variables and procedures that a part of a program uses."""
    keys = set()

    def collect(name: tree.Name) -> tree.Name:
        keys.add(name.key)
        return name

    _map_names(node, collect)
    return keys


def rename_names(node: Any, new: Mapping[str, tree.Name]) -> Any:
    """Return a part of a program that uses other names; devices, axes and a procedure's own names stay."""
    return _map_names(node, lambda name: _rename(name, new))


def _map_names(node: Any, change: Callable[[tree.Name], tree.Name]) -> Any:
    """Return a part of a program with every name of a variable or procedure changed that is not local to it."""
    changed = node
    match node:
        case Span():
            pass
        case tree.Name():
            changed = change(node)
        case tree.Function(name=name, arguments=arguments):
            if name.key not in WITH_NAME:
                changed = attrs.evolve(node, arguments=_map_names(arguments, change))
        case tree.Procedure(name=name, body=body):
            local = local_names(node)
            body = _map_names(body, lambda name: name if name.key in local else change(name))
            changed = attrs.evolve(node, name=change(name), body=body)
        case tuple():
            changed = tuple(_map_names(item, change) for item in node)
        case _ if fields := _child_fields(node):
            changed = attrs.evolve(node, **{name: _map_names(value, change) for name, value in fields.items()})
    return changed


def _rename(name: tree.Name, new: Mapping[str, tree.Name]) -> tree.Name:
    candidate = new.get(name.key)
    return name if candidate is None else attrs.evolve(name, text=candidate.text, key=candidate.key)


def _child_fields(node: object) -> dict[str, object]:
    """Return the parts of a node in which there can be names of variables; none of anything else."""
    kind = type(node)
    if not attrs.has(kind) or isinstance(node, tree.Operate):
        return {}
    return {field.name: getattr(node, field.name) for field in attrs.fields(kind)}
