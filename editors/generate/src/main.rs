//! Writes what is compiled of the tree-sitter grammars from each `grammar.js`, as `tree-sitter generate` does: into their
//! `src`, or into folders of their names in the folder that is given. Node runs the grammars.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use tree_sitter_generate::{OptLevel, generate_parser_in_directory};

const GRAMMARS: [&str; 2] = ["tree-sitter-ncp", "tree-sitter-isel"];

/// The version of the tables, which `tree_sitter/parser.h` belongs to.
const TABLES: usize = 15;

fn main() -> ExitCode {
    let editors = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let elsewhere = std::env::args_os().nth(1).map(PathBuf::from);
    for name in GRAMMARS {
        let grammar = editors.join(name);
        let out =
            elsewhere.as_ref().map_or_else(|| grammar.join("src"), |folder| folder.join(name));
        let mut remarks = Vec::new();
        let done = generate_parser_in_directory(
            grammar,
            Some(out),
            None::<PathBuf>,
            TABLES,
            None,
            Some("node"),
            true,
            OptLevel::default(),
            &mut remarks,
        );
        for remark in remarks {
            eprintln!("{name}: {remark:?}");
        }
        if let Err(error) = done {
            eprintln!("{name}/grammar.js makes no parser: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
