"""What the language server answers: each question of an editor, put to the modules that know."""

from collections.abc import Sequence

from lsprotocol import types as lsp

from armwright.errors import ArmwrightError
from armwright.program.formatter.partial import formatted_around
from armwright.program.language.source import Source
from armwright.program.language.text_edits import Edit, smallest_edit
from armwright.program.language_server import lsp_types
from armwright.program.language_server.code_actions import all_fixes, quickfixes
from armwright.program.language_server.completions import completions
from armwright.program.language_server.hover import hover
from armwright.program.language_server.inlay_hints import hints
from armwright.program.language_server.outline import folds, outline
from armwright.program.language_server.rename import nameable, rename
from armwright.program.language_server.semantic_tokens import KINDS, MODIFIERS, Stretch, difference, encoded
from armwright.program.language_server.server import RloServer, refusal
from armwright.program.language_server.signature_help import signature_at
from armwright.program.language_server.symbol_index import Occurrence

_FIX_ALL = lsp.CodeActionKind.SourceFixAll
# A kind of its own, so that an editor may fix programs when it saves them, and nothing else.
_FIX_ALL_HERE = f"{_FIX_ALL.value}.armwright"
_LEGEND = lsp.SemanticTokensLegend(token_types=list(KINDS), token_modifiers=list(MODIFIERS))


def register(server: RloServer) -> None:
    """Let a server answer."""
    for features in (_position_features, _name_features, _rename_features, _edits, _document_features, _colours):
        features(server)


# ---- at a position -------------------------------------------------------------------------------------------------


