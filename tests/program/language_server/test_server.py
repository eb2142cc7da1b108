"""The language server, as an editor talks to it."""

import asyncio
import json
import logging
import socket
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import BinaryIO, cast

import pytest
import pytest_lsp
from lsprotocol import types as lsp
from pygls.client import JsonRPCClient
from pygls.exceptions import JsonRpcException
from pygls.io_ import run_async
from pytest_lsp import ClientServerConfig, LanguageClient, client_capabilities

from armwright.files.message_stream import MessageStream
from armwright.program.language_server.handlers import RloServer
from armwright.program.language_server.semantic_tokens import KINDS, MODIFIERS

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

CELL = """
name = "bench"
[arms.ARM_1]
model = "stanford"
hand = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.45, 0.00, 0.25]
[frames]
STATION = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0.45, 0, 0]
stop = [1, 0, 0,  0,-1, 0,  0, 0,-1,   0.45, 0, 0.25]
CUP = { on = "STATION", at = [1, 0, 0,  0, 1, 0,  0, 0, 1,   0, 0.1, 0] }
[visions]
PART = [[1, 0, 0,  0,-1, 0,  0, 0,-1,   0.40, 0.15, 0.05]]
[devices]
LAMP = {}
"""
PROGRAM = """UNITS MM ;
VAR part, above, cup, stop : FRAME ;
    n : SCALAR ;
PROCEDURE put (thing, place : FRAME, pace : SCALAR) ;
VAR n : SCALAR ;
BEGIN
  n = pace ;
  MOVE ARM_1 TO thing STRAIGHTLY, WITH SPEED = n ;
  AFFIX thing TO ARM_1 ;
  MOVE thing TO place ;
END ;
BEGIN
  READ VISIONS (part) ;
  above = part * XYZ(0, 0, -10cm) ;
  n = 50 ;
  MOVE ARM_1 TO part WITH APPROACH = above, WITH SPEED = n ;
  GRASP ;
  put (part, cup, 90) ;
  MOVE ARM_1 TO stop ;
END.
"""


