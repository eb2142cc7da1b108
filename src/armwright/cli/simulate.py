"""``armwright simulate``: simulate the motion of an arm with its drives off or holding its weight."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Option

from armwright.cli.numbers import within
from armwright.cli.options import ArmName, Json, Log, OutputFolder, check_log, usage_error
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
    drives: Annotated[
        Literal["off", "gravity", "held"],
        Option(help="Drives off, compensating gravity, or with --flexible held where they start."),
    ] = "off",
    flexible: Annotated[
        bool, Option("--flexible", help="Gears are springs, by the stiffness in the arm file; there are no stops.")
    ] = False,
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

    With -o the command writes motion.csv, and with --log a log for viewers of robot data. With --flexible the links
    start on relaxed gears, motion.csv has the links, and motors.csv the motors (docs/vibration.md).

    **Example:** `armwright simulate puma560 -q 0,0,90,0,0,0 --duration 2`
    """
    from armwright.arm.load import load_arm
    from armwright.cli.joints import joint_values
    from armwright.dynamics.payloads import payload
    from armwright.report.motion_table import flexible_motion_files, motion_csv
    from armwright.simulation.controllers import gravity_compensation, no_effort, standing
    from armwright.simulation.flexible_joints import simulate_flexible
    from armwright.simulation.integrators import Adaptive, Gill
    from armwright.simulation.simulator import simulate as run

    if drives == "held" and not flexible:
        raise usage_error("--drives", "held drives hold a rigid arm; expected --flexible with them")
    if log is not None and flexible:
        raise usage_error("--log", "expected a simulation without --flexible for a log")
    check_log(log, output)
    model = load_arm(arm)
    if load is not None:
        body = read_payload(load)
        model = payload(model, body.mass, body.com, body.inertia)
    within(step_ms, (0.001, 1000), "--step-ms")
    q = joint_values(model, configuration, "-q")
    qd = None if speeds is None else joint_values(model, speeds, "--qd")
    controller = gravity_compensation(model) if drives == "gravity" else no_effort(model)
    settings: dict[str, Any] = {
        "duration": duration,
        "integrator": Gill(length=step_ms * 1e-3) if method == "gill" else Adaptive(),
        "period": step_ms * 1e-3,
    }
    if flexible:
        command = {"motors": standing(q)} if drives == "held" else {"controller": controller}
        swung = simulate_flexible(model, q, qd, **command, **settings)
        if output is not None:
            write_results(output, flexible_motion_files(swung))
        print_result(swung, as_json=as_json)
        return
    simulation = run(model, q, qd, controller=controller, **settings)
    if output is not None:
        s = simulation
        logged = {} if log is None else _log_files(s, log)
        write_results(output, {"motion.csv": motion_csv(s.t, s.q, s.qd, s.qdd, s.tau), **logged})
    print_result(simulation, as_json=as_json)


def _log_files(simulation: "Simulation", log: "LogFormat") -> "dict[str, Content]":
    from armwright.report.log_content import simulation_log_content
    from armwright.report.log_files import log_files

    return log_files(log, simulation_log_content(simulation))
