//! The grid: growth, order, footprint, bounds.

use occgrid::{OccupancyGrid, Pose2, Reading, Shot, SonarModel};

fn shot(x: f64, y: f64, theta: f64, reading: Reading) -> Shot {
    Shot { stamp: 0.0, map_from_base: Pose2::new(x, y, theta), bearing: 0.0, reading }
}

#[test]
fn an_echo_marks_its_place_and_clears_the_way() {
    let mut grid = OccupancyGrid::new(0.25).expect("a valid resolution");
    grid.update(&SonarModel::default(), &shot(0.125, 0.125, 0.0, Reading::Echo { range: 2.0 }))
        .expect("a valid shot");
    let at = |x: f64| {
        let cell = grid.frame().cell_at(occgrid::Point2::new(x, 0.125)).expect("inside");
        grid.probability(cell)
    };
    assert!((at(0.625) - 0.4).abs() < 1e-3);
    assert!(at(2.125) > 0.8);
    assert!((at(3.125) - 0.5).abs() < 1e-6);
}
