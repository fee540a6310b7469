//! The `mobot` command: exit status 0 done, 1 the answer is "no", 2 bad input or usage.

use std::process::ExitCode;

use clap::Parser as _;
use mobot_cli::args::Cli;
use mobot_cli::output::Outcome;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            eprintln!("mobot: {}", one_line(&error.to_string()));
            return ExitCode::from(2);
        }
        // help and version
        Err(answer) => answer.exit(),
    };
    match mobot_cli::cmd::run(cli) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::No) => ExitCode::from(1),
        Err(error) => {
            // One line: the chain of causes, control characters of hostile names escaped.
            let line: String = format!("{error:#}")
                .chars()
                .flat_map(|c| {
                    let escaped: Vec<char> = if c.is_control() {
                        c.escape_default().collect()
                    } else {
                        vec![c]
                    };
                    escaped
                })
                .collect();
            eprintln!("mobot: {line}");
            ExitCode::from(2)
        }
    }
}

/// The message of a usage error without its hints, in one line.
fn one_line(message: &str) -> String {
    let lines = message.lines().take_while(|line| !line.trim().is_empty());
    let words: Vec<&str> = lines.map(str::trim).collect();
    let text = words.join(" ");
    format!("{} (see --help)", text.trim_start_matches("error: "))
}
