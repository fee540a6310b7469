//! A healthy guarded base; guards that die; ports that vanish.

use std::sync::{Arc, Mutex};

use mobot_hw::emulate::{Emulator, LineFaults, RobotView};
use mobot_hw::serial::create2::drive_direct;
use rustix::process::Signal;

use crate::stage::{BASES, Program, Stage, emulation, pause, signal_to};

pub(crate) fn drives_as_without_a_guard() {
    for base in BASES {
        let stage = Stage::new(base);
        let mut program = stage.program();
        stage.drives(&mut program, 0.5);
        let answer = program.asked("status");
        let numbers: Vec<f64> = answer.split(' ').flat_map(str::parse).collect();
        let [travel, age] = numbers[..] else {
            panic!("{base}: {answer}");
        };
        assert!((0.01..0.2).contains(&travel), "{base}: {answer}");
        assert!((0.0..0.05).contains(&age), "{base}: {answer}");

        let time = stage.base.elapsed();
        assert_eq!(program.asked("drive nan 0"), "done");
        assert!(
            stage.stopped_after(time).is_some_and(|t| t < 0.05),
            "{base}"
        );
        for _ in 0..30 {
            program.asked("drive 7 0");
            pause(0.03);
        }
        assert!(
            (stage.speed() - 0.5).abs() < 0.01,
            "{base}: {}",
            stage.speed()
        );
        let time = stage.base.elapsed();
        assert_eq!(program.asked("stop"), "done");
        assert!(stage.stopped_after(time).is_none_or(|t| t < 0.05));

        // the answer comes when the base has the command
        let mut waits: Vec<f64> = (0..40)
            .map(|_| {
                let time = stage.base.elapsed();
                program.asked("drive 0.1 0.1");
                stage.base.elapsed() - time
            })
            .collect();
        waits.sort_by(f64::total_cmp);
        println!(
            "{base}: a command takes {:.1} ms, at worst {:.1} ms",
            waits[20] * 1000.0,
            waits[39] * 1000.0
        );
        assert!(waits[20] < 0.03, "{waits:?}");
    }
}

pub(crate) fn a_guard_that_is_killed() {
    for base in BASES {
        let stage = Stage::new(base);
        let mut program = stage.program();
        stage.drives(&mut program, 0.1);
        let time = stage.base.elapsed();
        signal_to(program.guard, Signal::KILL);
        if let Some(after) = stage.stopped_after(time) {
            println!(
                "{base}: a second guard stops it after {:.1} ms",
                after * 1000.0
            );
            assert!(after < 0.25, "{base}: {after}");
        }
        for order in ["drive 0.1 0", "status", "stop"] {
            let answer = program.asked(order);
            assert!(answer.starts_with("fault Unplugged"), "{base}: {answer}");
        }
        pause(0.3);
        assert!(stage.speed() < 1e-9);
    }
}

pub(crate) fn a_guard_that_freezes() {
    let stage = Stage::new("create2");
    let mut program = stage.program();
    stage.drives(&mut program, 0.1);
    let time = stage.base.elapsed();
    signal_to(program.guard, Signal::STOP);
    let answer = program.asked("drive 0.1 0");
    assert!(answer.starts_with("fault Unplugged"), "{answer}");
    assert!(stage.stopped_after(time).is_none_or(|t| t < 0.8));
}

/// A device that keeps what it hears.
struct Heard(Arc<Mutex<Vec<u8>>>);

impl Emulator for Heard {
    fn step(&mut self, bytes: &[u8], _robot: &mut RobotView) -> Vec<u8> {
        self.0.lock().expect("bytes").extend(bytes);
        Vec::new()
    }
}

pub(crate) fn a_port_that_vanishes() {
    let unplugged = LineFaults {
        unplugged: true,
        ..LineFaults::default()
    };
    for program_lives in [true, false] {
        let stage = Stage::new("create2");
        let mut program = stage.program();
        stage.drives(&mut program, 0.1);
        stage.base.set_faults(0, unplugged);
        pause(0.1);
        if program_lives {
            for order in ["drive 0.1 0", "status", "stop"] {
                let answer = program.asked(order);
                assert!(answer.starts_with("fault Unplugged"), "{answer}");
            }
        } else {
            program.signal(Signal::KILL);
            program.waits_for_its_end();
            pause(0.2);
        }
        // it comes back as another terminal to which the stable name leads: stops come first
        let heard = Arc::new(Mutex::new(Vec::new()));
        let back = emulation(Box::new(Heard(Arc::clone(&heard))));
        stage.leads_to(back.path(0));
        pause(0.5);
        let heard = heard.lock().expect("bytes").clone();
        assert!(heard.starts_with(&drive_direct(0, 0)), "{heard:?}");
        if program_lives {
            let answer = program.asked("drive 0.1 0");
            assert!(answer.starts_with("fault Unplugged"), "{answer}");
        }
    }
}

pub(crate) fn a_base_that_is_silent() {
    for base in BASES {
        let stage = Stage::new(base);
        let mut program = stage.program();
        stage.drives(&mut program, 0.1);
        let silent = LineFaults {
            silent: true,
            ..LineFaults::default()
        };
        stage.base.set_faults(0, silent);
        pause(0.05);
        let time = stage.base.elapsed();
        let answer = program.asked("status");
        let took = stage.base.elapsed() - time;
        assert!(
            answer.starts_with("fault Silent") || answer.starts_with("fault Garbled"),
            "{base}: {answer}"
        );
        assert!(took < 0.5, "{base}: {took}");
        // and it is stopped as soon as it hears again
        stage.base.set_faults(0, LineFaults::default());
        let time = stage.base.elapsed();
        assert!(stage.stopped_after(time).is_none_or(|t| t < 0.5), "{base}");
    }
}

pub(crate) fn a_base_that_is_not_there() {
    let stage = Stage::new("create2");
    let answer = Program::try_start("create2", "/nowhere/at all").hears();
    assert!(answer.starts_with("fault System"), "{answer}");
    // a Create 2 is no Kobuki
    let answer = Program::try_start("kobuki", stage.port()).hears();
    assert!(answer.starts_with("fault Silent"), "{answer}");
}
