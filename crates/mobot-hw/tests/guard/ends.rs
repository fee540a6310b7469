//! Whatever ends the program, or keeps it from its work, the base is told to stop in time.

use std::time::Instant;

use rustix::process::Signal;

use crate::stage::{BASES, Program, Stage, pause, signal_to, trials};
use crate::stalls;

/// From the end of the program to the stop at the base [s].
const AFTER_DEATH: f64 = 0.05;
/// From the last command, or a freeze, to the stop at the base [s].
const AFTER_SILENCE: f64 = 0.25;
/// A guard that has seen the wheels stand for 0.1 s ends; they brake for as long.
const GUARD_ENDS: f64 = 0.4;

/// How many stages one base has side by side.
const LANES: usize = 4;

/// Runs trials on all bases side by side. `trial` gives the time to the stop [s]. Where it gives none, the
/// machine was too busy for it, and there is another one.
fn measure(
    name: &str,
    trials: usize,
    bar: f64,
    trial: impl Fn(&Stage, usize, &mut Option<Program>) -> Option<f64> + Sync,
) {
    let lane = |base, lane| -> Vec<f64> {
        let stage = Stage::new(base);
        let mut program = None;
        let mine = (lane..trials).step_by(LANES);
        let mut counts = |k| (0..20).find_map(|_| trial(&stage, k, &mut program));
        mine.map(|k| counts(k).expect("a machine that runs"))
            .collect()
    };
    let lane = &lane;
    let times = std::thread::scope(|scope| {
        let lanes = BASES
            .map(|base| std::array::from_fn::<_, LANES, _>(|k| scope.spawn(move || lane(base, k))));
        lanes.map(|lanes| {
            let done = lanes.map(|lane| lane.join().expect("trials"));
            done.concat()
        })
    });
    for (base, mut times) in BASES.into_iter().zip(times) {
        times.sort_by(f64::total_cmp);
        let (middle, worst) = (times[trials / 2], times[trials - 1]);
        let late = times.iter().filter(|t| **t > bar).count();
        println!(
            "{name}, {base}: {trials} trials, {late} over {:.0} ms; median {:.1} ms, worst {:.1} ms",
            bar * 1000.0,
            middle * 1000.0,
            worst * 1000.0
        );
        assert_eq!(late, 0, "{name}, {base}: {times:?}");
    }
}

/// Has the base driven, until up to 40 ms after a command.
fn driven(stage: &Stage, program: &mut Program, k: usize) {
    stage.drives(program, 0.03);
    program.say("drive 0.1 0");
    pause(0.001 * (k / LANES % 40) as f64);
}

/// A new program that drives; it is ended somewhere between two commands, and it counts where `end` says so.
fn ended(stage: &Stage, k: usize, end: impl Fn(&mut Program) -> bool) -> Option<f64> {
    let mut program = stage.program();
    driven(stage, &mut program, k);
    let time = stage.base.elapsed();
    let counts = end(&mut program);
    let after = stage.stopped_after(time);
    drop(program);
    pause(GUARD_ENDS);
    after.filter(|_| counts)
}

pub(crate) fn killed() {
    measure("killed", trials(20, 1000), AFTER_DEATH, |stage, k, _| {
        ended(stage, k, |program| {
            program.signal(Signal::KILL);
            let killed = Instant::now();
            program.waits_for_its_end();
            // its pipe is closed by the kernel, which may be busy with something else
            !stalls::is_one(killed.elapsed())
        })
    });
}

pub(crate) fn panicked_or_aborted() {
    measure("panicked", trials(8, 200), AFTER_DEATH, |stage, k, _| {
        ended(stage, k, |program| {
            program.say("panic");
            true
        })
    });
    measure("aborted", trials(8, 200), AFTER_DEATH, |stage, k, _| {
        ended(stage, k, |program| {
            program.say("abort");
            true
        })
    });
}

/// Ctrl-C goes to a terminal's group, a service's end to all its processes.
pub(crate) fn told_to_end_by_signals() {
    measure("interrupted", trials(8, 200), AFTER_DEATH, |stage, k, _| {
        ended(stage, k, |program| {
            program.signal_group(Signal::INT);
            true
        })
    });
    measure(
        "terminated, guard too",
        trials(8, 200),
        AFTER_DEATH,
        |stage, k, _| {
            ended(stage, k, |program| {
                signal_to(program.guard, Signal::TERM);
                program.signal(Signal::TERM);
                true
            })
        },
    );
}

pub(crate) fn frozen() {
    measure(
        "frozen",
        trials(20, 1000),
        AFTER_SILENCE,
        |stage, k, program| {
            let program = program.get_or_insert_with(|| stage.program());
            driven(stage, program, k);
            let time = stage.base.elapsed();
            program.signal(Signal::STOP);
            let after = stage.stopped_after(time);
            program.signal(Signal::CONT);
            after
        },
    );
}

pub(crate) fn not_renewed() {
    measure(
        "not renewed",
        trials(20, 1000),
        AFTER_SILENCE,
        |stage, k, program| {
            let program = program.get_or_insert_with(|| stage.program());
            stage.drives(program, 0.03);
            pause(0.001 * (k % 40) as f64);
            let time = stage.base.elapsed();
            program.say("drive 0.1 0");
            let after = stage.stopped_after(time);
            assert!(
                after.is_none_or(|t| t > 0.19),
                "stopped after {after:?} s already"
            );
            after
        },
    );
}
