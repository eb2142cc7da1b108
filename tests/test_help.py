"""The help of every public function and class."""

import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import armwright

SOURCE = Path(armwright.__file__).parent
NAMESPACES = sorted(".".join(("armwright", *p.parent.relative_to(SOURCE).parts)) for p in SOURCE.rglob("__init__.pyi"))


def public(namespace: str) -> Iterator[tuple[str, Any]]:
    """Functions, classes and public methods of a namespace."""
    module = importlib.import_module(namespace)
    for name in module.__all__:
        value = getattr(module, name)
        if callable(value):
            yield name, value
        if inspect.isclass(value):
            methods = [key for key in vars(value) if callable(getattr(value, key))]
            methods = [key for key in methods if not key.startswith("_") or key == "__init__"]
            yield from ((f"{name}.{key}", getattr(value, key)) for key in methods)


# Models with a field for each thing that a file states.
MODELS = ("Arm", "Cell")


@pytest.mark.parametrize("namespace", NAMESPACES)
def test_signatures_are_short(namespace: str) -> None:
    """No signature that ``help`` prints is over 200 characters long; the names of the fields of a model may be 340."""
    for name, value in public(namespace):
        try:
            signature = str(inspect.signature(value))
        except ValueError:  # some builtin types have none
            continue
        most = 350 if name in MODELS or name.removesuffix(".__init__") in MODELS else 200
        assert len(signature.replace("self, ", "")) <= most, f"{namespace}.{name}{signature}"


def test_shortened_signatures_keep_names_and_annotations() -> None:
    """A shortened signature names the same parameters and defaults; annotations stay on the function."""
    function = armwright.program.run
    long = inspect.signature(inspect.unwrap(function), follow_wrapped=False)
    assert list(long.parameters) == list(function.__code__.co_varnames[: len(long.parameters)])
    assert long.parameters["cell"].default is None
    assert function.__annotations__["return"] is not inspect.Signature.empty
