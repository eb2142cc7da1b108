"""Diagnostics of a program in the words of the Language Server Protocol."""

from collections.abc import Iterator
from pathlib import PurePosixPath

from lsprotocol import types as lsp

from armwright.errors import counted
from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.names import is_module
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.positions import span_range

# So many errors of a module are pointed at from the program that imports it.
_MAX_SHOWN = 20


def lsp_diagnostics(analysis: Analysis, uri: str, *, related: bool) -> list[lsp.Diagnostic]:
    """Return what is wrong with a program.

    Args:
        analysis: of the program.
        uri: of its document.
        related: whether the editor shows other locations beside the first.
    """
    own = [_diagnostic(diagnostic, analysis, uri, related=related) for diagnostic in analysis.diagnostics]
    return [*own, *_module_diagnostics(analysis, uri, related=related)]


def _module_diagnostics(analysis: Analysis, uri: str, *, related: bool) -> Iterator[lsp.Diagnostic]:
    """Give one diagnostic for each module that has errors, at its IMPORT or the first one."""
    imports = [node for node in analysis.compiled.tree.imports if is_module(node.path.value)]
    for path, diagnostics in analysis.module_diagnostics.items():
        errors = [diagnostic for diagnostic in diagnostics if diagnostic.is_error]
        if not errors or not imports:
            continue
        node = next((node for node in imports if PurePosixPath(node.path.value) == PurePosixPath(path)), imports[0])
        places = [
            lsp.DiagnosticRelatedInformation(analysis.location(uri, one.span), f"{one.code}: {one.message}")
            for one in errors[:_MAX_SHOWN]
        ]
        yield lsp.Diagnostic(
            range=span_range(analysis.codec, node.path.span),
            message=f"{path} has {counted(len(errors), 'error')}; the first: {errors[0].message}",
            severity=lsp.DiagnosticSeverity.Error,
            code=errors[0].code,
            source="armwright",
            related_information=places if related else None,
        )


def _diagnostic(diagnostic: Diagnostic, analysis: Analysis, uri: str, *, related: bool) -> lsp.Diagnostic:
    severity = lsp.DiagnosticSeverity.Error if diagnostic.is_error else lsp.DiagnosticSeverity.Warning
    if diagnostic.code.startswith("L"):
        severity = lsp.DiagnosticSeverity.Information
    locations = [
        lsp.DiagnosticRelatedInformation(analysis.location(uri, label.span), label.text)
        for label in diagnostic.secondary
    ]
    return lsp.Diagnostic(
        range=span_range(analysis.codec, diagnostic.span),
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
