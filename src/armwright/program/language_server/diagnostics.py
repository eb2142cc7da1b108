"""Diagnostics of a program in the words of the Language Server Protocol."""

from lsprotocol import types as lsp

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.positions import span_range


def lsp_diagnostics(analysis: Analysis, uri: str, *, related: bool) -> list[lsp.Diagnostic]:
    """Return what is wrong with a program.

    Args:
        analysis: of the program.
        uri: of its document.
        related: whether the editor shows other locations beside the first.
    """
    diagnostics = analysis.complete.diagnostics
    return [_diagnostic(diagnostic, analysis.codec, uri, related=related) for diagnostic in diagnostics]


def _diagnostic(diagnostic: Diagnostic, codec: PositionCodec, uri: str, *, related: bool) -> lsp.Diagnostic:
    severity = lsp.DiagnosticSeverity.Error if diagnostic.is_error else lsp.DiagnosticSeverity.Warning
    if diagnostic.code.startswith("L"):
        severity = lsp.DiagnosticSeverity.Information
    locations = [
        lsp.DiagnosticRelatedInformation(lsp.Location(uri, span_range(codec, label.span)), label.text)
        for label in diagnostic.secondary
    ]
    return lsp.Diagnostic(
        range=span_range(codec, diagnostic.span),
        message=_message(diagnostic),
        severity=severity,
        code=diagnostic.code,
        source="armwright",
        tags=[lsp.DiagnosticTag.Unnecessary] if diagnostic.code == "L304" else None,
        related_information=locations if related and locations else None,
    )


def _message(diagnostic: Diagnostic) -> str:
    """Return all texts of a diagnostic, a line each."""
    lines = [diagnostic.message]
    if diagnostic.label and diagnostic.label not in diagnostic.message:
        lines = [f"{diagnostic.message}: {diagnostic.label}"]
    lines += [f"note: {note}" for note in diagnostic.notes]
    return "\n".join([*lines, *(f"help: {help_}" for help_ in diagnostic.helps)])
