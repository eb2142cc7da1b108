// The language server and the debugger are commands of armwright; this file starts them and nothing else.

import * as vscode from "vscode";
import { LanguageClient, type LanguageClientOptions, type ServerOptions } from "vscode-languageclient/node";

const LANGUAGE = "rlo";

let client: LanguageClient | undefined;
let watcher: vscode.FileSystemWatcher;
// One start or stop at a time: a second waits for the first.
let turn: Promise<void> = Promise.resolve();

export function activate(context: vscode.ExtensionContext): Promise<void> {
  // Programs import cell files, and what is said of them depends on those.
  watcher = vscode.workspace.createFileSystemWatcher("**/*.{rlo,toml,json}");
  context.subscriptions.push(
    watcher,
    vscode.commands.registerCommand("armwright.restart", restart),
    vscode.workspace.onDidChangeConfiguration((change) =>
      change.affectsConfiguration("armwright.path") ? restart() : undefined,
    ),
    vscode.debug.registerDebugAdapterDescriptorFactory(LANGUAGE, {
      createDebugAdapterDescriptor: () => new vscode.DebugAdapterExecutable(command(), ["debug"]),
    }),
    vscode.debug.registerDebugConfigurationProvider(LANGUAGE, { resolveDebugConfiguration: completed }),
  );
  return restart();
}

export function deactivate(): Promise<void> {
  return next(stop);
}

/** The armwright command as the settings have it. */
function command(): string {
  return vscode.workspace.getConfiguration("armwright").get<string>("path")?.trim() || "armwright";
}

function restart(): Promise<void> {
  return next(async () => {
    await stop();
    await start();
  });
}

function next(step: () => Promise<void>): Promise<void> {
  turn = turn.then(step);
  return turn;
}

async function start(): Promise<void> {
  // No transport is named: naming stdio, which is the default, would add an option to the command.
  const server: ServerOptions = { command: command(), args: ["lsp"] };
  const options: LanguageClientOptions = {
    documentSelector: [
      { scheme: "file", language: LANGUAGE },
      { scheme: "untitled", language: LANGUAGE },
    ],
    synchronize: { fileEvents: watcher },
  };
  try {
    client = new LanguageClient("armwright", "armwright", server, options);
    await client.start();
  } catch (error) {
    client = undefined;
    void complain(error);
  }
}

async function stop(): Promise<void> {
  const running = client;
  client = undefined;
  try {
    await running?.dispose();
  } catch {
    // It had stopped by itself.
  }
}

async function complain(error: unknown): Promise<void> {
  const settings = "Open the settings";
  const why = error instanceof Error ? error.message : String(error);
  const chosen = await vscode.window.showErrorMessage(
    `armwright: the language server \`${command()} lsp\` did not start (${why}). Is armwright installed, and is armwright.path right?`,
    settings,
  );
  if (chosen === settings) {
    await vscode.commands.executeCommand("workbench.action.openSettings", "armwright.path");
  }
}

/** Fill in what a launch leaves open: the program in the editor; cell, language and strictness as in the settings. */
function completed(
  folder: vscode.WorkspaceFolder | undefined,
  launch: vscode.DebugConfiguration,
): vscode.DebugConfiguration | undefined {
  const document = vscode.window.activeTextEditor?.document;
  if (!launch.type && !launch.request && document?.languageId === LANGUAGE) {
    launch = { type: LANGUAGE, request: "launch", name: "Run the RLO program", program: document.fileName, stopOnEntry: true };
  }
  if (!launch["program"]) {
    void vscode.window.showErrorMessage("armwright: the launch names no program. Open one, or write `program` in launch.json.");
    return undefined;
  }
  const program = String(launch["program"]);
  const scope = program.includes("${") ? (document?.uri ?? folder?.uri) : vscode.Uri.file(program);
  const settings = vscode.workspace.getConfiguration("armwright", scope);
  for (const name of ["cell", "std", "strict"]) {
    const setting = settings.get<string | boolean>(name);
    if (launch[name] === undefined && setting !== undefined && setting !== "") {
      launch[name] = setting;
    }
  }
  return launch;
}
