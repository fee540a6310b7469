//! Lines from stdin without waiting for them.

use std::io::Read as _;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Longest line that is kept [bytes].
const LONGEST: usize = 1000;

/// Stdin, until it ends. From a terminal only while this program is in its foreground: reading in the
/// background would stop it.
#[derive(Debug, Default)]
pub(super) struct Commands {
    ended: bool,
    begun: Vec<u8>,
}

impl Commands {
    /// The lines that came within `patience`.
    pub(super) fn wait(&mut self, patience: Duration) -> Vec<String> {
        if self.ended || in_background() {
            std::thread::sleep(patience);
            return Vec::new();
        }
        let mut stdin = std::io::stdin().lock();
        let mut watched = [PollFd::new(&stdin, PollFlags::IN)];
        let timeout = Timespec::try_from(patience).ok();
        // an interrupted wait is over early
        if poll(&mut watched, timeout.as_ref()).unwrap_or(0) == 0 {
            return Vec::new();
        }
        let mut bytes = [0; LONGEST];
        match stdin.read(&mut bytes) {
            Ok(read @ 1..) => self.begun.extend(&bytes[..read]),
            _ => self.ended = true,
        }
        let mut lines = Vec::new();
        while let Some(end) = self.begun.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.begun.drain(..=end).collect();
            let text = String::from_utf8_lossy(&line).trim().to_owned();
            if !text.is_empty() {
                lines.push(text);
            }
        }
        // what is longer is no command
        self.begun.truncate(LONGEST);
        lines
    }
}

fn in_background() -> bool {
    let stdin = std::io::stdin();
    rustix::termios::isatty(&stdin)
        && rustix::termios::tcgetpgrp(&stdin).is_ok_and(|front| front != rustix::process::getpgrp())
}
