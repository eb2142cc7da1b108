"""What the language server answers: each message of an editor, put to the modules that know."""

import itertools
import os
import sys
from typing import Any, BinaryIO, cast

from lsprotocol import types as lsp

from armwright.errors import ArmwrightError, InvalidValueError
from armwright.files.message_stream import MessageStream
from armwright.program.formatter.partial import formatted_around
from armwright.program.language.source import Source
from armwright.program.language.text_edits import smallest_edit
from armwright.program.language_server.code_actions import FIX_ALL, code_actions
from armwright.program.language_server.completions import completions
from armwright.program.language_server.documents import Document
from armwright.program.language_server.hover import hover
from armwright.program.language_server.inlay_hints import inlay_hints
from armwright.program.language_server.outline import document_symbols, folding_ranges
from armwright.program.language_server.positions import offset_of, span_range, text_edits
from armwright.program.language_server.rename import rename, renameable_occurrence
from armwright.program.language_server.semantic_tokens import KINDS, MODIFIERS, encode, line_tokens, token_edit
from armwright.program.language_server.server import DEFAULT_ENCODING, RloServer, feature, request_error
from armwright.program.language_server.signature_help import signature_help
from armwright.program.language_server.symbol_index import Occurrence

_LEGEND = lsp.SemanticTokensLegend(token_types=list(KINDS), token_modifiers=list(MODIFIERS))
_NUMBERS = itertools.count(1)


# ---- at a position -------------------------------------------------------------------------------------------------


@feature(lsp.TEXT_DOCUMENT_HOVER)
async def _on_hover(server: RloServer, params: lsp.HoverParams) -> lsp.Hover | None:
    analysis, offset = await server.locate(params.text_document, params.position)
    formats = server.client_capability("text_document.hover.content_format") or ()
    return hover(analysis, offset, markdown=lsp.MarkupKind.Markdown in formats)


@feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[" ", "(", "=", ","]))
async def _on_completion(server: RloServer, params: lsp.CompletionParams) -> lsp.CompletionList:
    document = server.document(params.text_document.uri)
    # Names may come from an earlier analysis; the words around the cursor are parsed again in any case.
    analysis = document.last_analysis or await document.analysis()
    snippets = bool(server.client_capability("text_document.completion.completion_item.snippet_support"))
    offset = offset_of(document.codec, params.position)
    items = completions(document.codec, analysis, offset, snippets=snippets)
    return lsp.CompletionList(is_incomplete=False, items=items)


@feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
async def _on_signature(server: RloServer, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    document = server.document(params.text_document.uri)
    analysis = document.last_analysis or await document.analysis()
    return signature_help(document.text, analysis, offset_of(document.codec, params.position))


# ---- names ---------------------------------------------------------------------------------------------------------


@feature(lsp.TEXT_DOCUMENT_DEFINITION)
async def _on_definition(server: RloServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    analysis, offset = await server.locate(params.text_document, params.position)
    occurrence = analysis.occurrence_at(offset)
    if occurrence is None:
        return None
    declared = analysis.declaration(occurrence)
    if declared is not None:
        return analysis.location(params.text_document.uri, declared.span)
    if occurrence.key not in analysis.declaration_lines:
        return None
    uri, line = analysis.declaration_lines[occurrence.key]
    start = lsp.Position(line - 1, 0)
    return lsp.Location(uri, lsp.Range(start, start))


async def _same_occurrences(
    server: RloServer, params: lsp.ReferenceParams | lsp.DocumentHighlightParams
) -> list[tuple[Occurrence, lsp.Range]]:
    """Return all occurrences of what stands at a position, with their ranges."""
    analysis, offset = await server.locate(params.text_document, params.position)
    occurrence = analysis.occurrence_at(offset)
    others = () if occurrence is None else analysis.same_occurrences(occurrence)
    return [(other, span_range(analysis.codec, other.span)) for other in others]


@feature(lsp.TEXT_DOCUMENT_REFERENCES)
async def _on_references(server: RloServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    uri, declaration = params.text_document.uri, params.context.include_declaration
    result = await _same_occurrences(server, params)
    return [lsp.Location(uri, where) for occurrence, where in result if declaration or not occurrence.declares]


@feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
async def _on_highlight(server: RloServer, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
    write, read = lsp.DocumentHighlightKind.Write, lsp.DocumentHighlightKind.Read
    return [
        lsp.DocumentHighlight(where, write if occurrence.writes or occurrence.declares else read)
        for occurrence, where in await _same_occurrences(server, params)
    ]


@feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
async def _on_prepare_rename(server: RloServer, params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder:
    analysis, offset = await server.locate(params.text_document, params.position)
    try:
        occurrence = renameable_occurrence(analysis, offset)
    except ArmwrightError as error:
        raise request_error(str(error)) from error
    name = analysis.text[occurrence.start : occurrence.end]
    return lsp.PrepareRenamePlaceholder(span_range(analysis.codec, occurrence.span), name)


@feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
async def _on_rename(server: RloServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    analysis, offset = await server.locate(params.text_document, params.position)
    try:
        edits = rename(analysis, offset, params.new_name.strip())
    except ArmwrightError as error:
        raise request_error(str(error)) from error
    return lsp.WorkspaceEdit(changes={params.text_document.uri: text_edits(analysis.codec, edits)})


# ---- a document ----------------------------------------------------------------------------------------------------


@feature(lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix, FIX_ALL]))
async def _on_code_action(server: RloServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    analysis = await server.analysis(params.text_document)
    return code_actions(analysis, params.text_document.uri, params.range, params.context)


@feature(lsp.TEXT_DOCUMENT_FORMATTING)
def _on_formatting(server: RloServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
    document = server.document(params.text_document.uri)
    before = document.text
    try:
        after = formatted_around(Source(document.name, before), std=server.settings.std)
    except ArmwrightError as error:
        raise request_error(str(error)) from error
    if "\r\n" in before:
        after = after.replace("\n", "\r\n")
    return [] if after == before else text_edits(document.codec, (smallest_edit(before, after),))


@feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
async def _on_symbols(server: RloServer, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
    return document_symbols(await server.analysis(params.text_document))


@feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
async def _on_folding(server: RloServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
    return folding_ranges(await server.analysis(params.text_document))


@feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
async def _on_hints(server: RloServer, params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
    return inlay_hints(await server.analysis(params.text_document), params.range)


# ---- semantic tokens ------------------------------------------------------------------------------------------------


@feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, _LEGEND)
async def _on_full(
    server: RloServer, params: lsp.SemanticTokensParams | lsp.SemanticTokensDeltaParams
) -> lsp.SemanticTokens:
    document = server.document(params.text_document.uri)
    lines = line_tokens(await document.analysis())
    # The number under which the editor keeps them.
    document.sent_tokens = str(next(_NUMBERS)), lines
    return lsp.SemanticTokens(encode(lines), document.sent_tokens[0])


@feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL_DELTA, _LEGEND)
async def _on_delta(
    server: RloServer, params: lsp.SemanticTokensDeltaParams
) -> lsp.SemanticTokens | lsp.SemanticTokensDelta:
    document = server.document(params.text_document.uri)
    number, old = document.sent_tokens
    full = await _on_full(server, params)
    if number != params.previous_result_id:
        return full
    start, deleted, inserted = token_edit(old, document.sent_tokens[1])
    edits = [lsp.SemanticTokensEdit(start, deleted, inserted)] if deleted or inserted else []
    return lsp.SemanticTokensDelta(edits, full.result_id)


@feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, _LEGEND)
async def _on_range(server: RloServer, params: lsp.SemanticTokensRangeParams) -> lsp.SemanticTokens:
    lines = line_tokens(await server.analysis(params.text_document))
    return lsp.SemanticTokens(encode(lines, params.range.start.line, params.range.end.line))


# ---- the beginning and the end -------------------------------------------------------------------------------------


@feature(lsp.INITIALIZE)
def _initialize(server: RloServer, params: lsp.InitializeParams) -> None:
    encoding = server.workspace.position_encoding or DEFAULT_ENCODING
    server.encoding = encoding.value if isinstance(encoding, lsp.PositionEncodingKind) else encoding
    server.apply_settings(params.initialization_options)


@feature(lsp.INITIALIZED)
async def _initialized(server: RloServer, _: lsp.InitializedParams) -> None:
    await server.register_watchers()
    await server.request_settings()


@feature(lsp.EXIT)
def _exited(server: RloServer, _: Any) -> None:
    server.has_exited = True


# ---- documents -----------------------------------------------------------------------------------------------------


@feature(lsp.TEXT_DOCUMENT_DID_OPEN)
async def _did_open(server: RloServer, params: lsp.DidOpenTextDocumentParams) -> None:
    if (before := server.documents.get(params.text_document.uri)) is not None:
        before.close()
    server.documents[params.text_document.uri] = Document(server, params.text_document)


@feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
def _did_change(server: RloServer, params: lsp.DidChangeTextDocumentParams) -> None:
    if (document := server.documents.get(params.text_document.uri)) is not None:
        document.change(params.content_changes, params.text_document.version)


@feature(lsp.TEXT_DOCUMENT_DID_SAVE)
def _did_save(server: RloServer, params: lsp.DidSaveTextDocumentParams) -> None:
    # Others may depend on what has been saved beside them.
    server.invalidate()
    if (document := server.documents.get(params.text_document.uri)) is not None:
        document.publish()


@feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
def _did_close(server: RloServer, params: lsp.DidCloseTextDocumentParams) -> None:
    if (document := server.documents.pop(params.text_document.uri, None)) is not None:
        document.close()
        server.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri=document.uri, diagnostics=[]))


# ---- settings and files --------------------------------------------------------------------------------------------


@feature(lsp.WORKSPACE_DID_CHANGE_CONFIGURATION)
async def _did_change_configuration(server: RloServer, params: lsp.DidChangeConfigurationParams) -> None:
    if server.client_capability("workspace.configuration"):
        await server.request_settings()
    else:
        server.apply_settings(params.settings)


@feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
def _did_change_watched_files(server: RloServer, _: lsp.DidChangeWatchedFilesParams) -> None:
    server.invalidate()


# ---- the connection ------------------------------------------------------------------------------------------------


def serve() -> int:
    """Serve an editor over standard input and output until it ends the session.

    Returns:
        The exit status. The thread that reads the input may still run.

    Raises:
        InvalidValueError: it sent a message that is larger than the limit; the connection is over.
    """
    incoming = MessageStream(sys.stdin.buffer)
    # Of its own: the protocol closes it at its end, and whatever else is printed must not get into it.
    outgoing = os.fdopen(os.dup(1), "wb")
    sys.stdout = sys.stderr
    server = RloServer()
    server.start_io(cast("BinaryIO", incoming), outgoing)
    if incoming.refused:
        raise InvalidValueError(f"{incoming.refused}; the connection has ended")
    return server.status
