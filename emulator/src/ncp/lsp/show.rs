//! Problems, explanations, offers and outlines in the terms of the protocol.

use std::collections::HashMap;
use std::ops::Range;

use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CompletionItem, CompletionItemKind,
    CompletionTextEdit, Diagnostic, DiagnosticSeverity, DocumentSymbol, Documentation,
    FoldingRange, FoldingRangeKind, Hover, HoverContents, InlayHint, InlayHintLabel,
    InsertTextFormat, Location, MarkupContent, MarkupKind, NumberOrString, SemanticToken,
    SemanticTokenType, SemanticTokens, SemanticTokensLegend, SymbolKind, TextEdit, WorkspaceEdit,
};
use vimc4_ncp::Severity;
use vimc4_ncp::language::service;

use super::document::Document;

/// A problem of a file.
pub(super) fn diagnostic(
    document: &Document,
    bytes: Range<usize>,
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

/// What mends a problem, and which of those that the editor shows.
pub(super) fn action(
    document: &Document,
    fix: service::Fix,
    told: &[Diagnostic],
) -> CodeActionOrCommand {
    let (code, about) = (NumberOrString::String(fix.code.to_owned()), document.range(fix.about));
    let is_it = |told: &&Diagnostic| told.code.as_ref() == Some(&code) && told.range == about;
    let mended: Vec<Diagnostic> = told.iter().filter(is_it).cloned().collect();
    let edits = vec![edit(document, fix.replaces, fix.with)];
    CodeActionOrCommand::CodeAction(CodeAction {
        title: fix.title,
        kind: Some(CodeActionKind::QUICKFIX),
        diagnostics: Some(mended).filter(|mended| !mended.is_empty()),
        edit: Some(WorkspaceEdit::new(HashMap::from([(document.uri.clone(), edits)]))),
        is_preferred: Some(fix.is_likely),
        ..CodeAction::default()
    })
}

/// A piece of a file with another text.
pub(super) fn edit(document: &Document, replaces: Range<usize>, new_text: String) -> TextEdit {
    TextEdit { range: document.range(replaces), new_text }
}

/// Places in a file.
pub(super) fn locations(document: &Document, places: Vec<Range<usize>>) -> Vec<Location> {
    let places = places.into_iter().map(|place| document.range(place));
    places.map(|range| Location { uri: document.uri.clone(), range }).collect()
}

/// Lines that can be shown as one.
pub(super) fn fold(document: &Document, fold: service::Fold) -> FoldingRange {
    let range = document.range(fold.range);
    let kind = if fold.is_comment { FoldingRangeKind::Comment } else { FoldingRangeKind::Region };
    FoldingRange {
        start_line: range.start.line,
        end_line: range.end.line,
        kind: Some(kind),
        ..FoldingRange::default()
    }
}

/// A remark behind a word.
pub(super) fn hint(document: &Document, hint: service::Hint) -> InlayHint {
    InlayHint {
        position: document.position(hint.at),
        label: InlayHintLabel::String(hint.text),
        kind: None,
        text_edits: None,
        tooltip: None,
        padding_left: Some(true),
        padding_right: None,
        data: None,
    }
}

/// What the numbers mean that tell the kinds of tokens.
pub(super) fn legend() -> SemanticTokensLegend {
    use service::TokenKind as Kind;
    let kind = |kind| match kind {
        Kind::LineNumber => SemanticTokenType::DECORATOR,
        Kind::Command => SemanticTokenType::KEYWORD,
        Kind::Word => SemanticTokenType::PARAMETER,
        Kind::Number => SemanticTokenType::NUMBER,
        Kind::Text => SemanticTokenType::STRING,
        Kind::Comment => SemanticTokenType::COMMENT,
    };
    let token_types = Kind::ALL.into_iter().map(kind).collect();
    SemanticTokensLegend { token_types, token_modifiers: Vec::new() }
}

/// Tokens, each counted from where the one before begins.
pub(super) fn tokens(document: &Document, tokens: &[service::TextToken]) -> SemanticTokens {
    let (mut line, mut start) = (0, 0);
    let data = tokens.iter().map(|token| {
        let range = document.range(token.range.clone());
        let delta_line = range.start.line - line;
        let from = if delta_line == 0 { start } else { 0 };
        (line, start) = (range.start.line, range.start.character);
        SemanticToken {
            delta_line,
            delta_start: range.start.character - from,
            length: range.end.character.saturating_sub(range.start.character),
            token_type: token.kind as u32,
            token_modifiers_bitset: 0,
        }
    });
    SemanticTokens { result_id: None, data: data.collect() }
}

fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}
