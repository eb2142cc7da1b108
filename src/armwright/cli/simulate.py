"""``armwright simulate``: simulate the motion of an arm with its drives off or holding its weight."""

from typing import TYPE_CHECKING, Annotated, Literal

from typer import Option

from armwright.cli.numbers import within
from armwright.cli.options import ArmName, Json, Log, OutputFolder, check_log
from armwright.cli.output import print_result
from armwright.cli.results import write_results
from armwright.cli.tool_options import Load, read_payload

if TYPE_CHECKING:
    from armwright.files.output import Content
    from armwright.report.log_files import LogFormat
    from armwright.simulation.result import Simulation


def simulate(  # noqa: PLR0917 - Typer reads one parameter per option
    arm: ArmName,
    configuration: Annotated[str, Option("-q", help="Initial joint positions in degrees and mm, as in 10,20,30.")],
    speeds: Annotated[
        str | None, Option("--qd", help="Initial joint velocities, in degrees/s (revolute) and mm/s (prismatic).")
    ] = None,
    duration: Annotated[float, Option(help="Duration of the simulation in s.")] = 1.0,
    drives: Annotated[Literal["off", "gravity"], Option(help="Drives off, or compensating gravity.")] = "off",
    method: Annotated[
        Literal["gill", "adaptive"],
        Option(help="Integrator: Runge-Kutta-Gill with fixed steps, or adaptive steps."),
    ] = "adaptive",
    step_ms: Annotated[float, Option(help="Step of Runge-Kutta-Gill, and period of the rows, in ms.")] = 1.0,
    load: Load = None,
    output: OutputFolder = None,
    log: Log = None,
    as_json: Json = False,
) -> None:
    """Simulate the free response of an arm with friction, stops and gravity, and print its energy balance.

    With -o the command writes motion.csv, and with --log a log for viewers of robot data.

    **Example:** `armwright simulate puma560 -q 0,0,90,0,0,0 --duration 2`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.dynamics.payloads import payload
    from armwright.report.motion_table import motion_csv
    from armwright.simulation.controllers import gravity_compensation, no_effort
    from armwright.simulation.integrators import Adaptive, Gill
    from armwright.simulation.simulator import simulate as run

    check_log(log, output)
    model = load_arm(arm)
    if load is not None:
        body = read_payload(load)
        model = payload(model, body.mass, body.com, body.inertia)
    within(step_ms, (0.001, 1000), "--step-ms")
    simulation = run(
        model,
        joint_values(model, configuration, "-q"),
        None if speeds is None else joint_values(model, speeds, "--qd"),
        duration=duration,
        controller=gravity_compensation(model) if drives == "gravity" else no_effort(model),
        integrator=Gill(length=step_ms * 1e-3) if method == "gill" else Adaptive(),
        period=step_ms * 1e-3,
    )
    if output is not None:
        s = simulation
        logged = {} if log is None else _log_files(s, log)
        write_results(output, {"motion.csv": motion_csv(s.t, s.q, s.qd, s.qdd, s.tau), **logged})
    print_result(simulation, as_json=as_json)


def _log_files(simulation: "Simulation", log: "LogFormat") -> "dict[str, Content]":
    from armwright.report.log_content import simulation_log_content
    from armwright.report.log_files import log_files

    return log_files(log, simulation_log_content(simulation))
