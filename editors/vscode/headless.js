// A headless run: the extension is activated with a stand-in for VS Code and must find and mend a mistake.
"use strict";
const Module = require("module");
const path = require("path");

const [folder, command] = process.argv.slice(2);
const found = new Map();
const providers = {};
class Plain { constructor(...given) { this.given = given; } }
class Range { constructor(a, b, c, d) { this.start = { line: a, character: b }; this.end = { line: c, character: d }; } }
class WorkspaceEdit { constructor() { this.changes = []; } replace(uri, range, text) { this.changes.push({ range, text }); } }
class CodeAction { constructor(title) { this.title = title; } }
const text = "<t> ::= cupled(arm, satellite)\n";
const document = { uri: { toString: () => "file:///tmp/a.task" }, languageId: "visup-task", version: 1, getText: () => text };
const nothing = () => ({ dispose() {} });
const register = (name) => (_, provider) => { providers[name] = provider; return nothing(); };
const vscode = {
  Range, WorkspaceEdit, CodeAction, Diagnostic: class { constructor(range, message) { this.range = range; this.message = message; } },
  DiagnosticSeverity: { Error: 0 }, CodeActionKind: { QuickFix: "quickfix" }, Uri: { parse: (u) => u },
  SemanticTokensLegend: Plain, SemanticTokens: Plain,
  languages: new Proxy({ createDiagnosticCollection: () => ({ set: (uri, d) => found.set(uri, d), dispose() {} }) },
    { get: (target, name) => target[name] || register(name) }),
  workspace: { getConfiguration: () => ({ get: () => command }), textDocuments: [document],
    onDidOpenTextDocument: nothing, onDidChangeTextDocument: nothing, onDidCloseTextDocument: nothing },
  commands: { registerCommand: nothing }, window: { showWarningMessage: (m) => { throw new Error(m); } },
};
const load = Module._load;
Module._load = (name, ...rest) => (name === "vscode" ? vscode : load(name, ...rest));

async function main() {
  const extension = require(path.resolve(folder, "extension.js"));
  await extension.activate({ subscriptions: [] });
  const tokens = await providers.registerDocumentSemanticTokensProvider.provideDocumentSemanticTokens(document);
  const where = new Range(0, 0, 0, 30);
  const [action] = await providers.registerCodeActionsProvider.provideCodeActions(document, where, { diagnostics: [] });
  const [diagnostic] = found.get("file:///tmp/a.task");
  console.log(JSON.stringify({ message: diagnostic.message, fix: action.edit.changes[0].text, tokens: tokens.given[0].length,
    providers: Object.keys(providers).length }));
  await extension.deactivate();
}

main().then(() => process.exit(0), (error) => { console.error(error); process.exit(1); });
