"""What cannot be exported: errors with the line of the program and the reason."""

from collections.abc import Sequence

from armwright.errors import ArmwrightError
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.source import Source, Span


class ExportError(ArmwrightError, ValueError):
    """A program cannot be exported to a controller.

    Attributes:
        diagnostic: what cannot, where in the program, and what to do.
        source: text of the program.
    """

    def __init__(self, diagnostic: Diagnostic, source: Source) -> None:
        """Compose the message with the line of the program."""
        self.diagnostic, self.source = diagnostic, source
        line = source.line(diagnostic.span.start)
        super().__init__(f"{source.name_at(diagnostic.span.start)}:{line}: {diagnostic.code}: {diagnostic.message}")


def refusal(
    source: Source, code: str, message: str, span: Span, label: str, *, helps: Sequence[str] = ()
) -> ExportError:
    """Return the error for a statement that cannot be exported.

    Args:
        source: text of the program.
        code: of the diagnostic, such as ``E611``.
        message: what cannot be exported, and why.
        span: the statement.
        label: what is said at it.
        helps: what to do.
    """
    diagnostic = Diagnostic(code=code, message=message, span=span, label=label, helps=tuple(helps))
    return ExportError(diagnostic, source)
