"""``armwright simulate``: what an arm does when its drives do this."""

import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armwright.cli.load import Load
from armwright.cli.numbers import within
from armwright.cli.options import ArmName, Json
from armwright.cli.output import print_json
from armwright.cli.results import write_results

if TYPE_CHECKING:
    from armwright.arm.model import Arm
    from armwright.simulation.result import JointState, Simulation


# More changes of joints than this are counted, not listed.
_EVENTS = 20


class Drives(enum.StrEnum):
    """What the drives do."""

    OFF = "off"
    GRAVITY = "gravity"


class Method(enum.StrEnum):
    """How the motion is integrated."""

    GILL = "gill"
    ADAPTIVE = "adaptive"


def simulate(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    configuration: Annotated[str, typer.Option("-q", help="Where it starts, degrees and mm: 10,20,30.")],
    speeds: Annotated[str | None, typer.Option("--qd", help="Speeds at the start, degrees/s and mm/s.")] = None,
    duration: Annotated[float, typer.Option(help="How long, in s.")] = 1.0,
    drives: Annotated[Drives, typer.Option(help="Off, or holding the arm's weight.")] = Drives.OFF,
    method: Annotated[Method, typer.Option(help="Runge-Kutta-Gill in fixed steps, or adaptive.")] = Method.ADAPTIVE,
    step_ms: Annotated[float, typer.Option(help="Step of Runge-Kutta-Gill, and time between rows.")] = 1.0,
    load: Load = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for motion.csv.")] = None,
    as_json: Json = False,
) -> None:
    """Let an arm go and follow it: friction, stops and weight included, with an account of the energy.

    **Example:** `armwright simulate puma560 -q 0,0,90,0,0,0 --duration 2`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.cli.load import load_in_hand
    from armwright.dynamics.payloads import payload
    from armwright.report.motion_table import motion_csv
    from armwright.simulation.controllers import gravity_compensation, no_effort
    from armwright.simulation.integrators import Adaptive, Gill
    from armwright.simulation.simulator import simulate as run

    model = load_arm(arm)
    if load is not None:
        held = load_in_hand(load)
        model = payload(model, held.mass, held.com, held.inertia)
    within(step_ms, (0.001, 1000), "--step-ms")
    found = run(
        model,
        joint_values(model, configuration, "-q"),
        None if speeds is None else joint_values(model, speeds, "--qd"),
        duration=duration,
        controller=gravity_compensation(model) if drives is Drives.GRAVITY else no_effort(model),
        integrator=Gill(length=step_ms * 1e-3) if method is Method.GILL else Adaptive(),
        period=step_ms * 1e-3,
    )
    if output is not None:
        write_results(output, {"motion.csv": motion_csv(found.t, found.q, found.qd, found.qdd, found.tau)})
    if as_json:
        print_json({"status": found.status.name.lower(), "t": float(found.t[-1]), **_account(found)})
    else:
        _print(model, found)


def _account(found: "Simulation") -> dict[str, float]:
    return {
        "kinetic": float(found.kinetic[-1]),
        "potential_change": float(found.potential[-1] - found.potential[0]),
        "work_of_drives": float(found.work[-1].sum()),
        "heat_of_friction": float(found.heat[-1].sum()),
        "lost_at_stops": float(found.impact[-1]),
        "imbalance": float(abs(found.imbalance).max()),
    }


def _print(model: "Arm", found: "Simulation") -> None:
    from armwright.cli.joints import units

    print(f"{found.status.name.lower()} after {found.t[-1]:.3f} s")
    per_unit = units(model)
    for i, joint in enumerate(model.joints):
        unit = "deg" if joint.revolute else "mm"
        start, end, speed = (values[i] / per_unit[i] for values in (found.q[0], found.q[-1], found.qd[-1]))
        print(f"  {model.called(i)}: from {start:z9.3f} to {end:z9.3f} {unit}, at {speed:z9.3f} {unit}/s")
    for name, value in _account(found).items():
        print(f"  {name.replace('_', ' '):<18}{value:z12.6g} J")
    shown = found.events[:_EVENTS]
    for event in shown:
        print(f"  {event.t:.4f} s: {model.called(event.joint)} {_word(event.before)}, then {_word(event.after)}")
    if len(found.events) > len(shown):
        print(f"  ... and {len(found.events) - len(shown)} changes more")


def _word(state: "JointState") -> str:
    return state.name.lower().replace("_", " ")
