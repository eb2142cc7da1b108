"""The experiments of the sources behind a protocol, by name."""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Protocol

from armwright.errors import one_of
from armwright.files.result_table import Result
from armwright.report.elements import Tile
from armwright.report.figures import Drawing, Film

Progress = Callable[[str, float], None]


class Study(Result, Protocol):
    """An experiment of a source that has run: its tables hold what is printed beside what is computed.

    A module of this folder has a class for each experiment, whose ``run`` runs it.
    """

    @property
    def title(self) -> str:
        """What is repeated, and of which source."""

    def headline(self) -> Iterator[Tile]:
        """Give the numbers that a reader looks for first."""

    def figures(self) -> Sequence[Drawing | Film]:
        """Return the figures in the order of the source."""


# Module and class of each study, by name.
_STUDIES = {
    "stanford-torque": ("stanford_torque_study", "StanfordTorque"),
    "puma-moves": ("puma_moves_study", "PumaMoves"),
    "five-bar-clearance": ("five_bar_clearance_study", "FiveBarClearance"),
    "dh-calibration": ("dh_calibration_study", "DhCalibration"),
    "five-bar-life": ("five_bar_life", "FiveBarLife"),
    "identified-arm": ("identified_arm", "IdentifiedArm"),
    "linkage-simulators": ("linkage_simulators", "LinkageSimulators"),
}
STUDIES = tuple(_STUDIES)


def run_study(name: str, progress: Progress | None = None) -> Study:
    """Run an experiment.

    Args:
        name: a name of ``STUDIES``.
        progress: called with the current task and the finished part of it, 0 to 1.

    Raises:
        UnknownNameError: the name is unknown.
        MissingExtraError: the study needs a package that is not installed.
    """
    module, study = _STUDIES[one_of("study", name, _STUDIES)]
    result: Study = getattr(import_module(f"armwright.study.{module}"), study).run(progress)
    return result
