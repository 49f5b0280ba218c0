//! The state of the server, and its answers.

use std::collections::BTreeMap;
use std::ops::Range;

use lsp_types::{
    CodeActionKind, CodeActionOrCommand, CodeActionParams, CompletionParams, CompletionResponse,
    DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    DocumentFormattingParams, DocumentSymbolParams, DocumentSymbolResponse, FoldingRange,
    FoldingRangeParams, GotoDefinitionParams, GotoDefinitionResponse, HoverParams, InlayHint,
    InlayHintParams, Location, PublishDiagnosticsParams, ReferenceParams, SemanticTokens,
    SemanticTokensParams, SemanticTokensRangeParams, TextDocumentSyncKind, TextEdit, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use vimc4_ncp::job::{self, Target};
use vimc4_ncp::language::service::Context;
use vimc4_ncp::language::{lines, service};

use super::document::Document;
use super::messages::{Incoming, Outgoing, Refusal};
use super::show;
use crate::job::source::Reading;

/// The most problems of a file that are shown.
const MOST_PROBLEMS: usize = 1_000;

/// How far the conversation has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Before,
    Running,
    ShutDown,
}

/// A language server.
pub(super) struct Server {
    target: Target,
    reading: Reading,
    /// What explanations depend on.
    context: Context,
    /// The guard that ends the server with the program that has started it.
    guard: fn(u32),
    stage: Stage,
    /// Whether the editor knows snippets.
    snippets: bool,
    /// The open files by their names.
    documents: BTreeMap<String, Document>,
}

impl Server {
    /// A new server. `guard` is told the process of its client.
    pub(super) fn new(target: Target, reading: Reading, guard: fn(u32)) -> Server {
        let context = Context {
            axes: target.axes,
            rotary: target.rotary,
            drill_in_mm: reading.options().drill_in_mm,
        };
        let (stage, documents) = (Stage::Before, BTreeMap::new());
        Server { target, reading, context, guard, stage, snippets: false, documents }
    }

    /// Whether the client has said that it will end.
    pub(super) fn is_shut_down(&self) -> bool {
        self.stage == Stage::ShutDown
    }

    /// The answers to a message.
    pub(super) fn receive(&mut self, message: Incoming) -> Vec<Outgoing> {
        match message {
            Incoming::Request { id, method, params } => {
                vec![Outgoing::answer(id, self.request(&method, params))]
            }
            Incoming::Notification { method, params } if self.stage == Stage::Running => {
                // A client that is wrong here is not waiting for an answer.
                self.notification(&method, params).ok().flatten().into_iter().collect()
            }
            Incoming::Notification { .. } | Incoming::Answer => Vec::new(),
            Incoming::Unreadable { id, error } => vec![Outgoing::answer(id, Err(error))],
        }
    }

    fn request(&mut self, method: &str, params: Value) -> Result<Value, Refusal> {
        match (self.stage, method) {
            (Stage::Before, "initialize") => self.initialize(&params),
            (Stage::Before, _) => Err(Refusal::uninitialized()),
            (Stage::ShutDown, _) => Err(Refusal::request("the server is shut down")),
            (Stage::Running, "initialize") => Err(Refusal::request("initialize comes only once")),
            (Stage::Running, "shutdown") => {
                self.stage = Stage::ShutDown;
                Ok(Value::Null)
            }
            (Stage::Running, "textDocument/hover") => result(self.hover(read(params)?)?),
            (Stage::Running, "textDocument/completion") => result(self.complete(read(params)?)?),
            (Stage::Running, "textDocument/documentSymbol") => result(self.outline(read(params)?)?),
            (Stage::Running, "textDocument/codeAction") => result(self.actions(read(params)?)?),
            (Stage::Running, "textDocument/formatting") => result(self.format(read(params)?)?),
            (Stage::Running, "textDocument/definition") => result(self.define(read(params)?)?),
            (Stage::Running, "textDocument/references") => result(self.references(read(params)?)?),
            (Stage::Running, "textDocument/foldingRange") => result(self.folds(read(params)?)?),
            (Stage::Running, "textDocument/inlayHint") => result(self.hints(read(params)?)?),
            (Stage::Running, "textDocument/semanticTokens/full") => {
                let params: SemanticTokensParams = read(params)?;
                let document = self.document(&params.text_document.uri)?;
                result(tokens(document, 0..document.text().len()))
            }
            (Stage::Running, "textDocument/semanticTokens/range") => {
                let params: SemanticTokensRangeParams = read(params)?;
                let document = self.document(&params.text_document.uri)?;
                result(tokens(document, document.bytes(params.range)))
            }
            (Stage::Running, _) => Err(Refusal::method(method)),
        }
    }

