"""What is known of a program in the words of the Language Server Protocol."""

from collections.abc import Iterable, Sequence

from lsprotocol import types as lsp

from armwright.program.language.diagnostic import Diagnostic
from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import Edit
from armwright.program.language_server.analysis import Analysis
from armwright.program.language_server.completions import Completion, Sort
from armwright.program.language_server.hover import Hover
from armwright.program.language_server.inlay_hints import Hint
from armwright.program.language_server.outline import Entry, Fold, Part
from armwright.program.language_server.signature_help import Signature

_ITEMS = {
    Sort.WORD: lsp.CompletionItemKind.Keyword,
    Sort.SNIPPET: lsp.CompletionItemKind.Snippet,
    Sort.TYPE: lsp.CompletionItemKind.TypeParameter,
    Sort.VARIABLE: lsp.CompletionItemKind.Variable,
    Sort.FRAME: lsp.CompletionItemKind.Struct,
    Sort.EVENT: lsp.CompletionItemKind.Event,
    Sort.ARM: lsp.CompletionItemKind.Constant,
    Sort.DEVICE: lsp.CompletionItemKind.Property,
    Sort.PROCEDURE: lsp.CompletionItemKind.Function,
    Sort.FUNCTION: lsp.CompletionItemKind.Function,
}
_SYMBOLS = {
    Part.PROCEDURE: lsp.SymbolKind.Function,
    Part.PARAMETER: lsp.SymbolKind.Variable,
    Part.VARIABLE: lsp.SymbolKind.Variable,
    Part.ARRAY: lsp.SymbolKind.Array,
    Part.FRAME: lsp.SymbolKind.Struct,
    Part.EVENT: lsp.SymbolKind.Event,
}


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
    first = (
        f"{diagnostic.message}: {diagnostic.label}"
        if diagnostic.label and diagnostic.label not in diagnostic.message
        else diagnostic.message
    )
    return "\n".join(
        (first, *(f"note: {note}" for note in diagnostic.notes), *(f"help: {help_}" for help_ in diagnostic.helps))
    )


# ---- at a place ----------------------------------------------------------------------------------------------------


def hover(result: Hover, codec: PositionCodec, *, markdown: bool) -> lsp.Hover:
    """Return what there is to say about a stretch of text."""
    if markdown:
        code = f"```rlo\n{result.code}\n```"
        text = "\n\n".join((code, *result.lines))
        content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    else:
        text = "\n".join((result.code, *result.lines)).replace("`", "")
        content = lsp.MarkupContent(lsp.MarkupKind.PlainText, text)
    return lsp.Hover(content, span_range(codec, result.span))


def completion(result: Sequence[Completion], codec: PositionCodec, *, snippets: bool) -> lsp.CompletionList:
    """Return what can be written; whole statements only for an editor that leads from gap to gap."""
    items = []
    for number, diagnostic in enumerate(result):
        if diagnostic.sort is Sort.SNIPPET and not snippets:
            continue
        text = diagnostic.text if snippets or not diagnostic.snippet else diagnostic.label
        items.append(
            lsp.CompletionItem(
                label=diagnostic.label,
                kind=_ITEMS[diagnostic.sort],
                detail=diagnostic.detail or None,
                documentation=diagnostic.documentation or None,
                sort_text=f"{number:04d}",
                insert_text_format=lsp.InsertTextFormat.Snippet
                if diagnostic.snippet and snippets
                else lsp.InsertTextFormat.PlainText,
                text_edit=lsp.TextEdit(span_range(codec, diagnostic.span), text),
            )
        )
    return lsp.CompletionList(is_incomplete=False, items=items)


def signature(result: Signature, encoding: str) -> lsp.SignatureHelp:
    """Return what a call takes."""
    codec = PositionCodec(result.label, encoding)
    parameters = [
        lsp.ParameterInformation((codec.width(0, start), codec.width(0, end))) for start, end in result.parameters
    ]
    diagnostic = lsp.SignatureInformation(
        label=result.label,
        documentation=result.text or None,
        parameters=parameters,
        active_parameter=result.active if parameters else None,
    )
    return lsp.SignatureHelp([diagnostic], 0, result.active if parameters else None)


# ---- of the whole --------------------------------------------------------------------------------------------------


def inlay_hints(result: Iterable[Hint], codec: PositionCodec) -> list[lsp.InlayHint]:
    """Return words between the words of a program."""
    return [
        lsp.InlayHint(
            position=lsp.Position(*codec.place(diagnostic.place)),
            label=diagnostic.text,
            kind=lsp.InlayHintKind.Parameter if diagnostic.parameter else lsp.InlayHintKind.Type,
            tooltip=diagnostic.tooltip,
            padding_left=not diagnostic.parameter,
            padding_right=diagnostic.parameter,
        )
        for diagnostic in result
    ]


def symbols(entries: Iterable[Entry], codec: PositionCodec) -> list[lsp.DocumentSymbol]:
    """Return what a program declares."""
    return [
        lsp.DocumentSymbol(
            name=entry.name or "?",
            kind=_SYMBOLS[entry.part],
            range=span_range(codec, entry.span),
            selection_range=span_range(codec, entry.place),
            detail=entry.detail or None,
            children=symbols(entry.inside, codec) or None,
        )
        for entry in entries
    ]


def folding(folds: Iterable[Fold]) -> list[lsp.FoldingRange]:
    """Return what can be folded away."""
    return [
        lsp.FoldingRange(fold.first - 1, fold.last - 1, kind=lsp.FoldingRangeKind.Comment if fold.comment else None)
        for fold in folds
    ]
