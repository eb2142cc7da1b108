"""The meshes that a URDF file names: below its own folder, or below that of a package."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote

import attrs

from armwright.arm.urdf.elements import Element
from armwright.errors import (
    ArmwrightError,
    FileFormatError,
    InvalidValueError,
    MissingExtraError,
    listed,
    shown,
)
from armwright.files.inputs import file_below
from armwright.files.limits import limit, limit_message
from armwright.spatial.shapes import Mesh

# So many reasons why meshes are not read are given, for each so many meshes are named, by so many letters at the end.
_MAX_NOTES, _MAX_NAMED, _MAX_LETTERS = 10, 10, 50


def _folders(value: Mapping[str, Path | str]) -> dict[str, Path]:
    return {name: Path(folder) for name, folder in value.items()}


@attrs.frozen(kw_only=True, eq=False)
class MeshFiles:
    """Where the meshes of a URDF file are, and which were not read.

    Attributes:
        folder: that of the file.
        packages: folders of packages, by name.
    """

    folder: Path
    packages: Mapping[str, Path] = attrs.field(factory=dict, converter=_folders)
    _unread: dict[str, str] = attrs.field(factory=dict, init=False)
    _read: dict[tuple[Path, tuple[float, ...]], Mesh] = attrs.field(factory=dict, init=False)

    def notes(self) -> list[str]:
        """Return sentences on the meshes that were not read, one for each reason."""
        by_reason: dict[str, list[str]] = {}
        for name, why in self._unread.items():
            by_reason.setdefault(why, []).append(_shown_end(name))
        notes = [
            f"the {'mesh' if len(names) == 1 else 'meshes'} {listed(names, _MAX_NAMED)} "
            f"{'is' if len(names) == 1 else 'are'} not read: {why}"
            for why, names in by_reason.items()
        ]
        more = sum(len(names) for names in list(by_reason.values())[_MAX_NOTES:])
        return [*notes[:_MAX_NOTES], *([f"{more:,} more are not read for other reasons"] if more else [])]

    def mesh(self, element: Element) -> Mesh | None:
        """Return the mesh of an element <mesh>; None, and a note, where its file is not there or of no known format.

        Raises:
            FileFormatError: the file is there and broken, or the scale is none.
        """
        name = element.text("filename")
        scale = element.vector("scale", (1.0, 1.0, 1.0))
        if not scale.all():
            raise element.error("scale", f"expected numbers other than 0, got {scale.tolist()}")
        try:
            path = self._path(name)
        except ArmwrightError as error:
            self._unread[name] = str(error)
            return None
        key = path, tuple(scale)
        if key not in self._read:
            from armwright.spatial.meshes.reader import has_unit, read_mesh  # noqa: PLC0415 - few files have meshes

            try:
                # Lengths in URDF are in metres, and the scale is for other units.
                self._read[key] = read_mesh(path, unit=None if has_unit(path) else "m", scale=tuple(scale))
            except MissingExtraError as error:
                self._unread[name] = str(error)
                return None
            except (FileFormatError, InvalidValueError) as error:
                raise element.error("filename", f"{error}; a scale is for lengths in another unit than m") from error
            triangles = sum(len(mesh.faces) for mesh in self._read.values())
            if triangles > limit("file_triangles"):
                raise element.error("filename", f"too many in this file: {limit_message('file_triangles', triangles)}")
        return self._read[key]

    def _path(self, name: str) -> Path:
        """Return the path of a mesh.

        Raises:
            ArmwrightError: it is not there, lies elsewhere, or is of a format that is not read.
        """
        from armwright.spatial.meshes.reader import MESH_SUFFIXES  # noqa: PLC0415 - few files have meshes

        scheme, separator, rest = name.partition("://")
        if not separator:
            candidates = [(self.folder, name)]
        elif scheme == "file":
            # Whole paths are for the machine where the file was made; they may still lead here.
            path = Path(unquote(rest))
            candidates = [(self.folder, _from(self.folder, path))]
        elif scheme in {"package", "model"}:
            package, _, rest = rest.partition("/")
            rest = unquote(rest)
            if package in self.packages:
                candidates = [(self.packages[package], rest)]
            else:
                candidates = [(self.folder, f"{package}/{rest}"), (self.folder, rest)]
        else:
            raise InvalidValueError(f"nothing is fetched from {shown(scheme)}")
        if not name.lower().endswith(MESH_SUFFIXES):
            raise InvalidValueError(f"expected a name that ends in one of {', '.join(MESH_SUFFIXES)}")
        for folder, rest in candidates:
            path = file_below(folder, rest)
            if path.is_file():
                return path
        hint = ""
        if scheme in {"package", "model"} and package not in self.packages:
            hint = f"; name the folder of its package: packages={{{package!r}: DIR}} (--package {package}=DIR)"
        raise InvalidValueError(f"no such file below {candidates[0][0]}{hint}")


def _from(folder: Path, path: Path) -> str:
    """Return a whole path as one from a folder, or as it is where it leads elsewhere."""
    here = folder.resolve()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def _shown_end(name: str) -> str:
    """Return the name of a file for a message: of a long one the end, which tells it from others."""
    return shown(name if len(name) <= _MAX_LETTERS else f"...{name[-_MAX_LETTERS:]}")
