//! A program with a guarded base that does what it is told on standard input, and says what came of it.

use std::io::BufRead as _;

use mobot_hw::guard::{BaseKind, GuardedBase};
use mobot_hw::serial::{ArduinoParams, Create2Params, KobukiParams, arduino, create2, kobuki};
use mobot_hw::{Clock as _, DeviceError as _, DifferentialDrive as _, SystemClock, Twist2};

fn kind(name: &str) -> (BaseKind, u32) {
    match name {
        "create2" => (BaseKind::Create2(Create2Params::default()), create2::BAUD),
        "kobuki" => (BaseKind::Kobuki(KobukiParams::default()), kobuki::BAUD),
        "arduino" => (BaseKind::Arduino(ArduinoParams::default()), arduino::BAUD),
        _ => panic!("{name}"),
    }
}

pub(crate) fn obey(arguments: &[String]) {
    let [name, port] = arguments else {
        panic!("{arguments:?}");
    };
    let executable = std::env::current_exe().expect("this executable");
    let (clock, (kind, baud)) = (SystemClock::start(), kind(name));
    let mut base = match GuardedBase::spawn(&executable, port, baud, &kind, clock) {
        Ok(base) => base,
        Err(error) => return println!("fault {:?} {error}", error.kind()),
    };
    println!("ready {}", base.guard_id());
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("a line");
        let words: Vec<&str> = line.split(' ').collect();
        let result = match words[..] {
            ["drive", linear, angular] => {
                let number = |word: &str| word.parse().expect("a number");
                base.drive(Twist2::new(number(linear), number(angular)))
                    .map(|()| "done".to_owned())
            }
            ["stop"] => base.stop().map(|()| "done".to_owned()),
            ["status"] => base
                .status()
                .map(|s| format!("{} {}", s.travel.left, clock.now() - s.stamp)),
            ["panic"] => panic!("as told"),
            ["abort"] => std::process::abort(),
            _ => panic!("{line}"),
        };
        match result {
            Ok(text) => println!("{text}"),
            Err(error) => println!("fault {:?} {error}", error.kind()),
        }
    }
}
