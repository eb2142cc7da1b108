"""Going through the statements of a file and putting other names, or other nodes, in the place of some."""

from collections.abc import Callable
from typing import Any, TypeAlias

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax import tree

# Gives what a name becomes; a Poison where it was reported.
Rename: TypeAlias = Callable[[tree.Name], tree.Name | tree.Poison]

# Names of other things than variables and procedures: these stay.
_OTHER_NAMES: dict[type, tuple[str, ...]] = {
    tree.Operate: ("device",),
    tree.Pulse: ("device",),
    tree.SetTimer: ("name",),
    tree.When: ("name",),
    tree.WatchSwitch: ("name",),
    tree.Raise: ("kind",),
    tree.Try: ("kinds",),
}
_LEAVES = (tree.Number, tree.String, tree.ArmName, tree.Poison, tree.TypeName)


@attrs.frozen
class Rewriter:
    """What becomes of the names of statements and values.

    Attributes:
        variable: of the name of a variable.
        procedure: of a name in front of ``(``.
        is_special: whether the arguments of a function are no variables, such as an axis.
        replace: gives what a whole node becomes; None where its names are looked at one by one.
    """

    variable: Rename
    procedure: Rename
    is_special: Callable[[tree.Function], bool]
    replace: Callable[[tree.Node], tree.Node | None] = lambda _node: None

    def __call__(self, node: Any) -> Any:
        """Return a node with other names, or a Poison; the node itself where nothing changes."""
        if isinstance(node, _LEAVES) or (isinstance(node, tree.Function) and self.is_special(node)):
            return node
        replaced = self.replace(node)
        return self._renamed(node) if replaced is None else replaced

    def _renamed(self, node: Any) -> Any:
        match node:
            case tree.Name():
                return self.variable(node)
            case tree.Binary():
                return self._chain(node)
            case tree.If():
                return self._choices(node)
            case tree.Index() | tree.Function() | tree.Call():
                name = (self.variable if isinstance(node, tree.Index) else self.procedure)(node.name)
                return name if isinstance(name, tree.Poison) else self._with_parts(node, {"name": name})
        return self._with_parts(node, {field: getattr(node, field) for field in _OTHER_NAMES.get(type(node), ())})

    def _with_parts(self, node: Any, parts: dict[str, Any]) -> Any:
        """Return a node with its parts rewritten, but for those that are given."""
        changed = {field: part for field, part in parts.items() if part is not getattr(node, field)}
        for attribute in type(node).__attrs_attrs__:
            field = attribute.name
            value = getattr(node, field)
            if field in parts or isinstance(value, Span):
                continue
            if isinstance(value, tuple):
                items = tuple(self(item) if isinstance(item, tree.Node) else item for item in value)
                if any(new is not old for new, old in zip(items, value, strict=True)):
                    changed[field] = items
            elif isinstance(value, tree.Node) and (new := self(value)) is not value:
                changed[field] = new
        return attrs.evolve(node, **changed) if changed else node

    def _chain(self, node: tree.Binary) -> tree.Expression:
        """Rewrite a chain of operations, which may be long, from its first operand on."""
        first, operations = tree.operation_chain(node)
        left = self(first)
        for operation in operations:
            right = self(operation.right)
            same = left is operation.left and right is operation.right
            left = operation if same else attrs.evolve(operation, left=left, right=right)
        result: tree.Expression = left
        return result

    def _choices(self, node: tree.If) -> tree.If:
        """Rewrite an IF with all that follow it with ELSE IF, which may be many."""
        choices, last = node.else_if_chain
        otherwise = None if last is None else self(last)
        for choice in reversed(choices):
            condition, then = self(choice.condition), self(choice.then)
            same = condition is choice.condition and then is choice.then and otherwise is choice.otherwise
            otherwise = choice if same else attrs.evolve(choice, condition=condition, then=then, otherwise=otherwise)
        assert isinstance(otherwise, tree.If)  # noqa: S101 - the chain has one or more
        return otherwise
