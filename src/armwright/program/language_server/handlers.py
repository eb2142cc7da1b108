"""What the language server answers: each question of an editor, put to the modules that know."""

from collections.abc import Sequence

from lsprotocol import types as lsp

from armwright.errors import ArmwrightError
from armwright.program.formatter.partial import formatted_around
from armwright.program.language.source import Source, Span
from armwright.program.language.text_edits import Edit
from armwright.program.language_server import lsp_types
from armwright.program.language_server.code_actions import all_fixes, quickfixes
from armwright.program.language_server.completions import completions
from armwright.program.language_server.edit_map import drift
from armwright.program.language_server.hover import hover
from armwright.program.language_server.inlay_hints import hints
from armwright.program.language_server.outline import folds, outline
from armwright.program.language_server.rename import nameable, rename
from armwright.program.language_server.semantic_tokens import KINDS, MODIFIERS, Stretch, difference, encoded, patched
from armwright.program.language_server.server import RloServer, refusal
from armwright.program.language_server.signature_help import signature_at
from armwright.program.language_server.symbol_index import Occurrence

_FIX_ALL = lsp.CodeActionKind.SourceFixAll
# A kind of its own, so that an editor may fix programs when it saves them, and nothing else.
_FIX_ALL_HERE = f"{_FIX_ALL.value}.armwright"
_LEGEND = lsp.SemanticTokensLegend(token_types=list(KINDS), token_modifiers=list(MODIFIERS))


def register(server: RloServer) -> None:
    """Let a server answer."""
    _at_a_place(server)
    _of_names(server)
    _renames(server)
    _changes(server)
    _of_the_whole(server)
    _colours(server)


# ---- at a place ----------------------------------------------------------------------------------------------------


