"""The libraries that a sweep needs beyond the core."""

from types import ModuleType

from armwright.extras import import_extra


def extra(name: str) -> ModuleType:
    """Import a library of the extra ``sweep``; see ``import_extra``."""
    return import_extra(name, "a sweep", "sweep")


def check_extras() -> None:
    """Import what every sweep needs, on a cluster or not; see ``extra``."""
    extra("xarray")
    extra("threadpoolctl")
