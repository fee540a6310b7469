//! The guard against emulated bases, in real time. This executable is three things: the guard
//! (`guard ...`), a program that drives a base through one (`program ...`), and the tests that kill, freeze and
//! unplug these two. Words on its command line choose the tests whose names contain one of them.

#![expect(
    clippy::print_stdout,
    reason = "its processes talk over standard output"
)]

mod ends;
mod faults;
mod program;
mod stage;
mod stalls;

fn main() {
    let mut arguments = std::env::args().skip(1).peekable();
    match arguments.peek().map(String::as_str) {
        Some("guard") => mobot_hw::guard::run(arguments.skip(1)).expect("a guard"),
        Some("program") => program::obey(&arguments.skip(1).collect::<Vec<_>>()),
        _ => test(&arguments.collect::<Vec<_>>()),
    }
}

fn test(words: &[String]) {
    stalls::watch();
    let chosen: Vec<&String> = words.iter().filter(|w| !w.starts_with('-')).collect();
    let tests: [(&str, fn()); 11] = [
        (
            "drives_as_without_a_guard",
            faults::drives_as_without_a_guard,
        ),
        ("killed", ends::killed),
        ("frozen", ends::frozen),
        ("not_renewed", ends::not_renewed),
        ("panicked_or_aborted", ends::panicked_or_aborted),
        ("told_to_end_by_signals", ends::told_to_end_by_signals),
        ("a_guard_that_is_killed", faults::a_guard_that_is_killed),
        ("a_guard_that_freezes", faults::a_guard_that_freezes),
        ("a_port_that_vanishes", faults::a_port_that_vanishes),
        ("a_base_that_is_silent", faults::a_base_that_is_silent),
        ("a_base_that_is_not_there", faults::a_base_that_is_not_there),
    ];
    for (name, test) in tests {
        if chosen.is_empty() || chosen.iter().any(|word| name.contains(*word)) {
            test();
            println!("guard: {name} ... ok");
        }
    }
}