def position(text: str, word: str, nth: int = 0, *, behind: bool = False) -> lsp.Position:
    """Return where a word stands, as an editor counts: halves of words of 32 bits in a line."""
    at = -1
    for _ in range(nth + 1):
        at = text.index(word, at + 1)
    at += len(word) * behind
    before = text[:at].replace("\r\n", "\n").split("\n")
    return lsp.Position(len(before) - 1, len(before[-1].encode("utf-16-le")) // 2)


def between(text: str, start: str, end: str) -> lsp.Range:
    """Return the range from the start of one word to the end of another."""
    return lsp.Range(position(text, start), position(text, end, behind=True))


def applied(text: str, edits: Sequence[lsp.TextEdit]) -> str:
    """Return a text with changes made, as an editor that counts in UTF-16 makes them."""
    lines = text.split("\n")
    places = []
    for edit in edits:
        ends = []
        for where in (edit.range.start, edit.range.end):
            line = lines[where.line].encode("utf-16-le")[: 2 * where.character].decode("utf-16-le")
            ends.append(sum(len(above) + 1 for above in lines[: where.line]) + len(line))
        places.append((*ends, edit.new_text))
    for start, end, new in sorted(places, reverse=True):
        text = text[:start] + new + text[end:]
    return text


class Editor:
    """An editor with one program open."""

    def __init__(self, client: LanguageClient, folder: Path) -> None:
        self.client, self.folder = client, folder
        self.uri = (folder / "test.rlo").as_uri()
        self.document = lsp.TextDocumentIdentifier(self.uri)
        self.version = 0
        self.text = ""

    async def open(self, text: str) -> list[lsp.Diagnostic]:
        """Open a program and wait for what is said of it."""
        self.text = text
        self.client.text_document_did_open(
            lsp.DidOpenTextDocumentParams(lsp.TextDocumentItem(self.uri, "rlo", self.version, text))
        )
        return await self.told()

    async def told(self) -> list[lsp.Diagnostic]:
        """Wait for what is said of the text as it is now."""
        for _ in range(1000):
            if self.version in self.client.published:
                return list(self.client.diagnostics.get(self.uri, ()))
            await asyncio.sleep(0.02)
        raise AssertionError(f"nothing was said of version {self.version}")

    def change(self, where: lsp.Range, new: str) -> None:
        """Change a stretch of the text."""
        self.version += 1
        self.text = applied(self.text, [lsp.TextEdit(where, new)])
        self.client.text_document_did_change(
            lsp.DidChangeTextDocumentParams(
                lsp.VersionedTextDocumentIdentifier(self.version, self.uri),
                [lsp.TextDocumentContentChangePartial(where, new)],
            )
        )

    async def hover(self, word: str, nth: int = 0) -> str:
        """Return what there is to say about a word; nothing where there is nothing."""
        found = await self.client.text_document_hover_async(
            lsp.HoverParams(self.document, position(self.text, word, nth))
        )
        if found is None:
            return ""
        assert isinstance(found.contents, lsp.MarkupContent)
        return found.contents.value

    async def labels(self, where: lsp.Position) -> list[str]:
        """Return what can be written at a place."""
        found = await self.client.text_document_completion_async(lsp.CompletionParams(self.document, where))
        assert isinstance(found, lsp.CompletionList)
        return [one.label for one in found.items]

    async def actions(self, where: lsp.Range, *kinds: str) -> list[lsp.CodeAction]:
        """Return the changes that are offered for a stretch of text."""
        context = lsp.CodeActionContext(self.client.diagnostics.get(self.uri, ()), only=list(kinds) or None)
        found = await self.client.text_document_code_action_async(lsp.CodeActionParams(self.document, where, context))
        return [one for one in found or () if isinstance(one, lsp.CodeAction)]

    async def rename(self, word: str, new: str, nth: int = 0) -> str:
        """Return the text with a name changed."""
        found = await self.client.text_document_rename_async(
            lsp.RenameParams(self.document, position(self.text, word, nth), new)
        )
        assert found is not None
        assert found.changes is not None
        return applied(self.text, found.changes[self.uri])


class InThisProcess(ClientServerConfig):
    """A server in a thread of this process, connected by a pair of sockets: starting one takes no time."""

    async def start(self, devtools: str | None = None) -> JsonRPCClient:
        """Start the server and return a client that is connected to it."""
        del devtools
        client = self.client_factory()
        ours, theirs = socket.socketpair()
        threading.Thread(target=self._serve, args=(theirs,), daemon=True).start()
        reader, writer = await asyncio.open_connection(sock=ours)
        client.protocol.set_writer(writer)
        conversation = run_async(
            stop_event=client._stop_event,
            reader=reader,
            protocol=client.protocol,
            logger=logging.getLogger(__name__),
            error_handler=client.report_server_error,
        )
        client._async_tasks.append(asyncio.create_task(conversation))
        return client

    @staticmethod
    def _serve(connection: socket.socket) -> None:
        with connection, connection.makefile("rb") as incoming, connection.makefile("wb") as outgoing:
            RloServer().start_io(cast("BinaryIO", MessageStream(incoming)), outgoing)


@pytest_lsp.fixture(config=InThisProcess(server_command=[]))
async def client(lsp_client: LanguageClient, tmp_path: Path) -> AsyncIterator[None]:
    """Greet the server from a folder with a cell; say goodbye at the end."""
    (tmp_path / "bench.toml").write_text(CELL)
    lsp_client.published = []
    lsp_client.registered = []
    lsp_client.protocol.fm.features.pop(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)

    @lsp_client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    def publish(client: LanguageClient, params: lsp.PublishDiagnosticsParams) -> None:
        client.diagnostics[params.uri] = params.diagnostics
        client.published.append(params.version)

    @lsp_client.feature(lsp.CLIENT_REGISTER_CAPABILITY)
    def register(client: LanguageClient, params: lsp.RegistrationParams) -> None:
        client.registered += [one.method for one in params.registrations]

    for refresh in (lsp.WORKSPACE_SEMANTIC_TOKENS_REFRESH, lsp.WORKSPACE_INLAY_HINT_REFRESH):
        lsp_client.feature(refresh)(lambda *_: None)

    await lsp_client.initialize_session(
        lsp.InitializeParams(
            capabilities=client_capabilities("visual-studio-code"),
            workspace_folders=[lsp.WorkspaceFolder(tmp_path.as_uri(), "test")],
        )
    )
    yield
    await lsp_client.shutdown_session()


@pytest.fixture
def editor(client: LanguageClient, tmp_path: Path) -> Editor:
    """Return an editor that has greeted the server."""
    return Editor(client, tmp_path)


@pytest.mark.asyncio
async def test_what_is_wrong(editor: Editor) -> None:
    """Errors come with codes, advice and the other places that matter; they go when the text is put right."""
    text = "VAR f : FRAME ;\n    f : TRANS ;\nBEGIN\n  READ VISIONS (f)\n  MOVE ARM_1 TO g ;\nEND.\n"
    found = {str(one.code): one for one in await editor.open(text)}

    assert set(found) == {"E104", "E202", "E203"}
    assert found["E203"].related_information is not None
    assert found["E203"].related_information[0].location.range.start == lsp.Position(0, 4)
    assert found["E202"].range == between(text, "g ;", "g")
    assert found["E202"].severity is lsp.DiagnosticSeverity.Error
    assert "help: " in found["E202"].message

    editor.change(between(text, "f : TRANS", "f : TRANS"), "g : FRAME")
    where = position(editor.text, "(f)", behind=True)
    editor.change(lsp.Range(where, where), " ;")
    assert {str(one.code) for one in await editor.told() if one.severity is lsp.DiagnosticSeverity.Error} == {"E304"}


@pytest.mark.asyncio
async def test_hover(editor: Editor) -> None:
    """A name tells its type and declaration, a frame its place in the only cell beside the program."""
    await editor.open(PROGRAM)

    cup = await editor.hover("cup")
    assert "cup : FRAME" in cup
    assert "declared in line 2" in cup
    assert "attached to STATION in bench" in cup
    assert "relative to STATION: `(1,0,0, 0,1,0, 0,0,1, 0,100,0)` mm" in cup
    assert "in the world: `(1,0,0, 0,1,0, 0,0,1, 450,100,0)` mm" in cup
    assert "parameter of `put`" in await editor.hover("thing STR")
    assert "stanford in bench" in await editor.hover("ARM_1")
    assert "n : SCALAR\n```\n\nvariable of `put`" in await editor.hover("n = pace")
    assert "PROCEDURE put (thing, place : FRAME, pace : SCALAR)" in await editor.hover("put (part")
    assert "10cm = 100 mm" in await editor.hover("10cm")
    assert "WITH APPROACH = pose" in await editor.hover("APPROACH")
    assert "XYZ (x, y, z) : TRANS" in await editor.hover("XYZ")
    assert await editor.hover(";") == ""


@pytest.mark.asyncio
async def test_cell_that_changes(editor: Editor) -> None:
    """A cell file that was changed on the disk is read again."""
    await editor.open(PROGRAM)
    (editor.folder / "bench.toml").write_text(CELL.replace("0, 0.1, 0]", "0, 0.25, 0]"))
    uri = (editor.folder / "bench.toml").as_uri()
    editor.client.published.clear()
    editor.client.workspace_did_change_watched_files(
        lsp.DidChangeWatchedFilesParams([lsp.FileEvent(uri, lsp.FileChangeType.Changed)])
    )

    await editor.told()
    assert "450,250,0" in await editor.hover("cup")


@pytest.mark.asyncio
async def test_settings(editor: Editor) -> None:
    """The settings name the cell and the language; a cell that is missing is told."""
    (editor.folder / "other").mkdir()
    (editor.folder / "other" / "cell.toml").write_text(CELL.replace('"bench"', '"other bench"'))
    await editor.open(PROGRAM)
    settings = {"armwright": {"cell": "other/cell.toml", "std": "83"}}
    editor.client.set_configuration(settings)
    editor.client.workspace_did_change_configuration(lsp.DidChangeConfigurationParams(settings))

    for _ in range(100):
        if "E214" in {str(one.code) for one in editor.client.diagnostics[editor.uri]}:
            break
        await asyncio.sleep(0.05)
    assert "E214" in {str(one.code) for one in editor.client.diagnostics[editor.uri]}
    assert "in other bench" in await editor.hover("stop")

    editor.client.set_configuration({"armwright": {"cell": "missing.toml"}})
    editor.client.workspace_did_change_configuration(lsp.DidChangeConfigurationParams({}))
    for _ in range(100):
        if editor.client.messages:
            break
        await asyncio.sleep(0.05)
    assert "missing.toml: no such file" in editor.client.messages[0].message


@pytest.mark.asyncio
async def test_definition_and_references(editor: Editor) -> None:
    """A name leads to its declaration and to its uses in its scope; an arm leads into the cell file."""
    await editor.open(PROGRAM)

    async def definition(word: str, nth: int = 0) -> lsp.Location:
        found = await editor.client.text_document_definition_async(
            lsp.DefinitionParams(editor.document, position(PROGRAM, word, nth))
        )
        assert isinstance(found, lsp.Location)
        return found

    assert (await definition("cup, 90")).range.start == position(PROGRAM, "cup")
    assert (await definition("put (part")).range.start == position(PROGRAM, "put")
    assert (await definition("n = pace")).range.start == position(PROGRAM, "n : SCALAR", 1)
    assert (await definition("n = 50")).range.start == position(PROGRAM, "n : SCALAR")
    arm = await definition("ARM_1")
    assert arm.uri.endswith("bench.toml")
    assert arm.range.start.line == CELL.splitlines().index("[arms.ARM_1]")

    where = lsp.ReferenceParams(lsp.ReferenceContext(False), editor.document, position(PROGRAM, "n = 50"))
    found = await editor.client.text_document_references_async(where)
    assert [one.range.start for one in found or ()] == [position(PROGRAM, "n = 50"), position(PROGRAM, "n ;", 1)]

    marked = await editor.client.text_document_document_highlight_async(
        lsp.DocumentHighlightParams(editor.document, position(PROGRAM, "part"))
    )
    kinds = [one.kind for one in marked or ()]
    write, read = lsp.DocumentHighlightKind.Write, lsp.DocumentHighlightKind.Read
    # Declared, given a place by the camera, and used three times.
    assert kinds == [write, write, read, read, read]


@pytest.mark.asyncio
async def test_rename(editor: Editor) -> None:
    """A name is changed wherever it means the same, and nowhere else; what would change the meaning is refused."""
    await editor.open(PROGRAM)

    assert await editor.rename("n = 50", "count") == PROGRAM.replace("    n :", "    count :").replace(
        "n = 50", "count = 50"
    ).replace("SPEED = n ;\n  GRASP", "SPEED = count ;\n  GRASP")
    assert await editor.rename("above", "Ahead") == PROGRAM.replace("above", "Ahead")
    placeholder = await editor.client.text_document_prepare_rename_async(
        lsp.PrepareRenameParams(editor.document, position(PROGRAM, "above = "))
    )
    assert isinstance(placeholder, lsp.PrepareRenamePlaceholder)
    assert placeholder.placeholder == "above"

    refused = {
        ("above", "while"): "'while' is a reserved word of RLO-2",
        ("above", "CUP"): "the program already has a name 'CUP'",
        ("above", "a b"): "'a b' is no name",
        ("above", "x" * 32): "names have at most 31 characters in RLO-2",
        ("above", "arm_2"): "'arm_2' is the name of an arm",
        ("above", "thing"): "",
        ("ARM_1", "x"): "`ARM_1` is an arm",
        ("cup", "x"): "`cup` gets its pose from bench by this name",
        ("XYZ", "x"): "`XYZ` is a function of the language",
        ("MOVE", "x"): "`MOVE` is no name",
        ("thing", "pace"): "procedure `put` already has a name 'pace'",
    }
    for (word, new), message in refused.items():
        if not message:
            # A parameter of that name hides nothing that the procedure uses.
            assert "thing = part" in await editor.rename(word, new)
            continue
        with pytest.raises(JsonRpcException) as error:
            await editor.rename(word, new)
        assert message in str(error.value)


@pytest.mark.asyncio
async def test_completion_in_a_move(editor: Editor) -> None:
    """In a MOVE, what is offered is what may stand there: places, then the clauses that go with those given."""
    await editor.open(PROGRAM)
    line = position(PROGRAM, "  GRASP")

    async def offered(written: str) -> list[str]:
        start = lsp.Position(line.line, 0)
        editor.change(lsp.Range(start, start), written)
        labels = await editor.labels(lsp.Position(line.line, len(written)))
        editor.change(lsp.Range(start, lsp.Position(line.line, len(written))), "")
        return labels

    assert (await offered("MOVE "))[:2] == ["ARM_1", "part"]
    assert await offered("MOVE part ") == ["TO"]
    places = await offered("MOVE ARM_1 TO ")
    assert {"part", "above", "cup", "stop", "ARM_1", "STATION"} <= set(places)
    assert "n" not in places
    clauses = await offered("MOVE ARM_1 TO cup ")
    assert {"DIRECTLY", "STRAIGHTLY", "VIA", "ON", "WITH APPROACH", "WITH SPEED"} <= set(clauses)
    assert {"CIRCULARLY", "WITH BLEND", "WITH VELOCITY"} <= set(clauses)
    assert await offered("MOVE ARM_1 TO cup DIRECTLY, ") == [
        "ON",
        "SMOOTHLY",
        "WITH SPEED",
        "WITH BLEND",
        "WITH DURATION",
        "WITH VELOCITY",
        "WITH ROTATION",
        "WITH ACCELERATION",
    ]
    assert await offered("MOVE ARM_1 TO cup VIA (above), WITH SPEED = 5, WITH ") == [
        "APPROACH",
        "DEPARTURE",
        "BLEND",
        "ROTATION",
        "ACCELERATION",
    ]
    assert (await offered("MOVE ARM_1 TO cup WITH SPEED = "))[:4] == ["n", "DIST", "FORCE", "TORQUE"]
    assert await offered("OPERATE ") == ["LAMP"]
    assert {"MOVE", "put", "n", "MOVE ... WITH APPROACH", "TRY ... RECOVER"} <= set(await offered("M"))
    assert await offered("{ MOVE ") == []


@pytest.mark.asyncio
async def test_signature(editor: Editor) -> None:
    """While a call is written, the procedure's parameters are shown with the one that is being written."""
    await editor.open(PROGRAM)
    found = await editor.client.text_document_signature_help_async(
        lsp.SignatureHelpParams(editor.document, position(PROGRAM, "cup, 90"))
    )

    assert found is not None
    assert found.signatures[0].label == "PROCEDURE put (thing, place : FRAME, pace : SCALAR)"
    assert found.active_parameter == 1
    start, end = (found.signatures[0].parameters or ())[1].label
    assert found.signatures[0].label[int(start) : int(end)] == "place"


@pytest.mark.asyncio
async def test_code_actions(editor: Editor) -> None:
    """What is certainly right is offered as a fix, one by one and all at once."""
    text = "VAR f : FRAME ;\nBEGIN\n  READ VISIONS (f)\n  MOVE ARM - 1 TO f\n  GRASP ;\nEND\n"
    await editor.open(text)

    here = lsp.Range(lsp.Position(3, 8), lsp.Position(3, 8))
    [action] = await editor.actions(here, "quickfix")
    assert action.title == "replace `ARM - 1` by `ARM_1`"
    assert action.is_preferred
    assert [one.code for one in action.diagnostics or ()] == ["E106"]
    assert action.edit is not None
    assert "MOVE ARM_1 TO f" in applied(text, (action.edit.changes or {})[editor.uri])

    [every] = await editor.actions(here, "source.fixAll")
    assert every.edit is not None
    cured = applied(text, (every.edit.changes or {})[editor.uri])
    assert cured == "VAR f : FRAME ;\nBEGIN\n  READ VISIONS (f);\n  MOVE ARM_1 TO f;\n  GRASP ;\nEND.\n"


def colours(text: str, data: Sequence[int]) -> list[tuple[str, str, set[str]]]:
    """Return words with their kinds and modifiers, out of the numbers of the protocol."""
    found, line, column = [], 0, 0
    for at in range(0, len(data), 5):
        down, right, length, kind, bits = data[at : at + 5]
        line, column = line + down, right if down else column + right
        row = text.replace("\r\n", "\n").split("\n")[line].encode("utf-16-le")
        word = row[2 * column : 2 * (column + length)].decode("utf-16-le")
        found.append((word, KINDS[kind], {name for bit, name in enumerate(MODIFIERS) if bits >> bit & 1}))
    return found


@pytest.mark.asyncio
async def test_semantic_tokens(editor: Editor) -> None:
    """Words are coloured by what they are; after a change only the difference is sent."""
    await editor.open(PROGRAM)
    full = await editor.client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(editor.document))
    assert full is not None
    found = colours(PROGRAM, full.data)

    assert ("part", "variable", {"frame", "declaration"}) in found
    assert ("thing", "parameter", {"frame"}) in found
    assert ("n", "variable", {"scalar", "modification"}) in found
    assert ("ARM_1", "variable", {"readonly", "defaultLibrary", "arm", "frame"}) in found
    assert ("put", "function", {"declaration"}) in found
    assert ("XYZ", "function", {"defaultLibrary"}) in found
    assert ("APPROACH", "keyword", set()) in found
    assert ("10cm", "number", set()) in found

    where = position(PROGRAM, "  GRASP")
    editor.change(lsp.Range(where, where), "  { two\nlines } above = cup ;\n")
    delta = await editor.client.text_document_semantic_tokens_full_delta_async(
        lsp.SemanticTokensDeltaParams(editor.document, full.result_id or "")
    )
    assert isinstance(delta, lsp.SemanticTokensDelta)
    [edit] = delta.edits
    data = [*full.data[: edit.start], *(edit.data or ()), *full.data[edit.start + edit.delete_count :]]
    assert len(edit.data or ()) < 50
    found = colours(editor.text, data)
    assert [one[:2] for one in found if one[1] == "comment"] == [("{ two", "comment"), ("lines }", "comment")]
    again = await editor.client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(editor.document))
    assert again is not None
    assert list(again.data) == data


