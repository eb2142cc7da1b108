"""Lazy namespaces of packages: a public name listed in the stub beside a package is imported at its first use."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import lazy_loader

from armwright.errors import closest

if TYPE_CHECKING:
    from inspect import Signature

MAX_SIGNATURE_LENGTH = 200
MAX_DEFAULT_LENGTH = 40


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose public names are listed in a stub.

    Args:
        package: its ``__name__``.
        file: its ``__file__``; the stub is ``__init__.pyi`` beside it.
    """
    load, list_names, names = lazy_loader.attach_stub(package, file)

    def get_attribute(name: str) -> Any:
        if name not in names:
            near = closest(name, names)
            hint = f"; did you mean {near!r}?" if near else ""
            raise AttributeError(f"module {package!r} has no attribute {name!r}{hint}", name=name)
        return with_short_signature(load(name))

    return get_attribute, list_names, names


class _OmittedDefault:
    def __repr__(self) -> str:
        return "..."


def with_short_signature(value: Any) -> Any:
    """Return a function or class whose signature ``help()`` prints in at most 200 characters.

    A longer signature loses its annotations, as in the help of NumPy and SciPy, where the docstring names the types;
    defaults whose text is long or computed are printed as ``...``. ``__annotations__`` and calls are untouched.
    """
    import inspect  # noqa: PLC0415 - not needed to import the package

    if inspect.isclass(value):
        methods = [method for name, method in vars(value).items() if name == "__init__" or not name.startswith("_")]
        for method in filter(inspect.isfunction, methods):
            _shorten(method, inspect.signature(method))
        if "__init__" in vars(value):
            signature = inspect.signature(value.__init__)
            _shorten(value, signature.replace(parameters=[*signature.parameters.values()][1:]))
    elif inspect.isfunction(value):
        _shorten(value, inspect.signature(value))
    return value


def _shorten(value: Any, signature: "Signature") -> None:
    """Set the signature that help prints of a function or class, if its own is too long."""
    if len(str(signature)) > MAX_SIGNATURE_LENGTH:
        parameters = [
            p.replace(annotation=p.empty, default=_OmittedDefault() if _is_long(p.default, p.empty) else p.default)
            for p in signature.parameters.values()
        ]
        value.__signature__ = signature.replace(parameters=parameters, return_annotation=signature.empty)


def _is_long(default: Any, empty: Any) -> bool:
    return default is not empty and (len(repr(default)) > MAX_DEFAULT_LENGTH or repr(default) == "NOTHING")
