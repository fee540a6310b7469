//! The `mobot` command: exit status 0 done, 1 the answer is "no", 2 bad input or usage.

use std::process::ExitCode;

use clap::Parser as _;
use mobot_cli::args::Cli;
use mobot_cli::output::Outcome;

fn main() -> ExitCode {
    match mobot_cli::cmd::run(Cli::parse()) {
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
