"""What the language server answers: each question of an editor, put to the modules that know."""

import itertools
from collections.abc import Sequence

from lsprotocol import types as lsp

from armwright.errors import ArmwrightError
from armwright.program.formatter.partial import formatted_around
from armwright.program.language.source import Source
from armwright.program.language.text_edits import smallest_edit
from armwright.program.language_server.code_actions import FIX_ALL, code_actions
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.language_server.inlay_hints import inlay_hints
from armwright.program.language_server.outline import document_symbols, folding_ranges
from armwright.program.language_server.positions import offset_of, span_range, text_edits
from armwright.program.language_server.rename import rename, renameable_occurrence
from armwright.program.language_server.semantic_tokens import (
    KINDS,
    MODIFIERS,
    SemanticToken,
    encode,
    line_tokens,
    token_edit,
)
from armwright.program.language_server.server import RloServer, request_error
from armwright.program.language_server.signature_help import signature_help
from armwright.program.language_server.symbol_index import Occurrence

_LEGEND = lsp.SemanticTokensLegend(token_types=list(KINDS), token_modifiers=list(MODIFIERS))


def register(server: RloServer) -> None:
    """Let a server answer."""
    for features in (
        _position_features,
        _name_features,
        _rename_features,
        _document_features,
        _semantic_token_features,
    ):
        features(server)


# ---- at a position -------------------------------------------------------------------------------------------------


def _position_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    async def on_hover(params: lsp.HoverParams) -> lsp.Hover | None:
        analysis, offset = await server.locate(params.text_document, params.position)
        markdown = lsp.MarkupKind.Markdown in (
            server.client_capability("text_document", "hover", "content_format") or ()
        )
        return hover(analysis, offset, markdown=markdown)

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[" ", "(", "=", ","]))
    async def on_completion(params: lsp.CompletionParams) -> lsp.CompletionList:
        document = server.document(params.text_document.uri)
        # Names may be those from before the last words, which are read anew in any case.
        analysis = document.last_analysis or await document.analysis()
        snippets = bool(server.client_capability("text_document", "completion", "completion_item", "snippet_support"))
        offset = offset_of(document.codec, params.position)
        items = completions(document.codec, analysis, offset, snippets=snippets)
        return lsp.CompletionList(is_incomplete=False, items=items)

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
    async def on_signature(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        document = server.document(params.text_document.uri)
        analysis = document.last_analysis or await document.analysis()
        return signature_help(document.text, analysis, offset_of(document.codec, params.position))


# ---- names ---------------------------------------------------------------------------------------------------------


def _name_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    async def on_definition(params: lsp.DefinitionParams) -> lsp.Location | None:
        analysis, offset = await server.locate(params.text_document, params.position)
        occurrence = analysis.occurrence_at(offset)
        if occurrence is None:
            return None
        declared = analysis.declaration(occurrence)
        if declared is not None:
            return lsp.Location(params.text_document.uri, span_range(analysis.codec, declared.span))
        if occurrence.key not in analysis.declaration_lines:
            return None
        uri, line = analysis.declaration_lines[occurrence.key]
        start = lsp.Position(line - 1, 0)
        return lsp.Location(uri, lsp.Range(start, start))

    async def same(document: lsp.TextDocumentIdentifier, where: lsp.Position) -> list[tuple[Occurrence, lsp.Range]]:
        analysis, offset = await server.locate(document, where)
        occurrence = analysis.occurrence_at(offset)
        others = () if occurrence is None else analysis.same_occurrences(occurrence)
        return [(other, span_range(analysis.codec, other.span)) for other in others]

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    async def on_references(params: lsp.ReferenceParams) -> list[lsp.Location]:
        uri, declaration = params.text_document.uri, params.context.include_declaration
        result = await same(params.text_document, params.position)
        return [lsp.Location(uri, where) for occurrence, where in result if declaration or not occurrence.declares]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    async def on_highlight(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        write, read = lsp.DocumentHighlightKind.Write, lsp.DocumentHighlightKind.Read
        return [
            lsp.DocumentHighlight(where, write if occurrence.writes or occurrence.declares else read)
            for occurrence, where in await same(params.text_document, params.position)
        ]


def _rename_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    async def on_prepare_rename(params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder:
        analysis, offset = await server.locate(params.text_document, params.position)
        try:
            occurrence = renameable_occurrence(analysis, offset)
        except ArmwrightError as error:
            raise request_error(str(error)) from error
        name = analysis.text[occurrence.start : occurrence.end]
        return lsp.PrepareRenamePlaceholder(span_range(analysis.codec, occurrence.span), name)

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    async def on_rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        analysis, offset = await server.locate(params.text_document, params.position)
        try:
            edits = rename(analysis, offset, params.new_name.strip())
        except ArmwrightError as error:
            raise request_error(str(error)) from error
        return lsp.WorkspaceEdit(changes={params.text_document.uri: text_edits(analysis.codec, edits)})


# ---- a document ----------------------------------------------------------------------------------------------------


def _document_features(server: RloServer) -> None:
    kinds = [lsp.CodeActionKind.QuickFix, FIX_ALL]

    @server.feature(lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=kinds))
    async def on_code_action(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        analysis = await server.analysis(params.text_document)
        return code_actions(analysis, params.text_document.uri, params.range, params.context)

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def on_formatting(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = server.document(params.text_document.uri)
        before = document.text
        try:
            after = formatted_around(Source(document.name, before), std=server.settings.std)
        except ArmwrightError as error:
            raise request_error(str(error)) from error
        if "\r\n" in before:
            after = after.replace("\n", "\r\n")
        return [] if after == before else text_edits(document.codec, (smallest_edit(before, after),))

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def on_symbols(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        return document_symbols(await server.analysis(params.text_document))

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    async def on_folding(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        return folding_ranges(await server.analysis(params.text_document))

    @server.feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
    async def on_hints(params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
        return inlay_hints(await server.analysis(params.text_document), params.range)


# ---- colours -------------------------------------------------------------------------------------------------------


def _semantic_token_features(server: RloServer) -> None:
    sent: dict[str, tuple[str, Sequence[list[SemanticToken]]]] = {}
    numbers = itertools.count(1)

    async def coloured(document: lsp.TextDocumentIdentifier) -> tuple[str, list[list[SemanticToken]]]:
        """Return the coloured lines of a document with the number under which the editor keeps them."""
        lines = line_tokens(await server.analysis(document))
        for closed in set(sent) - set(server.documents):
            del sent[closed]
        sent[document.uri] = str(next(numbers)), lines
        return sent[document.uri][0], lines

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, _LEGEND)
    async def on_full(params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        result, lines = await coloured(params.text_document)
        return lsp.SemanticTokens(encode(lines), result)

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL_DELTA, _LEGEND)
    async def on_delta(params: lsp.SemanticTokensDeltaParams) -> lsp.SemanticTokens | lsp.SemanticTokensDelta:
        before, old = sent.get(params.text_document.uri, ("", ()))
        result, lines = await coloured(params.text_document)
        if before != params.previous_result_id:
            return lsp.SemanticTokens(encode(lines), result)
        start, gone, come = token_edit(old, lines)
        edits = [lsp.SemanticTokensEdit(start, gone, come)] if gone or come else []
        return lsp.SemanticTokensDelta(edits, result)

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, _LEGEND)
    async def on_range(params: lsp.SemanticTokensRangeParams) -> lsp.SemanticTokens:
        lines = line_tokens(await server.analysis(params.text_document))
        return lsp.SemanticTokens(encode(lines, params.range.start.line, params.range.end.line))
