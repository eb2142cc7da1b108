"""How the life of a five-bar depends on which surface wears: the bearings, the journals, or both.

Run: python examples/worn_five_bar.py
"""

from armwright.clearance import load_linkage, named_path
from armwright.clearance.wear.life import wear_life
from armwright.clearance.wear.worn_stroke import Stroke
from armwright.clearance.wear.worn_surfaces import WearLaw

LIMIT = 1.0e-3  # of the error along the path [m]

stroke = Stroke.of(load_linkage("five-bar"), named_path("y1"), moments=81)
for share in (1.0, 0.5, 0.0):
    life = wear_life(stroke, WearLaw(coefficient=1e-14, bearing_share=share, bins=180), steps=10)
    strokes = life.strokes_to("path", LIMIT)
    print(f"bearings take {share:.0%}: {strokes:.2e} strokes until the path error passes {LIMIT * 1e3:g} mm")  # noqa: T201
