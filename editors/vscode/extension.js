// Task and rule files in VS Code: everything is asked of `visup task lsp`.
"use strict";
const vscode = require("vscode");
const { execFile } = require("child_process");
const { Client } = require("./client");

const LANGUAGES = ["visup-task", "visup-rules"];
const LEGEND = ["class", "function", "variable", "keyword"];
let client;

function place(document, position) {
  return { textDocument: { uri: document.uri.toString() }, position };
}

function whole(document, more) {
  return { textDocument: { uri: document.uri.toString() }, ...more };
}

const range = (r) => new vscode.Range(r.start.line, r.start.character, r.end.line, r.end.character);
const location = (l) => new vscode.Location(vscode.Uri.parse(l.uri), range(l.range));

function edits(found) {
  const made = new vscode.WorkspaceEdit();
  for (const [uri, changes] of Object.entries((found && found.changes) || {})) {
    for (const change of changes) made.replace(vscode.Uri.parse(uri), range(change.range), change.newText);
  }
  return made;
}

function diagnosed(collection, params) {
  const found = params.diagnostics.map((d) => {
    const made = new vscode.Diagnostic(range(d.range), d.message, vscode.DiagnosticSeverity.Error);
    made.source = d.source;
    made.code = d.code;
    return made;
  });
  collection.set(vscode.Uri.parse(params.uri), found);
}

function providers() {
  const at = (kind, document, position, more) =>
    client.ask(`textDocument/${kind}`, { ...place(document, position), ...more });
  const of = (kind, document, more) => client.ask(`textDocument/${kind}`, whole(document, more));
  const languages = vscode.languages;
  return [
    languages.registerCompletionItemProvider(LANGUAGES, {
      provideCompletionItems: async (document, position) =>
        ((await at("completion", document, position)) || []).map((item) => {
          const made = new vscode.CompletionItem(item.label, item.kind - 1);
          made.detail = item.detail;
          return made;
        }),
    }, "<", "(", '"'),
    languages.registerHoverProvider(LANGUAGES, {
      provideHover: async (document, position) => {
        const found = await at("hover", document, position);
        return found && new vscode.Hover(new vscode.MarkdownString(found.contents.value), range(found.range));
      },
    }),
    languages.registerDefinitionProvider(LANGUAGES, {
      provideDefinition: async (document, position) => {
        const found = await at("definition", document, position);
        return found && location(found);
      },
    }),
    languages.registerReferenceProvider(LANGUAGES, {
      provideReferences: async (document, position, context) =>
        ((await at("references", document, position, { context })) || []).map(location),
    }),
    languages.registerDocumentSymbolProvider(LANGUAGES, {
      provideDocumentSymbols: async (document) =>
        ((await of("documentSymbol", document)) || []).map(
          (s) => new vscode.DocumentSymbol(s.name, "", s.kind - 1, range(s.range), range(s.selectionRange))),
    }),
    languages.registerCodeActionsProvider(LANGUAGES, {
      provideCodeActions: async (document, where, context) =>
        ((await of("codeAction", document, { range: where, context: { diagnostics: [] } })) || []).map((a) => {
          const made = new vscode.CodeAction(a.title, vscode.CodeActionKind.QuickFix);
          made.edit = edits(a.edit);
          made.diagnostics = context.diagnostics;
          return made;
        }),
    }),
    languages.registerDocumentFormattingEditProvider(LANGUAGES, {
      provideDocumentFormattingEdits: async (document, options) =>
        ((await of("formatting", document, { options })) || []).map(
          (e) => new vscode.TextEdit(range(e.range), e.newText)),
    }),
    languages.registerRenameProvider(LANGUAGES, {
      prepareRename: async (document, position) => {
        const found = await at("prepareRename", document, position);
        if (!found) throw new Error("this name cannot be renamed");
        return range(found);
      },
      provideRenameEdits: async (document, position, newName) =>
        edits(await at("rename", document, position, { newName })),
    }),
    languages.registerFoldingRangeProvider(LANGUAGES, {
      provideFoldingRanges: async (document) =>
        ((await of("foldingRange", document)) || []).map((f) => new vscode.FoldingRange(f.startLine, f.endLine)),
    }),
    languages.registerSignatureHelpProvider(LANGUAGES, {
      provideSignatureHelp: async (document, position) => {
        const found = await at("signatureHelp", document, position);
        if (!found) return undefined;
        const made = new vscode.SignatureHelp();
        made.signatures = found.signatures.map((s) => {
          const one = new vscode.SignatureInformation(s.label, s.documentation);
          one.parameters = s.parameters.map((p) => new vscode.ParameterInformation(p.label));
          return one;
        });
        made.activeSignature = 0;
        made.activeParameter = found.activeParameter;
        return made;
      },
    }, "(", ","),
    languages.registerInlayHintsProvider(LANGUAGES, {
      provideInlayHints: async (document, where) =>
        ((await of("inlayHint", document, { range: where })) || []).map((h) => {
          const made = new vscode.InlayHint(new vscode.Position(h.position.line, h.position.character), h.label);
          made.paddingLeft = true;
          return made;
        }),
    }),
    languages.registerDocumentSemanticTokensProvider(LANGUAGES, {
      provideDocumentSemanticTokens: async (document) =>
        new vscode.SemanticTokens(new Uint32Array((await of("semanticTokens/full", document)).data)),
    }, new vscode.SemanticTokensLegend(LEGEND, [])),
  ];
}

function showTree(command) {
  const editor = vscode.window.activeTextEditor;
  if (!editor) return;
  const panel = vscode.window.createWebviewPanel("visupTree", "Task", vscode.ViewColumn.Beside, {});
  execFile(command, ["task", "show", editor.document.fileName], (error, out, err) => {
    const text = (error ? err || String(error) : out).replace(/[&<>]/g, (c) => `&#${c.charCodeAt(0)};`);
    panel.webview.html = `<pre>${text}</pre>`;
  });
}

async function activate(context) {
  const command = vscode.workspace.getConfiguration("visup").get("command") || "visup";
  const collection = vscode.languages.createDiagnosticCollection("visup");
  client = new Client(command, ["task", "lsp"], (method, params) => {
    if (method === "textDocument/publishDiagnostics") diagnosed(collection, params);
    if (method === "window/showMessage") vscode.window.showWarningMessage(params.message);
  });
  const ours = (document) => LANGUAGES.includes(document.languageId);
  const opened = (document) =>
    ours(document) &&
    client.tell("textDocument/didOpen", {
      textDocument: { uri: document.uri.toString(), languageId: document.languageId, version: document.version, text: document.getText() },
    });
  const changed = ({ document }) =>
    ours(document) &&
    client.tell("textDocument/didChange", {
      textDocument: { uri: document.uri.toString(), version: document.version },
      contentChanges: [{ text: document.getText() }],
    });
  const closed = (document) => ours(document) && client.tell("textDocument/didClose", whole(document));
  try {
    await client.start();
  } catch (error) {
    vscode.window.showWarningMessage(`visup: ${command} task lsp does not start (${error.message}); pip install 'visup[lsp]'`);
    return;
  }
  vscode.workspace.textDocuments.forEach(opened);
  context.subscriptions.push(
    collection,
    vscode.workspace.onDidOpenTextDocument(opened),
    vscode.workspace.onDidChangeTextDocument(changed),
    vscode.workspace.onDidCloseTextDocument(closed),
    vscode.commands.registerCommand("visup.showTree", () => showTree(command)),
    ...providers(),
  );
}

const deactivate = () => client && client.stop();

module.exports = { activate, deactivate };
