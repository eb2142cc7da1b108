"""The state of the language server: open documents, settings, and the features that are served."""

import logging
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from lsprotocol import types as lsp
from pygls.capabilities import get_capability
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, lsp_method
from pygls.uris import to_fs_path

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.words import Standard
from armwright.program.language_server.analysis import Analysis, Settings, analyse
from armwright.program.language_server.cell_lookup import CellCache
from armwright.program.language_server.diagnostics import lsp_diagnostics
from armwright.program.language_server.documents import Document
from armwright.program.language_server.positions import offset_of
from armwright.version import __version__

SECTION = "armwright"
# The code of the protocol for a request that cannot be fulfilled.
_REQUEST_FAILED = -32803
# Encoding of columns where the editor states none.
DEFAULT_ENCODING = "utf-16"

_Function = TypeVar("_Function", bound=Callable[..., Any])
# The methods of the protocol that are served, with their options and the functions that serve them.
_FEATURES: list[tuple[str, Any, Callable[..., Any]]] = []


def feature(method: str, options: Any = None) -> Callable[[_Function], _Function]:
    """Return a decorator of a function of a server and parameters, which lets all servers serve a method with it."""

    def register(function: _Function) -> _Function:
        _FEATURES.append((method, options, function))
        return function

    return register


class _Protocol(LanguageServerProtocol):
    """The protocol without pygls' copy of the texts, whose lines end at form feeds and U+2028 too."""

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: lsp.DidChangeTextDocumentParams) -> Any:
        yield self.fm.features[lsp.TEXT_DOCUMENT_DID_CHANGE], (params,), None

    def structure_message(self, data: dict[str, Any]) -> Any:
        """Return a message as received; an invalid request gets an error, so that the editor does not wait for ever.

        Raises:
            JsonRpcException: it makes no sense.
        """
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "method" in data and isinstance(data.get("id"), int | str):
                self._send_response(data["id"], None, error.to_response_error())
            raise


