"""``armwright clearance wear``: how the pins of a linkage wear, and how long its tip stays accurate."""

from typing import Annotated, Literal

from typer import Option

from armwright.cli.linkages import (
    BearingShare,
    Clearances,
    LinkageName,
    SpeedRpm,
    TipPathName,
    WidthMm,
    path_of,
    with_clearances,
)
from armwright.cli.options import Json, OutputFolder, Quiet
from armwright.cli.output import command_line, print_result
from armwright.cli.progress import counting
from armwright.cli.results import write_results


def wear(  # noqa: PLR0917 - Typer reads one parameter per option
    linkage: LinkageName,
    k: Annotated[float, Option("--k", help="Wear coefficient of Archard's law in mm³/(N m); take a measured one.")],
    path: TipPathName = None,
    speed_rpm: SpeedRpm = None,
    k_spread: Annotated[
        float, Option("--k-spread", help="Standard deviation of the logarithm of the wear coefficient.")
    ] = 0.5,
    clearance: Clearances = None,
    width_mm: WidthMm = 20.0,
    bearing_share: BearingShare = 0.5,
    pressure: Annotated[
        Literal["hertz", "winkler"],
        Option(help="Pressure: on the half-angle of a Hertz line contact, or of an elastic layer (Winkler)."),
    ] = "hertz",
    layer_mm: Annotated[float, Option(help="Thickness of the elastic layer in mm.")] = 1.0,
    layer_mpa: Annotated[
        float, Option(help="Modulus of elasticity of the layer in MPa; Poisson's ratio is 0.3.")
    ] = 1e3,
    limit_rp: Annotated[float | None, Option("--limit-rp", help="Limit of RP of ISO 9283 in mm.")] = None,
    limit_ap: Annotated[float | None, Option("--limit-ap", help="Limit of AP of ISO 9283 in mm.")] = None,
    limit_path: Annotated[float | None, Option("--limit-path", help="Limit of the error along the path in mm.")] = None,
    steps: Annotated[int, Option(help="Number of extrapolated steps, each of at most 2 % of a clearance.")] = 20,
    simulate_after: Annotated[
        list[float] | None,
        Option(help="Strokes after which one is simulated with its impacts, beside the first and last; repeatable."),
    ] = None,
    output: OutputFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Wear the pins of a linkage over many strokes, and print how long its tip stays accurate.

    Journals and bearings lose height after Archard's law where the motion presses and rubs them. Many strokes are
    extrapolated in one step; the life is computed twice, the second time with steps of half the depth, and the
    difference is printed. The first and the last stroke are also simulated with their impacts, the last on worn walls.
    With -o, report.html shows the worn profiles, magnified, and the errors over the strokes, and wear.json holds them
    for `armwright clearance simulate --worn`.

    **Example:** `armwright clearance wear five-bar --path y1 --k 1e-5 --limit-rp 0.04 -o out/worn`
    """
    from armwright.clearance.linkage import Material
    from armwright.clearance.reader import load_linkage
    from armwright.clearance.wear.assessment import assess_wear
    from armwright.clearance.wear.worn_surfaces import WearLaw
    from armwright.report.wear_files import wear_files

    model = with_clearances(load_linkage(linkage), clearance or [])
    law = WearLaw(
        coefficient=k * 1e-9,
        width=width_mm * 1e-3,
        bearing_share=bearing_share,
        pressure=pressure,
        layer=layer_mm * 1e-3,
        layer_material=Material(young=layer_mpa * 1e6),
    )
    limits = {"AP": limit_ap, "RP": limit_rp, "path": limit_path}
    with counting("wear", quiet=quiet or as_json) as progress:
        assessment = assess_wear(
            model,
            path_of(model, path, speed_rpm, 1.0),
            law,
            spread=k_spread,
            limits={name: limit * 1e-3 for name, limit in limits.items() if limit is not None},
            steps=steps,
            simulate_after=simulate_after or (),
            progress=progress,
        )
    if output is not None:
        write_results(output, wear_files(assessment, command=command_line()))
    print_result(assessment, as_json=as_json, quiet=quiet, output=output)
