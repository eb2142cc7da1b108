"""The proof of an export: what was compared with the plan, how far it is off, and what is only approximated."""

from typing import Any

import attrs

from armwright.errors import CheckFailedError
from armwright.export.targets import Mode


@attrs.frozen(kw_only=True)
class Comparison:
    """One quantity of the exported file beside that of the plan.

    Attributes:
        quantity: what was compared, in words.
        count: how often.
        worst: the largest difference, in ``unit``.
        allowed: the largest that is allowed.
        unit: of both; empty for a number of cases.
        where: at the worst, such as ``line 12``; empty where nothing differs.
    """

    quantity: str
    count: int
    worst: float
    allowed: float
    unit: str = ""
    where: str = ""

    @property
    def passed(self) -> bool:
        """Whether the largest difference is allowed."""
        return self.worst <= self.allowed

    @property
    def text(self) -> str:
        """It in one line."""
        unit = f" {self.unit}" if self.unit else ""
        where = f" ({self.where})" if self.where and self.worst else ""
        return f"{self.quantity}: {self.count} compared, at most {self.worst:.3g} of {self.allowed:.3g}{unit}{where}"


@attrs.frozen(kw_only=True)
class Proof:
    """What a checker found.

    Attributes:
        target: of the export.
        mode: what was exported: a program, or the plan of its motion.
        comparisons: all that was compared.
        approximations: what differs from the plan, in words.
        notes: what of the run is fixed in the export.
        sources: of the convention of the controller, one line each.
    """

    target: str
    mode: Mode = "plan"
    comparisons: tuple[Comparison, ...]
    approximations: tuple[str, ...]
    notes: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    def require(self) -> None:
        """See to it that everything is as in the plan.

        Raises:
            CheckFailedError: something is not; the message has all of that.
        """
        failed = [one.text for one in self.comparisons if not one.passed]
        if failed:
            raise CheckFailedError(
                f"the exported program differs from the {'plan' if self.mode == 'plan' else 'run'}; {'; '.join(failed)}"
            )

    def as_data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "target": self.target,
            "mode": self.mode,
            "comparisons": [{**attrs.asdict(one), "passed": one.passed} for one in self.comparisons],
            "approximations": list(self.approximations),
            "fixed": list(self.notes),
            "sources": list(self.sources),
        }

    def lines(self) -> list[str]:
        """Return it in words."""
        return [
            *(one.text for one in self.comparisons),
            *(f"approximated: {text}" for text in self.approximations),
            *(f"fixed: {text}" for text in self.notes),
        ]
