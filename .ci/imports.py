"""Import every module of the installed armwright; with `core`, those that need an extra may say so."""

import importlib
import pkgutil
import sys

import armwright

# Modules that cannot be imported without an extra; all others import a heavy library only when it is used.
_OF_EXTRAS = ("pygls", "lsprotocol")

# What `armwright clearance export` writes for users of Exudyn, and does not import.
_SCRIPTS = (".__main__", ".run_linkage")

core = "core" in sys.argv[1:]
modules = [module.name for module in pkgutil.walk_packages(armwright.__path__, "armwright.")]
for name in modules:
    if name.endswith(_SCRIPTS):
        continue
    try:
        importlib.import_module(name)
    except ImportError as error:
        if not core or error.name is None or error.name.split(".")[0] not in _OF_EXTRAS:
            raise
print(f"{len(modules)} modules imported")