@pytest.mark.asyncio
async def test_inlay_hints(editor: Editor) -> None:
    """Behind each MOVE stand its stages, in front of arguments the parameters, behind a bare GRASP its arm."""
    await editor.open(PROGRAM)
    whole = lsp.Range(lsp.Position(0, 0), lsp.Position(100, 0))
    found = await editor.client.text_document_inlay_hint_async(lsp.InlayHintParams(editor.document, whole))

    hints = {(one.position.line, one.label) for one in found or ()}
    grasp = position(PROGRAM, "GRASP").line
    assert hints >= {
        (7, "LINE thing"),
        (grasp - 1, "PTP above / LINE part"),
        (grasp, "ARM_1"),
        (grasp + 1, "thing:"),
        (grasp + 1, "place:"),
        (grasp + 1, "pace:"),
        (grasp + 2, "PTP stop"),
    }


@pytest.mark.asyncio
async def test_shape(editor: Editor) -> None:
    """Procedures and variables make the outline; blocks and declarations can be folded away."""
    await editor.open(PROGRAM)
    symbols = await editor.client.text_document_document_symbol_async(lsp.DocumentSymbolParams(editor.document))
    folds = await editor.client.text_document_folding_range_async(lsp.FoldingRangeParams(editor.document))

    assert [one.name for one in symbols or ()] == ["part", "above", "cup", "stop", "n", "put"]
    put = (symbols or ())[-1]
    assert isinstance(put, lsp.DocumentSymbol)
    assert [one.name for one in put.children or ()] == ["thing", "place", "pace", "n"]
    lines = {(one.start_line, one.end_line) for one in folds or ()}
    assert {(1, 2), (3, 10), (5, 10), (11, 19)} <= lines


