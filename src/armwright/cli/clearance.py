"""``armwright clearance``: linkages with clearance in their joints."""

from armwright.cli.clearance_compare import compare
from armwright.cli.clearance_correct import correct
from armwright.cli.clearance_estimate import estimate
from armwright.cli.clearance_export import export
from armwright.cli.clearance_plan_checks import plan_checks
from armwright.cli.clearance_reliability import reliability
from armwright.cli.clearance_simulate import simulate
from armwright.cli.clearance_sweep import sweep
from armwright.cli.clearance_tolerance import tolerance
from armwright.cli.clearance_vibration import vibration
from armwright.cli.clearance_wear import wear
from armwright.cli.commands import App, Group

clearance = App(name="clearance", cls=Group, no_args_is_help=True, rich_markup_mode="markdown")
clearance.command("simulate")(simulate)
clearance.command("sweep")(sweep)
clearance.command("estimate")(estimate)
clearance.command("correct")(correct)
clearance.command("wear")(wear)
clearance.command("compare")(compare)
clearance.command("export")(export)
clearance.command("tolerance")(tolerance)
clearance.command("reliability")(reliability)
clearance.command("vibration")(vibration)
clearance.command("plan-checks")(plan_checks)


@clearance.callback()
def group() -> None:
    """Simulate, estimate, correct and compare linkages with clearance in their pins; how long they stay accurate.

    **Example:** `armwright clearance simulate five-bar --path y1 -o out/rattling`
    """
