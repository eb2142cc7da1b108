"""PRINT."""

import attrs

from armwright.program.syntax.tree.values import Expression, Node, String


@attrs.frozen
class Print(Node):
    """``PRINT (values and strings)``."""

    items: tuple[Expression | String, ...]