@pytest.mark.asyncio
async def test_formatting(editor: Editor) -> None:
    """A program is laid out with as small a change as will do; line ends stay as they are."""
    text = "var f : frame ;\r\nbegin\r\nread visions (f) ;\r\nMOVE arm-1 TO f ;\r\nend.\r\n"
    await editor.open(text)
    options = lsp.FormattingOptions(tab_size=2, insert_spaces=True)
    edits = await editor.client.text_document_formatting_async(lsp.DocumentFormattingParams(editor.document, options))

    laid_out = applied(text, edits or ())
    assert "\r\n  MOVE ARM_1 TO f ;\r\n" in laid_out
    assert "\n" not in laid_out.replace("\r\n", "")
    await editor.open(laid_out)
    assert not await editor.client.text_document_formatting_async(
        lsp.DocumentFormattingParams(editor.document, options)
    )


@pytest.mark.asyncio
async def test_characters_beyond_the_basic_plane(editor: Editor) -> None:
    """Columns count as the editor counts them: a picture takes two; lines end where the editor ends them."""
    text = "VAR f : FRAME ;\r\nBEGIN\r\n  { 🤖🦾\u2028 } READ VISIONS (f) ; { é } MOVE ARM_1 TO g ;\r\nEND.\r\n"
    found = {str(one.code): one for one in await editor.open(text)}

    assert found["E202"].range == between(text, "g ;", "g")
    assert "f : FRAME" in await editor.hover("f) ;")
    where = between(text, "g ;", "g")
    editor.change(where, "f")
    assert editor.text == text.replace("TO g", "TO f")
    assert "E202" not in {str(one.code) for one in await editor.told()}
    full = await editor.client.text_document_semantic_tokens_full_async(lsp.SemanticTokensParams(editor.document))
    assert full is not None
    words = [word for word, _, _ in colours(editor.text, full.data)]
    assert words[-9:] == ["READ", "VISIONS", "f", "{ é }", "MOVE", "ARM_1", "TO", "f", "END"]
    assert "{ 🤖🦾\u2028 }" in words