    /// Reads only what matters here: the structures for everything that editors can do are large.
    fn initialize(&mut self, params: &Value) -> Result<Value, Refusal> {
        if !params["capabilities"].is_object() {
            return Err(Refusal::params("`capabilities` is not an object"));
        }
        self.stage = Stage::Running;
        let process = params["processId"].as_u64().and_then(|process| process.try_into().ok());
        process.into_iter().for_each(self.guard);
        let item = &params["capabilities"]["textDocument"]["completion"]["completionItem"];
        self.snippets = item["snippetSupport"].as_bool().unwrap_or_default();
        Ok(json!({
            "capabilities": {
                "textDocumentSync": TextDocumentSyncKind::INCREMENTAL,
                "hoverProvider": true,
                "completionProvider": { "triggerCharacters": [" "] },
                "documentSymbolProvider": true,
                "codeActionProvider": { "codeActionKinds": [CodeActionKind::QUICKFIX] },
                "documentFormattingProvider": true,
                "definitionProvider": true,
                "referencesProvider": true,
                "foldingRangeProvider": true,
                "inlayHintProvider": true,
                "semanticTokensProvider": { "legend": show::legend(), "range": true, "full": true },
            },
            "serverInfo": { "name": "vimc4", "version": env!("CARGO_PKG_VERSION") },
        }))
    }

    fn hover(&self, params: HoverParams) -> Result<Option<lsp_types::Hover>, Refusal> {
        let place = params.text_document_position_params;
        let document = self.document(&place.text_document.uri)?;
        let hover = service::hover(document.text(), document.offset(place.position), self.context);
        Ok(hover.map(|hover| show::hover(document, hover)))
    }

    fn complete(&self, params: CompletionParams) -> Result<CompletionResponse, Refusal> {
        let place = params.text_document_position;
        let document = self.document(&place.text_document.uri)?;
        let offset = document.offset(place.position);
        let offers = service::complete(document.text(), offset, self.context);
        let offers = offers.into_iter();
        let items = offers.map(|offer| show::completion(document, offer, self.snippets));
        Ok(CompletionResponse::Array(items.collect()))
    }

    fn outline(&self, params: DocumentSymbolParams) -> Result<DocumentSymbolResponse, Refusal> {
        let document = self.document(&params.text_document.uri)?;
        let parts = service::outline(document.text()).into_iter();
        let symbols = parts.map(|part| show::symbol(document, part));
        Ok(DocumentSymbolResponse::Nested(symbols.collect()))
    }

    /// What mends the problems in a range, if the editor wants such things.
    fn actions(&self, params: CodeActionParams) -> Result<Vec<CodeActionOrCommand>, Refusal> {
        let document = self.document(&params.text_document.uri)?;
        let wanted = params.context.only.is_none_or(|kinds| {
            kinds.contains(&CodeActionKind::QUICKFIX) || kinds.contains(&CodeActionKind::EMPTY)
        });
        if !wanted {
            return Ok(Vec::new());
        }
        let fixes = service::fixes(document.text(), document.bytes(params.range)).into_iter();
        let told = params.context.diagnostics;
        Ok(fixes.map(|fix| show::action(document, fix, &told)).collect())
    }

    fn format(&self, params: DocumentFormattingParams) -> Result<Vec<TextEdit>, Refusal> {
        let document = self.document(&params.text_document.uri)?;
        let edits = service::format(document.text()).into_iter();
        Ok(edits.map(|edit| show::edit(document, edit.replaces, edit.with)).collect())
    }

    fn define(&self, params: GotoDefinitionParams) -> Result<GotoDefinitionResponse, Refusal> {
        let place = params.text_document_position_params;
        let document = self.document(&place.text_document.uri)?;
        let places = service::definitions(document.text(), document.offset(place.position));
        Ok(GotoDefinitionResponse::Array(show::locations(document, places)))
    }

