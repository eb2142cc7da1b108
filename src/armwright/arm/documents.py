"""The documents that the numbers of an arm were read in: a public file with its revision, a manual, a paper."""

from __future__ import annotations

from collections.abc import Iterable

import attrs

from armwright.errors import closest, shown
from armwright.files.document import Table

# What of an arm a document gives, in the order in which an arm file has it.
QUANTITIES = (
    "geometry",
    "positions",
    "speeds",
    "accelerations",
    "efforts",
    "masses",
    "inertias",
    "drives",
    "coupling",
    "solids",
    "hand",
)


def _names(value: Iterable[str]) -> tuple[str, ...]:
    return tuple(value)


@attrs.frozen(kw_only=True)
class SourceDocument:
    """A document, and which numbers of an arm were read in it.

    Attributes:
        title: what it is.
        repository: where a public file lies, such as ``ros-industrial/abb``, or the package that has it.
        path: of the file in there.
        revision: the commit, the version of a package, or the edition of a paper.
        licence: of a file, as an SPDX name.
        gives: which quantities stand here as it has them.
        confirms: which quantities it has too, and tests compare.
    """

    title: str
    repository: str = ""
    path: str = ""
    revision: str = ""
    licence: str = ""
    gives: tuple[str, ...] = attrs.field(default=(), converter=_names)
    confirms: tuple[str, ...] = attrs.field(default=(), converter=_names)

    def __str__(self) -> str:
        """Return one line: title, place, revision and licence."""
        place = ", ".join(filter(None, (self.repository, self.path)))
        revision = self.revision and f"revision {self.revision}"
        return ", ".join(filter(None, (self.title, place, revision, self.licence)))


def gives_geometry(document: SourceDocument) -> bool:
    """Whether a document gives the geometry of an arm, or confirms it."""
    return "geometry" in (*document.gives, *document.confirms)


def document_lines(documents: Iterable[SourceDocument]) -> list[str]:
    """Return a line for each document: what it gives, what it confirms, and which it is."""
    lines = []
    for document in documents:
        confirms = [f"confirms {', '.join(document.confirms)}"] if document.confirms else []
        what = "; ".join([*filter(None, [", ".join(document.gives)]), *confirms])
        lines.append(f"{what}: {document}")
    return lines


def documents_in(top: Table) -> tuple[SourceDocument, ...]:
    """Read the tables ``[[document]]`` of an arm file, none where there are none.

    Raises:
        FileFormatError: a key is unknown, missing or no text, or a quantity is unknown.
    """
    top.allow("document")
    return tuple(_document(table) for table in top.tables("document")) if "document" in top else ()


def _document(table: Table) -> SourceDocument:
    document = SourceDocument(
        title=table.text("title"),
        repository=table.text("repository", default=""),
        path=table.text("path", default=""),
        revision=table.text("revision", default=""),
        licence=table.text("licence", default=""),
        gives=_quantities(table, "gives"),
        confirms=_quantities(table, "confirms"),
    )
    table.refuse_unknown_keys()
    return document


def _quantities(table: Table, key: str) -> list[str]:
    table.allow(key)
    names = table.texts(key) if key in table else []
    for i, name in enumerate(names):
        if name not in QUANTITIES:
            near = closest(name, QUANTITIES)
            hint = f"; did you mean '{near}'?" if near else ""
            raise table.error(key, f"expected some of {', '.join(QUANTITIES)}, got {shown(name)}{hint}", i)
    return names