@pytest.mark.asyncio
async def test_long_program(editor: Editor) -> None:
    """A program of more than 2000 lines is analysed when nothing more is typed; a question waits for that."""
    await editor.open("VAR n : SCALAR ;\nBEGIN\n" + "  n = 1 ;\n" * 2100 + "  PRINT(n) ;\nEND.\n")
    for new in ("PRINT(m) ;", " "):
        where = position(editor.text, "  PRINT(n)")
        editor.change(lsp.Range(where, where), new)

    assert await editor.labels(position(editor.text, "  PRINT(n)", behind=True)) == []
    assert "n : SCALAR" in await editor.hover("n) ;")
    assert {str(one.code) for one in await editor.told()} == {"E202"}
    assert editor.client.published == [0, 2]


@pytest.mark.asyncio
async def test_whole_new_text(editor: Editor) -> None:
    """An editor may also send the whole text anew, and close and open a program again."""
    await editor.open("BEGIN MOVE ARM_1 TO g ; END.")
    editor.version += 1
    editor.client.text_document_did_change(
        lsp.DidChangeTextDocumentParams(
            lsp.VersionedTextDocumentIdentifier(editor.version, editor.uri),
            [lsp.TextDocumentContentChangeWholeDocument("BEGIN END.")],
        )
    )
    assert await editor.told() == []

    editor.client.text_document_did_close(lsp.DidCloseTextDocumentParams(editor.document))
    with pytest.raises(JsonRpcException, match="is not open"):
        await editor.hover("")
    editor.version += 1
    assert await editor.open(PROGRAM.replace("END.", "END")) != []


