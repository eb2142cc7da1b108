"""The libraries that a sweep needs beyond the core."""

from importlib import import_module
from types import ModuleType

from armwright.errors import MissingExtraError

# What reads results, and what keeps the linear algebra to one thread.
NEEDED = ("xarray", "threadpoolctl")


def check_extras() -> None:
    """Import what every sweep needs.

    Raises:
        MissingExtraError: one of them is not installed.
    """
    for name in NEEDED:
        extra(name)


def extra(name: str) -> ModuleType:
    """Import a library of the extra ``sweep``.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(f'a sweep needs {name}; install it by: pip install "armwright[sweep]"') from error