    fn references(&self, params: ReferenceParams) -> Result<Vec<Location>, Refusal> {
        let place = params.text_document_position;
        let document = self.document(&place.text_document.uri)?;
        let offset = document.offset(place.position);
        let with_definitions = params.context.include_declaration;
        let places = service::references(document.text(), offset, with_definitions);
        Ok(show::locations(document, places))
    }

    fn folds(&self, params: FoldingRangeParams) -> Result<Vec<FoldingRange>, Refusal> {
        let document = self.document(&params.text_document.uri)?;
        let folds = service::folds(document.text()).into_iter();
        Ok(folds.map(|fold| show::fold(document, fold)).collect())
    }

    fn hints(&self, params: InlayHintParams) -> Result<Vec<InlayHint>, Refusal> {
        let document = self.document(&params.text_document.uri)?;
        let hints = service::hints(document.text(), document.bytes(params.range), self.context);
        Ok(hints.into_iter().map(|hint| show::hint(document, hint)).collect())
    }

    fn document(&self, uri: &Uri) -> Result<&Document, Refusal> {
        let document = self.documents.get(uri.as_str());
        document.ok_or_else(|| Refusal::params(format!("{} is not open", uri.as_str())))
    }

    /// Follows what happens in the editor.
    fn notification(&mut self, method: &str, params: Value) -> Result<Option<Outgoing>, Refusal> {
        match method {
            "textDocument/didOpen" => {
                let opened = read::<DidOpenTextDocumentParams>(params)?.text_document;
                let name = opened.uri.as_str().to_owned();
                let document = Document::new(opened.uri, opened.version, opened.text);
                self.documents.insert(name, document);
            }
            "textDocument/didChange" => {
                let changed: DidChangeTextDocumentParams = read(params)?;
                let name = changed.text_document.uri.as_str();
                if let Some(document) = self.documents.get_mut(name) {
                    document.version = changed.text_document.version;
                    changed.content_changes.into_iter().for_each(|change| document.change(change));
                }
            }
            "textDocument/didClose" => {
                let uri = read::<DidCloseTextDocumentParams>(params)?.text_document.uri;
                self.documents.remove(uri.as_str());
                return Ok(Some(publish(PublishDiagnosticsParams::new(uri, Vec::new(), None))));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Checks a file that has changed; `None` if none has.
    pub(super) fn check_next(&mut self) -> Option<Outgoing> {
        let document = self.documents.values_mut().find(|document| document.is_new)?;
        document.is_new = false;
        let diagnostics = check(document, &self.target, self.reading);
        let (uri, version) = (document.uri.clone(), Some(document.version));
        Some(publish(PublishDiagnosticsParams::new(uri, diagnostics, version)))
    }
}

/// What is to be said about a file, in the order of its lines.
fn check(document: &Document, target: &Target, reading: Reading) -> Vec<lsp_types::Diagnostic> {
    // An end of file as DOS has it ends the text; editors show it as a character.
    let text = document.text().split('\u{1a}').next().unwrap_or_default();
    let mut found = Vec::new();
    job::check(text, target, reading.options(), &mut |diagnostic| found.push(diagnostic));
    found.sort_by_key(|diagnostic| diagnostic.line);
    let mut all_lines = lines(text).peekable();
    let mut shown: Vec<_> = Vec::new();
    for diagnostic in found.iter().take(MOST_PROBLEMS + 1) {
        while all_lines.next_if(|line| line.number < diagnostic.line).is_some() {}
        let bytes = all_lines.peek().map_or(0..0, |line| line.in_text(diagnostic.span));
        let severity = reading.severity(diagnostic);
        shown.push(show::diagnostic(document, bytes, severity, diagnostic.problem));
    }
    if let Some(surplus) = shown.get(MOST_PROBLEMS) {
        let more = show::more(surplus, (found.len() - MOST_PROBLEMS) as u64);
        shown.truncate(MOST_PROBLEMS);
        shown.push(more);
    }
    shown
}

fn tokens(document: &Document, within: Range<usize>) -> SemanticTokens {
    show::tokens(document, &service::tokens(document.text(), within))
}

fn publish(params: PublishDiagnosticsParams) -> Outgoing {
    Outgoing::notification("textDocument/publishDiagnostics", params)
}

fn read<T: DeserializeOwned>(params: Value) -> Result<T, Refusal> {
    serde_json::from_value(params).map_err(Refusal::params)
}

fn result(result: impl Serialize) -> Result<Value, Refusal> {
    serde_json::to_value(result).map_err(Refusal::request)
}
