"""Doors of packages: what the stub beside a package lists is imported when it is first asked for."""

from collections.abc import Callable
from typing import Any

import lazy_loader

from armwright.errors import closest


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose public names stand in a stub.

    Args:
        package: its ``__name__``.
        file: its ``__file__``; the stub is ``__init__.pyi`` beside it.
    """
    load, list_names, names = lazy_loader.attach_stub(package, file)

    def get(name: str) -> Any:
        if name not in names:
            near = closest(name, names)
            hint = f"; did you mean {near!r}?" if near else ""
            raise AttributeError(f"module {package!r} has no attribute {name!r}{hint}", name=name)
        return load(name)

    return get, list_names, names
