"""The worn surfaces of a life in a file: what `armwright clearance wear -o` writes, and a simulation takes up."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import evenly_spread, floats, not_negative
from armwright.clearance.linkage import Linkage
from armwright.clearance.wear.life import WearLife
from armwright.clearance.wear.worn_surfaces import FEWEST_BINS, MOST_BINS, WornSurfaces, surfaces_between
from armwright.errors import ArmwrightError, FileFormatError, InvalidValueError
from armwright.files.inputs import read_text

# States of a life that are kept at most, and digits of their depths.
_MOST_STATES, _DIGITS = 41, 6
# A surface that has lost more is no pin any more [m].
_DEEPEST = 1.0
# Clearances of a linkage and of its life may differ by rounding.
_ROUNDING = 1e-9


def surfaces_data(life: WearLife) -> dict[str, Any]:
    """Return the surfaces of a life as plain data: strokes, and depths by state, pin and bin [m]."""
    kept = evenly_spread(len(life.strokes), _MOST_STATES)
    pins = life.stroke.linkage.pins
    return {
        "clearances": life.stroke.linkage.clearances,
        "strokes": life.strokes[kept].tolist(),
        **{
            side: {
                pin.name: [[_rounded(x) for x in getattr(life.surfaces[k], side)[i]] for k in kept]
                for i, pin in enumerate(pins)
            }
            for side in ("bearing", "journal")
        },
    }


def read_worn_surfaces(path: Path, linkage: Linkage, strokes: float | None = None) -> tuple[WornSurfaces, float]:
    """Return the surfaces of a linkage after strokes of a life, and these strokes.

    Between the states of the file depths grow evenly.

    Args:
        path: of ``wear.json``.
        linkage: new.
        strokes: of the life; the last when left out.

    Raises:
        FileFormatError: the file is no such life, or that of other pins.
        InvalidValueError: the strokes are not within the life.
    """
    text = read_text(path)
    try:
        data = json.loads(text)["surfaces"]
        known = floats(data["strokes"], "strokes")
        clearances = {str(name): float(c) for name, c in data["clearances"].items()}
        sides = [np.stack([floats(data[side][name], side) for name in clearances]) for side in ("bearing", "journal")]
        _, states, bins = sides[0].shape
        sound = (
            sides[0].shape == sides[1].shape
            and (states,) == known.shape
            and np.all(np.diff(known) > 0)
            and all(np.all((side >= 0) & (side <= _DEEPEST)) for side in sides)
            and FEWEST_BINS <= bins <= MOST_BINS
        )
        if not sound:
            raise ValueError  # noqa: TRY301 - turned into a FileFormatError below
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError, ArmwrightError) as error:
        said = "expected wear.json, as `armwright clearance wear -o` writes it"
        raise FileFormatError(path, None, "", said) from error
    own = linkage.clearances
    if clearances.keys() != own.keys() or any(abs(clearances[name] - c) > _ROUNDING for name, c in own.items()):
        raise FileFormatError(
            path,
            None,
            "surfaces.clearances",
            f"expected the pins of {linkage.name}, {_clearances_text(own)}, got {_clearances_text(clearances)}",
        )
    order = [list(clearances).index(name) for name in own]
    at = float(known[-1]) if strokes is None else not_negative(strokes, "strokes")
    if not known[0] <= at <= known[-1]:
        raise InvalidValueError(f"strokes: expected {known[0]:.4g} to {known[-1]:.4g}, as in {path}, got {at:g}")
    bearings, journals = (np.swapaxes(side[order], 0, 1) for side in sides)
    worn = [WornSurfaces(bearing=b, journal=j) for b, j in zip(bearings, journals, strict=True)]
    return surfaces_between(known, worn, at), at


def _rounded(depth: float) -> float:
    return float(f"{depth:.{_DIGITS}g}")


def _clearances_text(clearances: dict[str, float]) -> str:
    return ", ".join(f"{name} {c * 1e3:g} mm" for name, c in clearances.items())
