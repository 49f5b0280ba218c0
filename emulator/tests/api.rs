//! The page `docs/api.md` says what is so: its recipes run against the program, and answer as shown.
//!
//! What needs a tool that is missing is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead, so that nothing is left out unnoticed.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::{Command, ExitCode, Output};

use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::{Process, connect, run};

const PAGE: &str = include_str!("../../docs/api.md");

/// Where the page says that it listens.
const THERE: &str = "127.0.0.1:8080";

type Outcome = Result<(), Failed>;

/// The lines of the page's block in this language.
fn block(language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}");
    let lines = PAGE.lines().skip_while(|line| **line != *fence).skip(1);
    lines.take_while(|line| *line != "```").collect()
}

/// A controller as on the page, and where it really listens.
fn serve(folder: &std::path::Path, arguments: &[&str]) -> (Process, Value, String) {
    let given = ["--machine", "mill", "--time", "manual", "--pty", "none"];
    let given: Vec<&str> = given.iter().chain(arguments).copied().collect();
    let (serve, ready) = Process::serve(folder, &given);
    let url = ready["http"].as_str().unwrap_or_default();
    let address = url.trim_start_matches("http://").trim_end_matches('/').to_owned();
    (serve, ready, address)
}

fn shell(command: &str) -> Output {
    Command::new("sh").args(["-c", command]).output().unwrap()
}

fn has(command: &str) -> bool {
    shell(command).status.success()
}

/// What a program printed, if it ended well.
fn printed(output: &Output) -> Result<String, Failed> {
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{output:?}").into()),
    }
}

fn curl_answers_as_shown() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--web"]);
    let mut lines = block("console").into_iter().peekable();
    let mut count = 0;
    while let Some(command) = lines.next().and_then(|line| line.strip_prefix("$ ")) {
        let mut shown = String::new();
        while let Some(line) = lines.next_if(|line| !line.starts_with("$ ")) {
            shown.push_str(line);
        }
        let answer = printed(&shell(&command.replace(THERE, &address)))?;
        if answer != shown {
            return Err(format!("{command}\nanswers {answer}\nand not {shown}").into());
        }
        count += 1;
    }
    assert!(count >= 6, "only {count} command lines");
    Ok(())
}

fn the_python_recipe_runs() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, _, address) = serve(folder.path(), &["--http", "127.0.0.1:0"]);
    let code = block("python").join("\n").replace(THERE, &address);
    assert!(code.contains("assert"));
    printed(&Command::new("python3").args(["-c", &code]).output()?).map(drop)
}

fn the_javascript_recipe_runs() -> Outcome {
    let folder = tempfile::tempdir()?;
    let (_serve, ready, address) = serve(folder.path(), &["--web"]);
    process::ask(&mut connect(process::tcp(&ready, 0)), "@07\r", 1);
    let code = block("js").join("\n").replace(THERE, &address);
    let text = printed(&Command::new("node").args(["-e", &code]).output()?)?;
    assert!(text.starts_with("127.0.0.1:") && text.contains("@07  "), "{text}");
    Ok(())
}

/// The line for people, the end that is ordered there, and what is refused before anything starts.
fn it_listens_where_it_says() -> Outcome {
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    let (mut serve, _, address) = serve(folder, &["--web"]);
    let mut client = connect(&address);
    let quit = format!("POST /v1/quit HTTP/1.1\r\nHost: {address}\r\n\r\n");
    assert_eq!(process::ask(&mut client, &quit, 15), "HTTP/1.1 200 OK");
    assert_eq!(serve.end().0, Some(0));

    std::fs::write(folder.join("token.txt"), "0123456789abcdef\n")?;
    std::fs::write(folder.join("short.txt"), "secret\n")?;
    let open = ["serve", "--pty", "none", "--tcp", "none", "--http", "0.0.0.0:0"];
    let with = |more: &[&'static str]| {
        let arguments: Vec<&str> = open.iter().chain(more).copied().collect();
        run(folder, &arguments)
    };
    let (code, _, said) = with(&[]);
    assert!(code == 2 && said.contains("VIMC4_HTTP_TOKEN"), "{code} {said}");
    let (code, _, said) = with(&["--http-token", "short.txt"]);
    assert!(code == 2 && said.contains("at least 16"), "{code} {said}");
    let (code, _, said) = with(&["--http-token", "none.txt"]);
    assert!(code == 2 && said.contains("none.txt"), "{code} {said}");
    let (code, _, said) = with(&["--http-token", "token.txt", "--http", "nowhere"]);
    assert!(code == 2 && said.contains("nowhere"), "{code} {said}");
    let (code, said, _) = run(folder, &["serve", "--help"]);
    assert!(code == 0 && said.contains("--web"), "{said}");
    let (mut open, ready) = Process::serve(
        folder,
        &["--pty", "none", "--http", "0.0.0.0:0", "--http-token", "token.txt"],
    );
    assert!(ready["http"].as_str().is_some_and(|url| url.starts_with("http://0.0.0.0:")));
    open.give("quit\n");
    assert_eq!(open.end().0, Some(0));
    Ok(())
}

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some();
    let trial = |name: &str, tool: &str, test: fn() -> Outcome| {
        let missing = !tool.is_empty() && !has(&format!("{tool} >/dev/null 2>&1"));
        let name = if missing { format!("{name} (needs `{tool}`)") } else { name.to_owned() };
        Trial::test(name, test).with_ignored_flag(missing && !required)
    };
    let node = "node -e 'new WebSocket(\"ws://127.0.0.1:1\").onerror = () => {}'";
    let trials = vec![
        trial("curl_answers_as_shown", "curl --json x --version", curl_answers_as_shown),
        trial("the_python_recipe_runs", "python3 --version", the_python_recipe_runs),
        trial("the_javascript_recipe_runs", node, the_javascript_recipe_runs),
        trial("it_listens_where_it_says", "", it_listens_where_it_says),
    ];
    libtest_mimic::run(&arguments, trials).exit_code()
}
