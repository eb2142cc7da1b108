// The extension against a stand-in for the editor: which processes it starts, and with what.

import assert from "node:assert/strict";
import { chmodSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import Module, { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { setTimeout } from "node:timers/promises";

const require = createRequire(import.meta.url);

/** A thing that has every property, and can be called, built and extended. */
function anything(...names) {
  const own = new Map();
  return new Proxy(class {}, {
    ownKeys: (target) => [...Reflect.ownKeys(target), ...names],
    get: (target, key) => {
      if (key === "prototype") return target.prototype;
      if (key === "then" || typeof key === "symbol") return undefined;
      if (!own.has(key)) own.set(key, anything());
      return own.get(key);
    },
    set: (_, key, value) => Boolean(own.set(key, value)),
    apply: () => anything(),
  });
}

/** An editor whose settings name a command, with a program open; `given` takes what the extension registers. */
function editor(path, given) {
  const vscode = anything("commands", "debug", "window", "workspace", "Uri", "DebugAdapterExecutable");
  vscode.version = "1.91.0";
  vscode.env.language = "en";
  vscode.env.appName = "stand-in";
  vscode.workspace.getConfiguration = () => ({
    get: (key) => ({ path, cell: "${workspaceFolder}/cell.toml", std: "83", strict: true })[key],
  });
  vscode.workspace.workspaceFolders = undefined;
  vscode.workspace.textDocuments = [];
  vscode.window.activeTextEditor = { document: { languageId: "rlo", fileName: "/cell/weld.rlo" } };
  vscode.debug.registerDebugAdapterDescriptorFactory = (type, factory) => (given.factory = { type, factory });
  vscode.debug.registerDebugConfigurationProvider = (type, provider) => (given.provider = { type, provider });
  vscode.DebugAdapterExecutable = class {
    constructor(command, args) {
      Object.assign(this, { command, args });
    }
  };
  vscode.EventEmitter = class {
    event = () => ({ dispose() {} });
    fire() {}
    dispose() {}
  };
  return vscode;
}

// A server that answers every request with nothing to offer, and writes down how it was called and what it was asked.
const SERVER = `#!${process.execPath}
const { appendFileSync } = require("node:fs");
const log = (line) => appendFileSync(__filename + ".log", line + "\\n");
log(JSON.stringify(process.argv.slice(2)));
let text = "";
process.stdin.on("data", (data) => {
  text += data;
  for (let head; (head = /^Content-Length: (\\d+)\\r\\n\\r\\n/.exec(text)) && text.length >= head[0].length + Number(head[1]); ) {
    const message = JSON.parse(text.slice(head[0].length, head[0].length + Number(head[1])));
    text = text.slice(head[0].length + Number(head[1]));
    log(message.method);
    if (message.method === "exit") process.exit();
    if (message.id === undefined) continue;
    const result = message.method === "initialize" ? { capabilities: {} } : null;
    const answer = JSON.stringify({ jsonrpc: "2.0", id: message.id, result });
    process.stdout.write("Content-Length: " + answer.length + "\\r\\n\\r\\n" + answer);
  }
});
`;

test("the server is `armwright lsp`, the debugger `armwright debug`, of the armwright that the settings name", async (t) => {
  const folder = mkdtempSync(join(tmpdir(), "rlo-"));
  t.after(() => rmSync(folder, { recursive: true }));
  const path = join(folder, "armwright");
  writeFileSync(path, SERVER);
  chmodSync(path, 0o755);
  const given = {};
  const vscode = editor(path, given);
  const load = Module._load;
  t.mock.method(Module, "_load", (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest)));
  const extension = require("../dist/extension.js");

  await extension.activate({ subscriptions: [] });
  await extension.deactivate();

  const { factory, provider } = given;
  const launch = provider.provider.resolveDebugConfiguration(undefined, {});
  // The server is another process: what it was told last may be written a moment later.
  let said = [];
  for (let looks = 0; looks < 200 && said.at(-1) !== "exit"; looks++) {
    await setTimeout(50);
    said = readFileSync(`${path}.log`, "utf8").trim().split("\n");
  }
  const [args, ...asked] = said;
  assert.equal(args, '["lsp"]');
  assert.deepEqual(asked, ["initialize", "initialized", "shutdown", "exit"]);
  assert.deepEqual([factory.type, provider.type], ["rlo", "rlo"]);
  assert.deepEqual({ ...factory.factory.createDebugAdapterDescriptor() }, { command: path, args: ["debug"] });
  assert.deepEqual([launch.type, launch.program], ["rlo", "/cell/weld.rlo"]);
  // What the launch leaves open is as in the settings; what it says stays.
  assert.deepEqual([launch.cell, launch.std, launch.strict], ["${workspaceFolder}/cell.toml", "83", true]);
  const own = { type: "rlo", request: "launch", program: "a.rlo", cell: "b.toml", std: "2", strict: false };
  assert.deepEqual(provider.provider.resolveDebugConfiguration(undefined, { ...own }), own);
});
