// The grammar in the engine that editors use.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { test } from "node:test";
import oniguruma from "vscode-oniguruma";
import textmate from "vscode-textmate";

const here = import.meta.dirname;
const programs = join(here, "../../../tests/program/corpus");

await oniguruma.loadWASM(readFileSync(createRequire(import.meta.url).resolve("vscode-oniguruma/release/onig.wasm")).buffer);
const registry = new textmate.Registry({
  onigLib: Promise.resolve({
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  }),
  loadGrammar: async () =>
    textmate.parseRawGrammar(readFileSync(join(here, "../syntaxes/rlo.tmLanguage.json"), "utf8"), "rlo.json"),
});
const grammar = await registry.loadGrammar("source.rlo");

/** Text and innermost scope of everything but blanks. */
function coloured(text) {
  const found = [];
  let state = textmate.INITIAL;
  for (const line of text.split(/\r\n|\r|\n/)) {
    const { tokens, ruleStack } = grammar.tokenizeLine(line, state);
    state = ruleStack;
    for (const { startIndex, endIndex, scopes } of tokens) {
      const piece = line.slice(startIndex, endIndex).trim();
      if (piece) found.push([piece, scopes.at(-1)]);
    }
  }
  return found;
}

const scopeOf = (text, piece) => new Map(coloured(text)).get(piece);

test("everything in the conformance programs has a colour, and nothing is marked as wrong", () => {
  for (const name of readdirSync(programs).filter((file) => file.endsWith(".rlo"))) {
    for (const [piece, scope] of coloured(readFileSync(join(programs, name), "utf8"))) {
      assert.doesNotMatch(scope, /^source|^invalid/, `${name}: ${piece}`);
    }
  }
});

test("an arm is one token, with a hyphen or a low line", () => {
  assert.deepEqual(coloured("ARM-1 arm_02"), [
    ["ARM-1", "variable.language.arm.rlo"],
    ["arm_02", "variable.language.arm.rlo"],
  ]);
  assert.equal(scopeOf("ARM - 1", "ARM - 1"), "invalid.illegal.arm.rlo");
});

test("a unit belongs to its number, and elsewhere is a name", () => {
  assert.deepEqual(coloured("s = 5e-3ms"), [
    ["s", "variable.other.rlo"],
    ["=", "keyword.operator.rlo"],
    ["5e-3", "constant.numeric.rlo"],
    ["ms", "keyword.other.unit.rlo"],
  ]);
});

test("a listing is numbered if its first line is, even behind empty lines", () => {
  const number = "constant.numeric.line-number.rlo";
  assert.equal(scopeOf("10 BEGIN\n20 END.", "20"), number);
  assert.equal(scopeOf("\n\n10 BEGIN { a\n20 b } END.", "20"), number);
  assert.equal(scopeOf("10 f = (1,\n0 , 0)", "0"), "constant.numeric.rlo");
  assert.equal(scopeOf("BEGIN\n20 END.", "20"), "constant.numeric.rlo");
  assert.equal(scopeOf("\nBEGIN\n20 END.", "20"), "constant.numeric.rlo");
});

test("a comment may go over several lines", () => {
  assert.equal(scopeOf("{ MOVE\nmove }", "move"), "comment.block.rlo");
});
