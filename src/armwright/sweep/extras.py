"""The libraries that a sweep needs beyond the core."""

from importlib import import_module
from types import ModuleType

from armwright.errors import MissingExtraError


def extra(name: str) -> ModuleType:
    """Import a library of the extra ``sweep``.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(f'a sweep needs {name}; install it by: pip install "armwright[sweep]"') from error


def check_extras() -> None:
    """Import what every sweep needs, on a cluster or not; see ``extra``."""
    extra("xarray")
    extra("threadpoolctl")
