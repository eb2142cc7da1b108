"""What has happened by a time, taken up piece by piece, is what looking through all of it finds."""

from pathlib import Path

import armwright.program
from armwright.studio.shown_effects import ShownEffects
from samples import Sample

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_piece_by_piece(sample: Sample) -> None:
    """At times that go on and back, while effects are added, it is as if all had been looked through."""
    recording = armwright.program.run(EXAMPLES / "hand_over.rlo", EXAMPLES / "two_arms.toml")
    effects = sorted(recording.effects, key=lambda effect: effect.order)
    for rng in sample.cases(100):
        shown, known, time = ShownEffects(), list(effects[:3]), 0.0
        while len(known) < len(effects):
            known += effects[len(known) : len(known) + int(rng.integers(0, 4))]
            time = float(rng.uniform(0, time)) if rng.random() < 0.2 else time + float(rng.exponential(0.4))
            shown.update(known, time)
            begun = sorted((it for it in known if it.t0 <= time + 1e-9), key=lambda it: (it.t0, it.order))
            assert sorted(shown.begun, key=lambda it: (it.t0, it.order)) == begun
            for arm in ("ARM_1", "ARM_2"):
                moved = [it.kind == "OPEN" for it in begun if it.arm == arm and it.kind in {"OPEN", "GRASP"}]
                assert shown.openings.get(arm) == (float(moved[-1]) if moved else None)
