"""What is known of a program in the words of the Language Server Protocol."""

from collections.abc import Iterable, Sequence

from lsprotocol import types as lsp

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import Edit
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.completions import Completion
from armwright.program.language_server.hover import Hover
from armwright.program.language_server.inlay_hints import Hint
from armwright.program.language_server.outline import Entry, Fold
from armwright.program.language_server.signature_help import Signature


def span_range(codec: PositionCodec, span: Span) -> lsp.Range:
    """Return a stretch of text as lines and columns."""
    start, end = codec.place(span.start), codec.place(span.end)
    return lsp.Range(lsp.Position(*start), lsp.Position(*end))


def offset_of(codec: PositionCodec, position: lsp.Position) -> int:
    """Return the offset of a place."""
    return codec.offset(position.line, position.character)


def span_of(codec: PositionCodec, range_: lsp.Range) -> Span:
    """Return the stretch of text between two places."""
    start = offset_of(codec, range_.start)
    return Span(start, max(start, offset_of(codec, range_.end)))


def text_edits(codec: PositionCodec, edits: Iterable[Edit]) -> list[lsp.TextEdit]:
    """Return changes of a text."""
    return [lsp.TextEdit(span_range(codec, edit.span), edit.text) for edit in edits]


# ---- what is wrong -------------------------------------------------------------------------------------------------


def diagnostics(analysis: Analysis, codec: PositionCodec, uri: str, *, related: bool) -> list[lsp.Diagnostic]:
    """Return what is wrong with a program.

    Args:
        analysis: of the program.
        codec: of its text.
        uri: of its document.
        related: whether the editor shows other places beside the first.
    """
    return [_diagnostic(diagnostic, codec, uri, related=related) for diagnostic in analysis.compiled.diagnostics]


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
        message=message_of(diagnostic),
        severity=severity,
        code=diagnostic.code,
        source="armwright",
        tags=[lsp.DiagnosticTag.Unnecessary] if diagnostic.code == "L304" else None,
        related_information=locations if related and locations else None,
    )


def message_of(diagnostic: Diagnostic) -> str:
    """Return all words of a diagnostic, a line each."""
    lines = [diagnostic.message]
    if diagnostic.label and diagnostic.label not in diagnostic.message:
        lines = [f"{diagnostic.message}: {diagnostic.label}"]
    lines += [f"note: {note}" for note in diagnostic.notes]
    return "\n".join([*lines, *(f"help: {help_}" for help_ in diagnostic.helps)])


# ---- at a place ----------------------------------------------------------------------------------------------------


def hover(result: Hover, codec: PositionCodec, *, markdown: bool) -> lsp.Hover:
    """Return what there is to say about a stretch of text."""
    if markdown:
        text = "\n\n".join((f"```rlo\n{result.code}\n```", *result.lines))
        content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    else:
        text = "\n".join((result.code, *result.lines)).replace("`", "")
        content = lsp.MarkupContent(lsp.MarkupKind.PlainText, text)
    return lsp.Hover(content, span_range(codec, result.span))


def completion(result: Sequence[Completion], codec: PositionCodec, *, snippets: bool) -> lsp.CompletionList:
    """Return what can be written; whole statements only for an editor that leads from gap to gap."""
    items = []
    for number, offer in enumerate(result):
        if offer.kind is lsp.CompletionItemKind.Snippet and not snippets:
            continue
        is_snippet = offer.snippet and snippets
        text = offer.label if offer.snippet and not snippets else offer.text
        items.append(
            lsp.CompletionItem(
                label=offer.label,
                kind=offer.kind,
                detail=offer.detail or None,
                documentation=offer.documentation or None,
                sort_text=f"{number:04d}",
                insert_text_format=lsp.InsertTextFormat.Snippet if is_snippet else lsp.InsertTextFormat.PlainText,
                text_edit=lsp.TextEdit(span_range(codec, offer.span), text),
            )
        )
    return lsp.CompletionList(is_incomplete=False, items=items)


def signature(result: Signature, encoding: str) -> lsp.SignatureHelp:
    """Return what a call takes."""
    codec = PositionCodec(result.label, encoding)
    spans = [(codec.width(0, start), codec.width(0, end)) for start, end in result.parameters]
    parameters, active = [lsp.ParameterInformation(span) for span in spans], result.active if spans else None
    information = lsp.SignatureInformation(result.label, result.text or None, parameters, active)
    return lsp.SignatureHelp([information], 0, active)


# ---- of the whole --------------------------------------------------------------------------------------------------


def inlay_hints(result: Iterable[Hint], codec: PositionCodec) -> list[lsp.InlayHint]:
    """Return words between the words of a program."""
    return [
        lsp.InlayHint(
            position=lsp.Position(*codec.place(hint.place)),
            label=hint.text,
            kind=lsp.InlayHintKind.Parameter if hint.parameter else lsp.InlayHintKind.Type,
            tooltip=hint.tooltip,
            padding_left=not hint.parameter,
            padding_right=hint.parameter,
        )
        for hint in result
    ]


def symbols(entries: Iterable[Entry], codec: PositionCodec) -> list[lsp.DocumentSymbol]:
    """Return what a program declares."""
    return [
        lsp.DocumentSymbol(
            name=entry.name or "?",
            kind=entry.kind,
            range=span_range(codec, entry.span),
            selection_range=span_range(codec, entry.place),
            detail=entry.detail or None,
            children=symbols(entry.inside, codec) or None,
        )
        for entry in entries
    ]


def folding(folds: Iterable[Fold]) -> list[lsp.FoldingRange]:
    """Return what can be folded away."""
    kinds = {True: lsp.FoldingRangeKind.Comment, False: None}
    return [lsp.FoldingRange(fold.first - 1, fold.last - 1, kind=kinds[fold.comment]) for fold in folds]
