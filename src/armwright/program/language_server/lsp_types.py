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


def span_of(codec: PositionCodec, asked: lsp.Range) -> Span:
    """Return the stretch of text between two places."""
    start = offset_of(codec, asked.start)
    return Span(start, max(start, offset_of(codec, asked.end)))


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
    return [_diagnostic(one, codec, uri, related=related) for one in analysis.compiled.diagnostics]


def _diagnostic(one: Diagnostic, codec: PositionCodec, uri: str, *, related: bool) -> lsp.Diagnostic:
    severity = lsp.DiagnosticSeverity.Error if one.is_error else lsp.DiagnosticSeverity.Warning
    if one.code.startswith("L"):
        severity = lsp.DiagnosticSeverity.Information
    places = [
        lsp.DiagnosticRelatedInformation(lsp.Location(uri, span_range(codec, label.span)), label.text)
        for label in one.secondary
    ]
    return lsp.Diagnostic(
        range=span_range(codec, one.span),
        message=message_of(one),
        severity=severity,
        code=one.code,
        source="armwright",
        tags=[lsp.DiagnosticTag.Unnecessary] if one.code == "L304" else None,
        related_information=places if related and places else None,
    )


def message_of(one: Diagnostic) -> str:
    """Return all words of a diagnostic, a line each."""
    first = f"{one.message}: {one.label}" if one.label and one.label not in one.message else one.message
    return "\n".join((first, *(f"note: {note}" for note in one.notes), *(f"help: {help_}" for help_ in one.helps)))


# ---- at a place ----------------------------------------------------------------------------------------------------


def hover(found: Hover, codec: PositionCodec, *, markdown: bool) -> lsp.Hover:
    """Return what there is to say about a stretch of text."""
    if markdown:
        code = f"```rlo\n{found.code}\n```"
        text = "\n\n".join((code, *found.lines))
        content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    else:
        text = "\n".join((found.code, *found.lines)).replace("`", "")
        content = lsp.MarkupContent(lsp.MarkupKind.PlainText, text)
    return lsp.Hover(content, span_range(codec, found.span))


def completion(found: Sequence[Completion], codec: PositionCodec, *, snippets: bool) -> lsp.CompletionList:
    """Return what can be written; whole statements only for an editor that leads from gap to gap."""
    items = []
    for number, one in enumerate(found):
        if one.sort is Sort.SNIPPET and not snippets:
            continue
        text = one.text if snippets or not one.snippet else one.label
        items.append(
            lsp.CompletionItem(
                label=one.label,
                kind=_ITEMS[one.sort],
                detail=one.detail or None,
                documentation=one.documentation or None,
                sort_text=f"{number:04d}",
                insert_text_format=lsp.InsertTextFormat.Snippet
                if one.snippet and snippets
                else lsp.InsertTextFormat.PlainText,
                text_edit=lsp.TextEdit(span_range(codec, one.span), text),
            )
        )
    return lsp.CompletionList(is_incomplete=False, items=items)


def signature(found: Signature, encoding: str) -> lsp.SignatureHelp:
    """Return what a call takes."""
    codec = PositionCodec(found.label, encoding)
    parameters = [
        lsp.ParameterInformation((codec.width(0, start), codec.width(0, end))) for start, end in found.parameters
    ]
    one = lsp.SignatureInformation(
        label=found.label,
        documentation=found.text or None,
        parameters=parameters,
        active_parameter=found.active if parameters else None,
    )
    return lsp.SignatureHelp([one], 0, found.active if parameters else None)


# ---- of the whole --------------------------------------------------------------------------------------------------


def inlay_hints(found: Iterable[Hint], codec: PositionCodec) -> list[lsp.InlayHint]:
    """Return words between the words of a program."""
    return [
        lsp.InlayHint(
            position=lsp.Position(*codec.place(one.place)),
            label=one.text,
            kind=lsp.InlayHintKind.Parameter if one.parameter else lsp.InlayHintKind.Type,
            tooltip=one.tooltip,
            padding_left=not one.parameter,
            padding_right=one.parameter,
        )
        for one in found
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
