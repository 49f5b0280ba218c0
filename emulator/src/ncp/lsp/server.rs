//! What the server knows, and how it answers.

use std::collections::BTreeMap;

use lsp_types::{
    CompletionOptions, CompletionParams, CompletionResponse, DidChangeTextDocumentParams,
    DidCloseTextDocumentParams, DidOpenTextDocumentParams, DocumentSymbolParams,
    DocumentSymbolResponse, HoverParams, HoverProviderCapability, InitializeParams,
    InitializeResult, OneOf, PublishDiagnosticsParams, ServerCapabilities, ServerInfo,
    TextDocumentSyncCapability, TextDocumentSyncKind, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use vimc4_ncp::job::{self, Target};
use vimc4_ncp::language::{lines, service};

use super::document::Document;
use super::messages::{Incoming, Outgoing, Refusal};
use super::show;
use crate::job::source::Reading;

/// So many problems of a file are shown.
const MOST_PROBLEMS: usize = 1_000;

/// How far the conversation is.
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
    stage: Stage,
    /// Whether the editor knows snippets.
    snippets: bool,
    /// The open files by their names.
    documents: BTreeMap<String, Document>,
}

impl Server {
    /// A server that has not been spoken to.
    pub(super) fn new(target: Target, reading: Reading) -> Server {
        let documents = BTreeMap::new();
        Server { target, reading, stage: Stage::Before, snippets: false, documents }
    }

    /// Whether the client has said that it will end.
    pub(super) fn is_shut_down(&self) -> bool {
        self.stage == Stage::ShutDown
    }

    /// What is to be said to a message.
    pub(super) fn receive(&mut self, message: Incoming) -> Vec<Outgoing> {
        match message {
            Incoming::Request { id, method, params } => {
                vec![Outgoing::answer(id, self.request(&method, params))]
            }
            Incoming::Notification { method, params } if self.stage == Stage::Running => {
                // Who is wrong here is not waiting for an answer.
                self.notification(&method, params).ok().flatten().into_iter().collect()
            }
            Incoming::Notification { .. } | Incoming::Answer => Vec::new(),
            Incoming::Unreadable { id, error } => vec![Outgoing::answer(id, Err(error))],
        }
    }

    fn request(&mut self, method: &str, params: Value) -> Result<Value, Refusal> {
        match (self.stage, method) {
            (Stage::Before, "initialize") => result(self.initialize(read(params)?)),
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
            (Stage::Running, _) => Err(Refusal::method(method)),
        }
    }

    fn initialize(&mut self, params: InitializeParams) -> InitializeResult {
        self.stage = Stage::Running;
        let completion = params.capabilities.text_document.and_then(|text| text.completion);
        let item = completion.and_then(|completion| completion.completion_item);
        self.snippets = item.and_then(|item| item.snippet_support).unwrap_or_default();
        InitializeResult {
            capabilities: ServerCapabilities {
                text_document_sync: Some(TextDocumentSyncCapability::Kind(
                    TextDocumentSyncKind::INCREMENTAL,
                )),
                hover_provider: Some(HoverProviderCapability::Simple(true)),
                completion_provider: Some(CompletionOptions {
                    trigger_characters: Some(vec![" ".to_owned()]),
                    ..CompletionOptions::default()
                }),
                document_symbol_provider: Some(OneOf::Left(true)),
                ..ServerCapabilities::default()
            },
            server_info: Some(ServerInfo {
                name: "vimc4".to_owned(),
                version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            }),
        }
    }

    fn hover(&self, params: HoverParams) -> Result<Option<lsp_types::Hover>, Refusal> {
        let place = params.text_document_position_params;
        let document = self.document(&place.text_document.uri)?;
        let hover = service::hover(document.text(), document.offset(place.position));
        Ok(hover.map(|hover| show::hover(document, hover)))
    }

    fn complete(&self, params: CompletionParams) -> Result<CompletionResponse, Refusal> {
        let place = params.text_document_position;
        let document = self.document(&place.text_document.uri)?;
        let offers = service::complete(document.text(), document.offset(place.position));
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
        let severity = reading.severity(diagnostic.problem);
        shown.push(show::diagnostic(document, bytes, severity, diagnostic.problem));
    }
    if let Some(surplus) = shown.get(MOST_PROBLEMS) {
        let more = show::more(surplus, (found.len() - MOST_PROBLEMS) as u64);
        shown.truncate(MOST_PROBLEMS);
        shown.push(more);
    }
    shown
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
