//! Any bytes as a run log: entries, or one line that says what is wrong, never more than the bytes hold.
#![no_main]

use libfuzzer_sys::fuzz_target;
use mobot_cli::run_log::{LogReader, Message};
use mobot_fuzz::one_line;

fuzz_target!(|data: &[u8]| {
    // most bytes go to what comes behind the magic
    let mut file = b"\x89MCAP0\r\n".to_vec();
    file.extend_from_slice(data);
    let mut held = 0;
    for entry in LogReader::new(&file[..]).expect("the magic is there") {
        match entry {
            Ok(entry) => {
                if let Message::Frame(frame) = &entry.message {
                    held += frame.data.len();
                }
            }
            Err(error) => one_line(&error),
        }
    }
    assert!(held <= file.len());
});
