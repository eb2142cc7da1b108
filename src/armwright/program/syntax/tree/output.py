"""PRINT."""

import attrs

from armwright.program.language.source import Span
from armwright.program.syntax.tree.values import Expression, String


@attrs.frozen
class Print:
    """``PRINT (values and strings)``."""

    span: Span
    items: tuple[Expression | String, ...]
