"""The option --package: where the packages are that a URDF file names."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, TypeAlias

from typer import Option

from armwright.cli.options import usage_error

Packages: TypeAlias = Annotated[
    list[str] | None,
    Option("--package", help="Folder of a package whose meshes a URDF file names, as in ur_description=DIR."),
]


def package_folders(values: Iterable[str] | None) -> dict[str, Path]:
    """Return folders by the names of packages."""
    folders: dict[str, Path] = {}
    for value in values or ():
        name, equals, folder = value.partition("=")
        if not (name and equals and folder):
            raise usage_error("--package", f"expected NAME=DIR, got {value!r}")
        if not Path(folder).is_dir():
            raise usage_error("--package", f"expected a folder for {name}, got {folder}")
        folders[name] = Path(folder)
    return folders
