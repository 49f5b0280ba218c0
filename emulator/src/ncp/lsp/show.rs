//! Problems, explanations, offers and outlines in the terms of the protocol.

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionTextEdit, Diagnostic, DiagnosticSeverity,
    DocumentSymbol, Documentation, Hover, HoverContents, InsertTextFormat, MarkupContent,
    MarkupKind, NumberOrString, SymbolKind, TextEdit,
};
use vimc4_ncp::Severity;
use vimc4_ncp::language::service;

use super::document::Document;

/// A problem of a file.
pub(super) fn diagnostic(
    document: &Document,
    bytes: std::ops::Range<usize>,
    severity: Severity,
    problem: vimc4_ncp::Problem,
) -> Diagnostic {
    let help = problem.help().map(|help| format!("\n{help}")).unwrap_or_default();
    Diagnostic {
        range: document.range(bytes),
        severity: Some(match severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Note => DiagnosticSeverity::INFORMATION,
        }),
        code: Some(NumberOrString::String(problem.code().to_owned())),
        source: Some("vimc4".to_owned()),
        message: format!("{problem}{help}"),
        ..Diagnostic::default()
    }
}

/// How many problems are not shown, at the place of the first of them.
pub(super) fn more(first: &Diagnostic, count: u64) -> Diagnostic {
    Diagnostic {
        range: first.range,
        severity: Some(DiagnosticSeverity::INFORMATION),
        source: first.source.clone(),
        message: format!("from here on {count} more problems are not shown"),
        ..Diagnostic::default()
    }
}

/// An explanation.
pub(super) fn hover(document: &Document, hover: service::Hover) -> Hover {
    Hover {
        contents: HoverContents::Markup(markdown(hover.markdown)),
        range: Some(document.range(hover.range)),
    }
}

/// An offer. Editors without snippets are given the mere name.
pub(super) fn completion(
    document: &Document,
    offer: service::Completion,
    snippets: bool,
) -> CompletionItem {
    let new_text = if snippets { offer.snippet } else { offer.label.to_owned() };
    let kind =
        if offer.is_command { CompletionItemKind::FUNCTION } else { CompletionItemKind::FIELD };
    CompletionItem {
        label: offer.label.to_owned(),
        kind: Some(kind),
        detail: Some(offer.detail),
        documentation: Some(Documentation::MarkupContent(markdown(offer.markdown))),
        insert_text_format: snippets.then_some(InsertTextFormat::SNIPPET),
        text_edit: Some(CompletionTextEdit::Edit(TextEdit {
            range: document.range(offer.replaces),
            new_text,
        })),
        ..CompletionItem::default()
    }
}

/// A part of a job with its parts.
pub(super) fn symbol(document: &Document, part: service::Symbol) -> DocumentSymbol {
    use service::SymbolKind as Kind;
    let kind = match part.kind {
        Kind::Heading => SymbolKind::NAMESPACE,
        Kind::Tool => SymbolKind::CLASS,
        Kind::Reference | Kind::Zero => SymbolKind::CONSTANT,
        Kind::Halt => SymbolKind::EVENT,
        Kind::Cut => SymbolKind::FUNCTION,
        Kind::Holes => SymbolKind::ARRAY,
    };
    let children: Vec<_> = part.children.into_iter().map(|child| symbol(document, child)).collect();
    #[expect(deprecated, reason = "the structure has a deprecated member, which must be set")]
    DocumentSymbol {
        name: part.name,
        detail: None,
        kind,
        tags: None,
        deprecated: None,
        range: document.range(part.range),
        selection_range: document.range(part.selection),
        children: Some(children),
    }
}

fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}