def test_questions_that_make_no_sense() -> None:
    """A question that cannot be read is refused: whoever asked does not wait for an answer for ever."""
    asked = [None, {"textDocument": 5}, {"textDocument": {"uri": "file:///x"}}]
    talk = [{"id": i, "method": lsp.TEXT_DOCUMENT_HOVER, "params": one} for i, one in enumerate(asked)]
    bodies = [json.dumps({"jsonrpc": "2.0", **one}).encode() for one in (*talk, {"method": lsp.EXIT})]
    messages = b"".join(b"Content-Length: %d\r\n\r\n%s" % (len(one), one) for one in bodies)
    command = [sys.executable, "-m", "armwright", "lsp"]
    said = subprocess.run(command, input=messages, capture_output=True, check=False, timeout=300).stdout.decode()

    answers = [json.JSONDecoder().raw_decode(part)[0] for part in said.split("\r\n\r\n")[1:]]
    assert [(one["id"], one["error"]["code"]) for one in answers if "id" in one] == [
        (0, -32602),
        (1, -32602),
        (2, -32602),
    ]


def test_the_end_of_a_session() -> None:
    """An editor that says goodbye gets its last answer, and the server ends well."""
    talk = [
        {"id": 1, "method": lsp.INITIALIZE, "params": {"processId": None, "rootUri": None, "capabilities": {}}},
        {"id": 2, "method": lsp.SHUTDOWN},
        {"method": lsp.EXIT},
    ]
    bodies = [json.dumps({"jsonrpc": "2.0", **one}).encode() for one in talk]
    command = [sys.executable, "-m", "armwright", "lsp"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=False
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        assert server.stderr is not None
        server.stdin.write(b"".join(b"Content-Length: %d\r\n\r\n%s" % (len(one), one) for one in bodies))
        server.stdin.flush()  # and stays open, as that of an editor does
        status = server.wait(timeout=300)
        said, errors = server.stdout.read(), server.stderr.read()

    assert (status, errors) == (0, b"")
    assert said.endswith(b'{"id": 2, "jsonrpc": "2.0", "result": null}')


def test_without_pygls() -> None:
    """Where the library of the protocol is missing, the message says how to get it."""
    without = "import sys; sys.modules['pygls'] = None; sys.argv = ['armwright', 'lsp']"
    script = f"{without}; from armwright.cli.app import main; main()"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=300)

    assert result.returncode == 3
    assert result.stderr == (
        "armwright: the language server needs pygls; install it by: pip install 'armwright[lsp]'\n"
    )