def _position_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    async def on_hover(params: lsp.HoverParams) -> lsp.Hover | None:
        document = server.document(params.text_document.uri)
        result = hover(await document.analysis(), lsp_types.offset_of(document.codec, params.position))
        if result is None:
            return None
        markdown = lsp.MarkupKind.Markdown in (server.can("text_document", "hover", "content_format") or ())
        return lsp_types.hover(result, document.codec, markdown=markdown)

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[" ", "(", "=", ","]))
    async def on_completion(params: lsp.CompletionParams) -> lsp.CompletionList:
        document = server.document(params.text_document.uri)
        # Names may be those from before the last words, which are read anew in any case.
        analysis = document.last or await document.analysis()
        result = completions(document.text, analysis, lsp_types.offset_of(document.codec, params.position))
        snippets = bool(server.can("text_document", "completion", "completion_item", "snippet_support"))
        return lsp_types.completion(result, document.codec, snippets=snippets)

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
    async def on_signature(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        document = server.document(params.text_document.uri)
        analysis = document.last or await document.analysis()
        result = signature_at(document.text, analysis, lsp_types.offset_of(document.codec, params.position))
        return None if result is None else lsp_types.signature(result, server.encoding)


# ---- names ---------------------------------------------------------------------------------------------------------


def _name_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    async def on_definition(params: lsp.DefinitionParams) -> lsp.Location | None:
        document = server.document(params.text_document.uri)
        analysis = await document.analysis()
        occurrence = analysis.at(lsp_types.offset_of(document.codec, params.position))
        if occurrence is None:
            return None
        declared = analysis.declaration(occurrence)
        if declared is not None:
            return lsp.Location(document.uri, lsp_types.span_range(document.codec, declared.span))
        if occurrence.key not in analysis.files:
            return None
        uri, line = analysis.files[occurrence.key]
        start = lsp.Position(line - 1, 0)
        return lsp.Location(uri, lsp.Range(start, start))

    async def same(uri: str, position: lsp.Position) -> list[tuple[Occurrence, lsp.Range]]:
        document = server.document(uri)
        analysis = await document.analysis()
        occurrence = analysis.at(lsp_types.offset_of(document.codec, position))
        others = () if occurrence is None else analysis.same(occurrence)
        return [(other, lsp_types.span_range(document.codec, other.span)) for other in others]

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    async def on_references(params: lsp.ReferenceParams) -> list[lsp.Location]:
        uri, declaration = params.text_document.uri, params.context.include_declaration
        result = await same(uri, params.position)
        return [lsp.Location(uri, where) for occurrence, where in result if declaration or not occurrence.declares]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    async def on_highlight(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        write, read = lsp.DocumentHighlightKind.Write, lsp.DocumentHighlightKind.Read
        return [
            lsp.DocumentHighlight(where, write if occurrence.writes or occurrence.declares else read)
            for occurrence, where in await same(params.text_document.uri, params.position)
        ]


def _rename_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    async def on_prepare_rename(params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder:
        document = server.document(params.text_document.uri)
        analysis = await document.analysis()
        try:
            occurrence = nameable(analysis, lsp_types.offset_of(document.codec, params.position))
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        where = lsp_types.span_range(document.codec, occurrence.span)
        return lsp.PrepareRenamePlaceholder(where, document.text[occurrence.start : occurrence.end])

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    async def on_rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        document = server.document(params.text_document.uri)
        analysis = await document.analysis()
        try:
            edits = rename(analysis, lsp_types.offset_of(document.codec, params.position), params.new_name.strip())
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        return lsp.WorkspaceEdit(changes={document.uri: lsp_types.text_edits(document.codec, edits)})


# ---- changes -------------------------------------------------------------------------------------------------------


def _edits(server: RloServer) -> None:
    kinds = [lsp.CodeActionKind.QuickFix, _FIX_ALL_HERE]

    @server.feature(lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=kinds))
    async def on_code_action(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        document = server.document(params.text_document.uri)
        analysis = await document.analysis()
        codec = document.codec
        actions: list[lsp.CodeAction] = []

        def changed(edits: Sequence[Edit]) -> lsp.WorkspaceEdit:
            return lsp.WorkspaceEdit(changes={document.uri: lsp_types.text_edits(codec, edits)})

        def wanted(kind: str) -> bool:
            only = params.context.only
            return only is None or any(f"{kind}.".startswith(f"{_word(prefix)}.") for prefix in only)

        if wanted(_word(lsp.CodeActionKind.QuickFix)):
            published = {(shown.code, _start(shown.range)): shown for shown in params.context.diagnostics}
            for fix in quickfixes(analysis, lsp_types.span_of(codec, params.range)):
                start = _start(lsp_types.span_range(codec, fix.diagnostic.span))
                diagnostic = published.get((fix.diagnostic.code, start))
                actions.append(
                    lsp.CodeAction(
                        title=fix.title,
                        kind=lsp.CodeActionKind.QuickFix,
                        diagnostics=None if diagnostic is None else [diagnostic],
                        is_preferred=bool(fix.diagnostic.fixes),
                        edit=changed(fix.edits),
                    )
                )
        every = all_fixes(analysis.compiled.diagnostics)
        if every and wanted(_FIX_ALL_HERE):
            actions.append(lsp.CodeAction("fix all that is certain", kind=_FIX_ALL_HERE, edit=changed(every)))
        return actions

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def on_formatting(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = server.document(params.text_document.uri)
        before = document.text
        try:
            after = formatted_around(Source(document.name, before), std=server.settings.std)
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        if "\r\n" in before:
            after = after.replace("\n", "\r\n")
        return [] if after == before else lsp_types.text_edits(document.codec, (smallest_edit(before, after),))


def _word(kind: lsp.CodeActionKind | str) -> str:
    return kind.value if isinstance(kind, lsp.CodeActionKind) else kind


def _start(where: lsp.Range) -> tuple[int, int]:
    return where.start.line, where.start.character


# ---- a document ----------------------------------------------------------------------------------------------------


def _document_features(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def on_symbols(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = server.document(params.text_document.uri)
        return lsp_types.symbols(outline(await document.analysis()), document.codec)

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    async def on_folding(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        return lsp_types.folding(folds(await server.document(params.text_document.uri).analysis()))

    @server.feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
    async def on_hints(params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
        document = server.document(params.text_document.uri)
        analysis = await document.analysis()
        result = hints(analysis, lsp_types.span_of(document.codec, params.range))
        return lsp_types.inlay_hints(result, document.codec)


# ---- colours -------------------------------------------------------------------------------------------------------


def _colours(server: RloServer) -> None:
    sent: dict[str, tuple[str, Sequence[list[Stretch]]]] = {}
    number = iter(range(1, 1 << 60))

    def keep(uri: str, lines: Sequence[list[Stretch]]) -> str:
        for closed in set(sent) - set(server.documents):
            del sent[closed]
        sent[uri] = str(next(number)), lines
        return sent[uri][0]

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, _LEGEND)
    async def on_full(params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        uri = params.text_document.uri
        lines = await server.document(uri).stretches()
        return lsp.SemanticTokens(encoded(lines), keep(uri, lines))

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL_DELTA, _LEGEND)
    async def on_delta(params: lsp.SemanticTokensDeltaParams) -> lsp.SemanticTokens | lsp.SemanticTokensDelta:
        uri = params.text_document.uri
        lines = await server.document(uri).stretches()
        before, old = sent.get(uri, ("", ()))
        result = keep(uri, lines)
        if before != params.previous_result_id:
            return lsp.SemanticTokens(encoded(lines), result)
        start, gone, come = difference(old, lines)
        edits = [lsp.SemanticTokensEdit(start, gone, come)] if gone or come else []
        return lsp.SemanticTokensDelta(edits, result)

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, _LEGEND)
    async def on_range(params: lsp.SemanticTokensRangeParams) -> lsp.SemanticTokens:
        first, last = params.range.start.line, params.range.end.line
        return lsp.SemanticTokens(encoded(await server.document(params.text_document.uri).stretches(), first, last))