class RloServer(LanguageServer):
    """The server: open documents, settings, and what the editor can do."""

    def __init__(self) -> None:
        """Register the features."""
        super().__init__("armwright", __version__, protocol_cls=_Protocol)
        self.documents: dict[str, Document] = {}
        self.settings = Settings()
        self.encoding = DEFAULT_ENCODING
        self.cells = CellCache()
        # Whether the editor has sent ``exit``.
        self.has_exited = False
        self._last_problem = ""
        for method, options, function in _FEATURES:
            self.feature(method, options)(function)
        # Errors are sent to the editor; its log need not repeat them.
        logging.getLogger("pygls").setLevel(logging.CRITICAL)

    def shutdown(self) -> None:
        """End at once, without waiting for the message that is being read."""
        if self._stop_event is not None:
            self._stop_event.set()

    @property
    def status(self) -> int:
        """The exit status that the protocol asks for: 1 where ``exit`` came without ``shutdown``."""
        return int(self.has_exited and not self.protocol._shutdown)  # noqa: SLF001 - pygls keeps it so

    # ---- what the editor can do

    def client_capability(self, path: str) -> Any:
        """Return a capability of the editor, by its path with dots; None where it says nothing of it."""
        return get_capability(self.client_capabilities, path)

    # ---- documents

    def document(self, uri: str) -> Document:
        """Return an open document.

        Raises:
            JsonRpcException: it is not open.
        """
        try:
            return self.documents[uri]
        except KeyError:
            raise request_error(f"{uri} is not open") from None

    async def analysis(self, document: lsp.TextDocumentIdentifier) -> Analysis:
        """Return the analysis of an open document as it is now.

        Raises:
            JsonRpcException: it is not open.
        """
        return await self.document(document.uri).analysis()

    async def locate(self, document: lsp.TextDocumentIdentifier, position: lsp.Position) -> tuple[Analysis, int]:
        """Return the analysis of an open document, and the offset of a position in it.

        Raises:
            JsonRpcException: it is not open.
        """
        analysis = await self.analysis(document)
        return analysis, offset_of(analysis.codec, position)

    def invalidate(self) -> None:
        """Mark the analyses of all documents as outdated: what they depend on has changed."""
        for document in self.documents.values():
            document.invalidate()

    def analyse(self, document: Document) -> Analysis:
        """Analyse a document as it is now."""
        folder = None if document.path is None else document.path.parent
        try:
            return analyse(document.name, document.codec, folder, self.cells, self.settings)
        except Exception as error:  # noqa: BLE001 - a conversation goes on, whatever happens in it
            self._log(error)
            # An empty program has no names and no diagnostics.
            return analyse(document.name, PositionCodec("", self.encoding), None, self.cells, Settings())

    def publish(self, document: Document, analysis: Analysis) -> None:
        """Publish the diagnostics of a document."""
        if self.documents.get(document.uri, document) is not document:
            return
        related = bool(self.client_capability("text_document.publish_diagnostics.related_information"))
        try:
            published = lsp_diagnostics(analysis, document.uri, related=related)
        except Exception as error:  # noqa: BLE001 - as above
            self._log(error)
            published = []
        params = lsp.PublishDiagnosticsParams(document.uri, published, document.version)
        self.text_document_publish_diagnostics(params)
        if analysis.cell_error and analysis.cell_error != self._last_problem:
            self.window_show_message(
                lsp.ShowMessageParams(lsp.MessageType.Warning, f"armwright: {analysis.cell_error}")
            )
        self._last_problem = analysis.cell_error

    def _log(self, error: Exception) -> None:
        text = f"armwright: this should not happen: {type(error).__name__}: {error}"
        self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Error, text))

    # ---- settings

    def apply_settings(self, values: object) -> None:
        """Apply the settings of an editor; unknown ones are ignored."""
        values = values if isinstance(values, dict) else {}
        values = values[SECTION] if isinstance(values.get(SECTION), dict) else values
        cell, std = values.get("cell"), str(values.get("std") or Standard.RLO_2)
        settings = Settings(
            cell=self._settings_path(cell) if isinstance(cell, str) and cell.strip() else None,
            std=Standard(std) if std in set(Standard) else Standard.RLO_2,
            strict=values.get("strict") is True,
        )
        if settings != self.settings:
            self.settings = settings
            self.invalidate()

    def _settings_path(self, text: str) -> Path:
        """Return the file that a setting names: seen from the folder of the workspace."""
        folders = [to_fs_path(uri) for uri in self.workspace.folders]
        root = next((folder for folder in (*folders, self.workspace.root_path) if folder), ".")
        return Path(root, text.strip().replace("${workspaceFolder}", root)).expanduser()

    async def request_settings(self) -> None:
        """Ask the editor for its settings."""
        if not self.client_capability("workspace.configuration"):
            return
        items = [lsp.ConfigurationItem(section=SECTION)]
        with suppress(JsonRpcException):
            answers = await self.workspace_configuration_async(lsp.ConfigurationParams(items))
            if answers and answers[0] is not None:
                self.apply_settings(answers[0])

    async def register_watchers(self) -> None:
        """Ask the editor for notifications of changes of cell files and of settings."""
        watched = lsp.DidChangeWatchedFilesRegistrationOptions([lsp.FileSystemWatcher("**/*.{toml,json,rlo}")])
        options = {
            "did_change_watched_files": (lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, watched),
            "did_change_configuration": (
                lsp.WORKSPACE_DID_CHANGE_CONFIGURATION,
                lsp.DidChangeConfigurationRegistrationOptions(SECTION),
            ),
        }
        registrations = [
            lsp.Registration(method, method, option)
            for name, (method, option) in options.items()
            if self.client_capability(f"workspace.{name}.dynamic_registration")
        ]
        if registrations:
            # An editor that refuses what it declared it can do sends no notifications.
            with suppress(JsonRpcException):
                await self.client_register_capability_async(lsp.RegistrationParams(registrations))


def request_error(text: str) -> JsonRpcException:
    """Return the error of a request that cannot be fulfilled, with the reason."""
    return JsonRpcException(text, code=_REQUEST_FAILED)
