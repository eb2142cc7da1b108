"""Names that are declared anew in a session: what was done with the old one keeps it, under another name."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import count
from typing import Any

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Functions whose argument is an axis, not a variable.
_WITH_AXIS = ("FORCE",)


@attrs.frozen(kw_only=True)
class Redeclared:
    """What is left of a session when names are declared anew.

    Attributes:
        headers: without what they declared of these names.
        statements: with other names for what they use of them.
        renamed: new names of old variables and procedures that statements use, by their old ones.
        dropped: names that no statement has used: there is nothing left of them.
    """

    headers: tuple[tree.Header, ...]
    statements: tuple[tree.Statement, ...]
    renamed: Mapping[str, str]
    dropped: frozenset[str]


def declared(headers: Iterable[tree.Header]) -> dict[str, tree.Name]:
    """Return the names that headers declare, variables and procedures, by key."""
    names_: dict[str, tree.Name] = {}
    for header in headers:
        if isinstance(header, tree.Declaration):
            names_.update((name.key, name) for name in header.names)
        elif isinstance(header, tree.Procedure):
            names_[header.name.key] = header.name
    return names_


def redeclare(
    headers: Sequence[tree.Header],
    statements: Sequence[tree.Statement],
    names: Collection[str],
    *,
    taken: Collection[str],
    longest: int,
) -> Redeclared:
    """Make room for names that are declared anew.

    Procedures mean the new ones from then on; the statements before get procedures of their own where these meant
    an old one, so that the session remains the program that it was.

    Args:
        headers: of the session so far.
        statements: of the session so far.
        names: declared before, and now again.
        taken: names that cannot be given.
        longest: how long a name may be.
    """
    if not names:
        return Redeclared(headers=tuple(headers), statements=tuple(statements), renamed={}, dropped=frozenset())
    procedures = {header.name.key: header for header in headers if isinstance(header, tree.Procedure)}
    mentions = {key: mentioned(procedure) - {key} for key, procedure in procedures.items()}
    used = _reached(mentioned(tuple(statements)), mentions)
    old = {key for key in names if key in used}
    affected = {key for key in procedures if key in used and _reached(mentions[key], mentions) & old} - old
    names_, taken = declared(headers), set(taken)
    new = {key: _unused(names_[key].text, taken, longest) for key in sorted(old | affected)}
    remaining: list[tree.Header] = []
    for header in headers:
        if isinstance(header, tree.Procedure):
            key = header.name.key
            if key in new:
                remaining.append(renamed(header, new))
            if key not in names:
                remaining.append(header)
        elif isinstance(header, tree.Declaration):
            own = tuple(_named(name, new) for name in header.names if name.key not in names or name.key in new)
            remaining += [attrs.evolve(header, names=own)] if own else []
        else:
            remaining.append(header)
    return Redeclared(
        headers=tuple(remaining),
        statements=tuple(renamed(statement, new) for statement in statements),
        renamed={key: new[key].key for key in new},
        dropped=frozenset(names) - old,
    )


def _reached(names: Collection[str], mentions: Mapping[str, Collection[str]]) -> set[str]:
    """Return the names that some names lead to, through the procedures among them."""
    reached, waiting = set(names), list(names)
    while waiting:
        for name in mentions.get(waiting.pop(), ()):
            if name not in reached:
                reached.add(name)
                waiting.append(name)
    return reached


def _unused(text: str, taken: set[str], longest: int) -> tree.Name:
    """Return a name like another that is not taken, and take it."""
    ends = (f"_{number}" for number in count(1))
    candidates = (text[: longest - len(end)] + end for end in ends)
    name = next(candidate for candidate in candidates if candidate.upper() not in taken)
    taken.add(name.upper())
    return tree.Name(Span(0, 0), name, name.upper())


# ---- trees ---------------------------------------------------------------------------------------------------------


def own_names(procedure: tree.Procedure) -> set[str]:
    """Return the names that a procedure declares for itself."""
    return {name.key for part in (*procedure.parameters, *procedure.declarations) for name in part.names}


def mentioned(node: object) -> set[str]:
    """Return the keys of the variables and procedures that a part of a program uses."""
    match node:
        case Span():
            names_ = set()
        case tree.Name(key=key):
            names_ = {key}
        case tree.Function(name=name, arguments=arguments):
            names_ = set() if name.key in _WITH_AXIS else mentioned(arguments)
        case tree.Procedure(body=body):
            names_ = mentioned(body) - own_names(node)
        case tuple():
            names_ = set().union(*map(mentioned, node))
        case _:
            names_ = set().union(*map(mentioned, _values(node).values()))
    return names_


def renamed(node: Any, new: Mapping[str, tree.Name]) -> Any:
    """Return a part of a program that uses other names; devices, axes and a procedure's own names stay."""
    changed = node
    match node:
        case Span():
            pass
        case tree.Name():
            changed = _named(node, new)
        case tree.Function(name=name, arguments=arguments):
            if name.key not in _WITH_AXIS:
                changed = attrs.evolve(node, arguments=renamed(arguments, new))
        case tree.Procedure(name=name, body=body):
            inner = {key: candidate for key, candidate in new.items() if key not in own_names(node)}
            changed = attrs.evolve(node, name=_named(name, new), body=renamed(body, inner))
        case tuple():
            changed = tuple(renamed(item, new) for item in node)
        case _ if fields := _values(node):
            changed = attrs.evolve(node, **{name: renamed(value, new) for name, value in fields.items()})
    return changed


def _named(name: tree.Name, new: Mapping[str, tree.Name]) -> tree.Name:
    candidate = new.get(name.key)
    return name if candidate is None else attrs.evolve(name, text=candidate.text, key=candidate.key)


def _values(node: object) -> dict[str, object]:
    """Return the parts of a node in which there can be names of variables; none of anything else."""
    kind = type(node)
    if not attrs.has(kind) or isinstance(node, tree.Operate):
        return {}
    return {field.name: getattr(node, field.name) for field in attrs.fields(kind)}
