"""What a report says of collisions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from armwright.errors import listed
from armwright.program.vm.recording import Recording

if TYPE_CHECKING:
    from armwright.physics.collisions import CheckedBodies, StageClearance

# The text wherever a motion is reported whose collisions are not checked.
NOT_CHECKED = "not checked"
# Names that are listed.
_LISTED = 5


def collision_text(recording: Recording) -> str:
    """Return what was looked at for collisions in a run, and how near the arms came to other bodies."""
    checked = recording.checked
    if checked is None:
        return NOT_CHECKED
    return "; ".join([f"every MOVE checked, {checked.pairs} pairs of bodies", _least(recording), *_guesses(checked)])


def _least(recording: Recording) -> str:
    """Return the least distance of all stages."""
    near = [
        (run.clearance.distance, run, run.clearance)
        for run in recording.stages
        if run.clearance is not None and run.clearance.distance is not None
    ]
    if not near:
        from armwright.physics.collisions import LOOKED_FOR  # noqa: PLC0415 - of cells with bodies

        return f"no arm comes within {LOOKED_FOR * 1e3:g} mm of another body"
    distance, run, clearance = min(near, key=lambda entry: entry[0])
    own, other = clearance.bodies
    when = run.t0 + clearance.time
    return f"least distance {distance * 1e3:.1f} mm, {own} of {run.arm} and {other} at {when:.3f} s"


def _guesses(checked: CheckedBodies) -> list[str]:
    """Return of which arms the solids are guessed, and what does not count for that."""
    texts = [
        f"the links of {arm} are guessed capsules of {smallest * 1e3:.0f} to {largest * 1e3:.0f} mm radius"
        for arm, (largest, smallest) in checked.guessed.items()
    ]
    if checked.estimated:
        texts.append(f"a guess: {listed(checked.estimated, _LISTED)}")
    if checked.left_out:
        pairs = [f"{a} with {b}" for a, b in checked.left_out]
        texts.append(f"left out, as the guess meets the other at the start: {listed(pairs, _LISTED)}")
    return texts


def clearance_data(clearance: StageClearance | None) -> dict[str, Any] | None:
    """Return how near a stage comes to other bodies, as plain data in SI units; None where that is not looked at."""
    if clearance is None:
        return None
    near = clearance.distance is not None
    return {
        "distance": clearance.distance,
        "bound": clearance.bound,
        "bodies": list(clearance.bodies),
        "time": clearance.time if near else None,
        "position": list(clearance.point) if near else None,
    }