@pytest.mark.parametrize(("farewell", "status"), [([{"method": lsp.EXIT}], 1), ([], 0)], ids=["exit", "end of input"])
def test_leaving_in_the_middle(farewell: list[dict[str, object]], status: int) -> None:
    """The server ends at once while it looks at a long program: with 1 after ``exit`` without ``shutdown``."""
    text = "VAR n : SCALAR ;\nBEGIN\n" + "  n = n + n * 2 - n / 3 ;\n" * 12_000 + "END.\n"
    item = {"uri": "untitled:p.rlo", "languageId": "rlo", "version": 1, "text": text}
    talk = [
        {"id": 1, "method": lsp.INITIALIZE, "params": {"capabilities": {}}},
        {"method": lsp.INITIALIZED, "params": {}},
        {"method": lsp.TEXT_DOCUMENT_DID_OPEN, "params": {"textDocument": item}},
        *farewell,
    ]
    bodies = [json.dumps({"jsonrpc": "2.0", **one}).encode() for one in talk]
    with subprocess.Popen(
        [sys.executable, "-m", "armwright", "lsp"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        assert server.stderr is not None
        server.stdin.write(b"".join(b"Content-Length: %d\r\n\r\n%s" % (len(one), one) for one in bodies))
        server.stdin.flush()
        if not farewell:
            server.stdin.close()
        ended = server.wait(timeout=300)
        said, errors = server.stdout.read(), server.stderr.read()

    assert (ended, errors) == (status, b"")
    # Nothing is said of a program that was not looked at to the end.
    assert b"publishDiagnostics" not in said
