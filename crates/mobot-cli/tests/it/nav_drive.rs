//! Driving to goals in simulated buildings, scored by what is true.

use mobot_cli::nav::{Drive, DriveParams, Goal, Outcome};
use occgrid::Pose2;
use rand::RngExt as _;

use crate::nav_worlds::{Ended, Score, Site, robot, runner, seeded, seeds, wrapped};

/// One mission: to a random goal of the building and with a random heading.
fn mission(site: &Site, camera: bool, seed: u64) -> (Ended, Score) {
    let mut rng = seeded(seed);
    let params = robot(&mut rng);
    let goal = site.place(&mut rng, 0.45);
    let heading = rng.random_range(-3.1..3.1);
    let goal = Pose2::new(goal.x, goal.y, heading);
    let (simulation, mut runner) = runner(site, params, camera, seed, &mut rng);
    let mut score = Score::new(&simulation);
    let mut drive = Drive::new(
        site.map.clone(),
        Goal::from(goal),
        DriveParams {
            budget: 400.0,
            ..DriveParams::default()
        },
    );
    let outcome = runner.run(&mut drive, &mut score, &|| false);
    let truth = simulation.truth();
    let ended = Ended {
        outcome,
        off: truth.map_from_base.position().distance(goal.position()),
        turned: wrapped(truth.map_from_base.theta - goal.theta).abs(),
        collisions: truth.collisions,
        clearance: truth.least_clearance,
        driven: truth.driven,
        time: truth.time,
    };
    (ended, score)
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values
        .get((last as f64 * share) as usize)
        .copied()
        .unwrap_or(f64::NAN)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The table of a world: what is asked and what came out.
fn table(name: &str, site: &Site, seeds: u64) -> [f64; 3] {
    let (mut reached, mut collisions) = (0, 0);
    let (mut errors, mut odometry, mut nees) = (Vec::new(), Vec::new(), Vec::new());
    let mut in_view = Vec::new();
    let (mut driven, mut time, mut clearance) = (0.0, 0.0, f64::INFINITY);
    let began = std::time::Instant::now();
    for seed in 0..seeds {
        let (ended, score) = mission(site, true, seed);
        let there = ended.outcome == Outcome::Done
            && ended.off <= 0.10
            && ended.turned <= 5.0_f64.to_radians();
        reached += u32::from(there && ended.collisions == 0);
        collisions += ended.collisions;
        if !there || ended.collisions > 0 {
            eprintln!("{name} seed {seed}: {ended:?}");
            eprintln!(
                "    used {:?}, refused {:?}",
                score.corrections, score.refused
            );
            for (at, event) in score.events.iter().take(30) {
                eprintln!("    {at:8.2} {event}");
            }
        }
        errors.extend(&score.errors);
        in_view.extend(&score.errors_in_view);
        odometry.push(score.odometry_errors.iter().copied().fold(0.0, f64::max));
        nees.push(mean(&score.nees));
        driven += ended.driven;
        time += ended.time;
        clearance = clearance.min(ended.clearance);
    }
    let share = 100.0 * f64::from(reached) / seeds as f64;
    let average = mean(&errors);
    let most = errors.iter().copied().fold(0.0, f64::max);
    eprintln!(
        "{name:8} reached {share:.0} % of {seeds}, contacts {collisions}, least room {clearance:.3} m; pose mean {:.1} cm, 95 % {:.1}, max {:.1}; with features in view {:.1}, {:.1}, {:.1}; odometry alone max {:.0} cm; mean NEES {:.2}; {driven:.0} m in {time:.0} s, {:.0} s of wall time",
        average * 100.0,
        quantile(&mut errors, 0.95) * 100.0,
        most * 100.0,
        mean(&in_view) * 100.0,
        quantile(&mut in_view, 0.95) * 100.0,
        quantile(&mut in_view, 1.0) * 100.0,
        odometry.iter().copied().fold(0.0, f64::max) * 100.0,
        mean(&nees),
        began.elapsed().as_secs_f64()
    );
    [share, collisions as f64, average]
}

fn goals_are_reached(name: &str) {
    let site = Site::without_people(name);
    let [share, collisions, _] = table(name, &site, seeds(1, 50));
    assert!(collisions == 0.0, "{name}");
    assert!(share >= 98.0, "{name}: {share} %");
}

#[test]
fn goals_are_reached_in_the_sketch() {
    goals_are_reached("sketch");
}

#[test]
fn goals_are_reached_in_the_office() {
    goals_are_reached("office");
}

#[test]
fn goals_are_reached_in_the_hall() {
    goals_are_reached("hall");
}