def _at_a_place(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    async def on_hover(params: lsp.HoverParams) -> lsp.Hover | None:
        document = server.document(params.text_document.uri)
        known, view = await document.known()
        place = view.old(lsp_types.offset_of(document.ruler, params.position))
        found = None if place is None else hover(known.analysis, place)
        span = None if found is None else view.span(found.span)
        if found is None or span is None:
            return None
        markdown = lsp.MarkupKind.Markdown in (server.can("text_document", "hover", "content_format") or ())
        return lsp_types.hover(found, document.ruler, span, markdown=markdown)

    @server.feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[" ", "(", "=", ","]))
    async def on_completion(params: lsp.CompletionParams) -> lsp.CompletionList:
        document = server.document(params.text_document.uri)
        _, view = await document.known()
        found = completions(view, lsp_types.offset_of(document.ruler, params.position))
        snippets = bool(server.can("text_document", "completion", "completion_item", "snippet_support"))
        return lsp_types.completion(found, document.ruler, snippets=snippets)

    @server.feature(lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","]))
    async def on_signature(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        document = server.document(params.text_document.uri)
        _, view = await document.known()
        found = signature_at(view, lsp_types.offset_of(document.ruler, params.position))
        return None if found is None else lsp_types.signature(found, server.office.encoding)


# ---- names ---------------------------------------------------------------------------------------------------------


def _of_names(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    async def on_definition(params: lsp.DefinitionParams) -> lsp.Location | None:
        document = server.document(params.text_document.uri)
        known, view = await document.known()
        place = view.old(lsp_types.offset_of(document.ruler, params.position))
        one = None if place is None else known.analysis.at(place)
        if one is None:
            return None
        declared = known.analysis.declaration(one)
        if declared is not None:
            span = view.span(declared.span)
            return None if span is None else lsp.Location(document.uri, lsp_types.span_range(document.ruler, span))
        if one.key not in known.analysis.files:
            return None
        uri, line = known.analysis.files[one.key]
        start = lsp.Position(line - 1, 0)
        return lsp.Location(uri, lsp.Range(start, start))

    async def same(uri: str, position: lsp.Position) -> list[tuple[Occurrence, lsp.Range]]:
        document = server.document(uri)
        known, view = await document.known()
        place = view.old(lsp_types.offset_of(document.ruler, position))
        one = None if place is None else known.analysis.at(place)
        others = () if one is None else known.analysis.same(one)
        spans = ((other, view.span(other.span)) for other in others)
        return [(other, lsp_types.span_range(document.ruler, span)) for other, span in spans if span is not None]

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    async def on_references(params: lsp.ReferenceParams) -> list[lsp.Location]:
        uri, declaration = params.text_document.uri, params.context.include_declaration
        found = await same(uri, params.position)
        return [lsp.Location(uri, where) for one, where in found if declaration or not one.declares]

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    async def on_highlight(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        write, read = lsp.DocumentHighlightKind.Write, lsp.DocumentHighlightKind.Read
        return [
            lsp.DocumentHighlight(where, write if one.writes or one.declares else read)
            for one, where in await same(params.text_document.uri, params.position)
        ]


def _renames(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    async def on_prepare_rename(params: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder:
        document = server.document(params.text_document.uri)
        known, _ = await document.known(exact=True)
        try:
            one = nameable(known.analysis, lsp_types.offset_of(document.ruler, params.position))
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        where = lsp_types.span_range(document.ruler, one.span)
        return lsp.PrepareRenamePlaceholder(where, document.text[one.start : one.end])

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    async def on_rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        document = server.document(params.text_document.uri)
        known, _ = await document.known(exact=True)
        try:
            edits = rename(
                known.analysis, lsp_types.offset_of(document.ruler, params.position), params.new_name.strip()
            )
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        return lsp.WorkspaceEdit(changes={document.uri: lsp_types.text_edits(document.ruler, edits)})


# ---- changes -------------------------------------------------------------------------------------------------------


def _changes(server: RloServer) -> None:
    kinds = [lsp.CodeActionKind.QuickFix, _FIX_ALL_HERE]

    @server.feature(lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions(code_action_kinds=kinds))
    async def on_code_action(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        document = server.document(params.text_document.uri)
        known, _ = await document.known(exact=True)
        ruler, uri = document.ruler, document.uri
        actions: list[lsp.CodeAction] = []

        def wanted(kind: str) -> bool:
            asked = params.context.only
            return asked is None or any(kind == one or kind.startswith(f"{one}.") for one in map(_word, asked))

        if wanted(_word(lsp.CodeActionKind.QuickFix)):
            told = {(one.code, _place(one.range)): one for one in params.context.diagnostics}
            for one in quickfixes(known.analysis, lsp_types.span_of(ruler, params.range)):
                diagnostic = told.get((one.diagnostic.code, _place(lsp_types.span_range(ruler, one.diagnostic.span))))
                actions.append(
                    lsp.CodeAction(
                        title=one.title,
                        kind=lsp.CodeActionKind.QuickFix,
                        diagnostics=None if diagnostic is None else [diagnostic],
                        is_preferred=bool(one.diagnostic.fixes),
                        edit=lsp.WorkspaceEdit(changes={uri: lsp_types.text_edits(ruler, one.edits)}),
                    )
                )
        every = all_fixes(known.analysis.compiled.diagnostics)
        if every and wanted(_FIX_ALL_HERE):
            edit = lsp.WorkspaceEdit(changes={uri: lsp_types.text_edits(ruler, every)})
            actions.append(lsp.CodeAction(title="fix all that is certain", kind=_FIX_ALL_HERE, edit=edit))
        return actions

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def on_formatting(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        document = server.document(params.text_document.uri)
        before = document.text
        try:
            after = formatted_around(Source(document.name, before), std=server.office.settings.std)
        except ArmwrightError as error:
            raise refusal(str(error)) from error
        if "\r\n" in before:
            after = after.replace("\n", "\r\n")
        change = drift(before, after)
        if change.none:
            return []
        edit = Edit(Span(change.start, change.old_end), after[change.start : change.new_end])
        return lsp_types.text_edits(document.ruler, (edit,))


def _word(kind: lsp.CodeActionKind | str) -> str:
    return kind.value if isinstance(kind, lsp.CodeActionKind) else kind


def _place(where: lsp.Range) -> tuple[int, int]:
    return where.start.line, where.start.character


# ---- the whole -----------------------------------------------------------------------------------------------------


def _of_the_whole(server: RloServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    async def on_symbols(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        document = server.document(params.text_document.uri)
        known, view = await document.known()
        return lsp_types.symbols(outline(known.analysis), view, document.ruler)

    @server.feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    async def on_folding(params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        document = server.document(params.text_document.uri)
        known, view = await document.known()
        return lsp_types.folding(folds(known.analysis), len(document.ruler.starts) - 1) if view.fresh else []

    @server.feature(lsp.TEXT_DOCUMENT_INLAY_HINT)
    async def on_hints(params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
        document = server.document(params.text_document.uri)
        known, view = await document.known()
        if not view.fresh:
            server.guessed()
        asked = lsp_types.span_of(document.ruler, params.range)
        start, end = view.old(asked.start), view.old(asked.end)
        # A place that was not there before stands for the change it lies in.
        old = Span(view.drift.start if start is None else start, view.drift.old_end if end is None else end)
        return lsp_types.inlay_hints(hints(known.analysis, old), view, document.ruler)


# ---- colours -------------------------------------------------------------------------------------------------------


def _colours(server: RloServer) -> None:
    sent: dict[str, tuple[str, Sequence[list[Stretch]]]] = {}
    number = iter(range(1, 1 << 60))

    async def stretches(uri: str) -> Sequence[list[Stretch]]:
        known, view = await server.document(uri).known()
        if not view.fresh:
            server.guessed()
        return patched(view, known.stretches, server.office.encoding)

    def keep(uri: str, lines: Sequence[list[Stretch]]) -> str:
        for closed in set(sent) - set(server.documents):
            del sent[closed]
        sent[uri] = str(next(number)), lines
        return sent[uri][0]

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, _LEGEND)
    async def on_full(params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        uri = params.text_document.uri
        lines = await stretches(uri)
        return lsp.SemanticTokens(encoded(lines), keep(uri, lines))

    @server.feature(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL_DELTA, _LEGEND)
    async def on_delta(params: lsp.SemanticTokensDeltaParams) -> lsp.SemanticTokens | lsp.SemanticTokensDelta:
        uri = params.text_document.uri
        lines = await stretches(uri)
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
        return lsp.SemanticTokens(encoded(await stretches(params.text_document.uri), first, last))
