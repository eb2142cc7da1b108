"""The names of a program: declared once, used as what they are, and spoken of once when they are not."""

from collections.abc import Iterable, Mapping

import attrs

from armwright.errors import closest
from armwright.program import tree
from armwright.program.code import Kind
from armwright.program.diagnostics import Findings, Label, Severity
from armwright.program.known import STATION, WORLD, KnownCell

PREDECLARED = {WORLD: Kind.FRAME, STATION: Kind.FRAME}


@attrs.frozen(kw_only=True)
class Symbols:
    """The names of a program.

    Attributes:
        kinds: what each declared or predeclared name stands for; None where that was reported as wrong.
        declared: where each was declared.
        poisoned: names of which something has been said, so that they give no second message.
    """

    kinds: Mapping[str, Kind | None]
    declared: Mapping[str, tree.Name]
    poisoned: frozenset[str]

    def frame(self, node: tree.Mobile | None) -> str | None:
        """Return the canonical name of a frame or an arm; None for anything else or what is unknown."""
        if isinstance(node, tree.ArmName):
            return node.key
        return node.key if isinstance(node, tree.Name) and self.kinds.get(node.key) is Kind.FRAME else None


class Names:
    """What is known of the names so far, and what has been found."""

    def __init__(self, cell: KnownCell | None) -> None:
        """Start with the predeclared names."""
        self.found = Findings()
        self.kinds: dict[str, Kind | None] = dict(PREDECLARED)
        self.declared: dict[str, tree.Name] = {}
        self.poisoned: set[str] = set()
        self._used: set[str] = set()
        self._cell = cell

    @property
    def symbols(self) -> Symbols:
        """The names as they are now."""
        return Symbols(kinds=self.kinds, declared=self.declared, poisoned=frozenset(self.poisoned))

    def declare(self, declaration: tree.Declaration) -> None:
        """Take up the names of one declaration."""
        kind = Kind(declaration.type.key) if declaration.type.key else None
        for name in declaration.names:
            if name.key in self.declared:
                first = self.declared[name.key]
                self.found.say(
                    "E203",
                    f"`{name.text}` is declared twice",
                    name.span,
                    "again here",
                    secondary=(Label(first.span, "first declared here"),),
                )
            elif name.key == WORLD or (name.key == STATION and kind not in (Kind.FRAME, None)):
                note = "the station may be declared again as a FRAME" if name.key == STATION else ""
                text = f"`{name.text}` is predeclared as a FRAME"
                self.found.say("E203", text, name.span, "declared again here", notes=(note,) if note else ())
            else:
                self.declared[name.key] = name
                self.kinds[name.key] = kind

    def unused(self) -> None:
        """Point at names that are declared and never used."""
        for key, name in self.declared.items():
            if key not in self._used and self.kinds[key] is not None:
                self.found.say(
                    "L304",
                    f"`{name.text}` is never used",
                    name.span,
                    "declared here",
                    severity=Severity.WARNING,
                )

    def use(self, keys: Iterable[str]) -> None:
        """Take note that names are used."""
        self._used.update(keys)

    def mention(self, keys: frozenset[str]) -> None:
        """Take note of names in a part of the program that is passed over: used, and nothing is asked of them."""
        self._used |= keys
        self.poisoned |= keys

    def kind(self, name: tree.Name) -> Kind | None:
        """Return what a name stands for; say once when it is not declared."""
        self._used.add(name.key)
        if name.key not in self.kinds:
            self._undeclared(name)
            self.kinds[name.key] = None
            self.poisoned.add(name.key)
        return self.kinds[name.key]

    def need(
        self,
        node: tree.Mobile | None,
        kind: Kind,
        code: str,
        what: str,
        *,
        notes: tuple[str, ...] = (),
        helps: tuple[str, ...] = (),
    ) -> None:
        """Say that a name is not of the kind that is needed; only a TRANS or SCALAR place refuses an arm.

        Args:
            node: the name.
            kind: what it must be.
            code: of the diagnostic.
            what: the first half of the message, such as ``AT needs a TRANS``.
            notes: of the diagnostic.
            helps: of the diagnostic.
        """
        if isinstance(node, tree.ArmName) and kind is not Kind.FRAME:
            self.found.say(code, f"{what}, but `{node.text}` is an arm", node.span, "an arm", notes=notes)
        elif isinstance(node, tree.Poison):
            self._used |= node.names
        elif isinstance(node, tree.Name):
            found = self.kind(node)
            if found in (None, kind) or node.key in self.poisoned:
                return
            self.poisoned.add(node.key)
            self.found.say(
                code,
                f"{what}, but `{node.text}` is a {found}",
                node.span,
                f"{found}",
                secondary=self.where_declared(node.key),
                notes=notes,
                helps=helps,
            )

    def where_declared(self, key: str) -> tuple[Label, ...]:
        """Return a label on the declaration of a name, if it has one."""
        return (Label(self.declared[key].span, "declared here"),) if key in self.declared else ()

    def arms(self) -> list[str]:
        """Return the arms there are, as far as is known; at least one."""
        return sorted(self._cell.arms) if self._cell and self._cell.arms else ["ARM_1"]

    def _undeclared(self, name: tree.Name) -> None:
        words = {key: self.declared[key].text if key in self.declared else key for key in self.kinds}
        near = closest(name.text, [*words.values(), *self.arms()])
        cell_has_it = self._cell is not None and name.key in self._cell.frames
        if cell_has_it:
            helps = (f"the cell has a frame of this name: declare it with `VAR {name.text} : FRAME ;`",)
        else:
            helps = (f"did you mean `{near}`?",) if near else ("declare it in the VAR part",)
        self.found.say("E202", f"`{name.text}` is not declared", name.span, "unknown name", helps=helps)
