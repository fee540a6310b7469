//! Why a cell is what it is.

use occgrid::{
    Cell, OccupancyGrid, Pose2, Profile, Reading, RefineParams, Refinement, Relation, Shot,
    SonarModel, explain,
};
use proptest::prelude::*;

use crate::sonar_score::empty_around;
use crate::sonar_world::{every, room, scan};

fn shot() -> impl Strategy<Value = Shot> {
    let reading = prop_oneof![
        6 => (0.0..3.0_f64).prop_map(|range| Reading::Echo { range }),
        2 => (0.5..3.0_f64).prop_map(|listened| Reading::NoEcho { listened }),
        1 => Just(Reading::TooClose),
        1 => Just(Reading::Fault),
    ];
    (
        -1.0..1.0_f64,
        -1.0..1.0_f64,
        -7.0..7.0_f64,
        -3.0..3.0_f64,
        reading,
    )
        .prop_map(|(x, y, theta, bearing, reading)| Shot {
            stamp: 0.0,
            map_from_base: Pose2::new(x, y, theta),
            bearing,
            reading,
        })
}

fn model() -> impl Strategy<Value = SonarModel> {
    (0.01..1.0_f64, 0.01..0.3_f64, any::<bool>()).prop_map(|(beam_width, sigma, literal)| {
        SonarModel {
            beam_width,
            sigma,
            mount: Pose2::new(0.1, -0.05, 0.3),
            profile: if literal {
                Profile::Literal
            } else {
                Profile::Smooth
            },
            ..SonarModel::default()
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn contributions_add_up_to_the_cell_exactly(
        model in model(), shots in prop::collection::vec(shot(), 1..40), picks in prop::collection::vec((0.0..1.0, 0.0..1.0), 20)
    ) {
        let mut grid = OccupancyGrid::new(0.1).expect("resolution");
        grid.integrate(&model, &shots).expect("shots are valid");
        let (w, h) = (f64::from(grid.frame().width()), f64::from(grid.frame().height()));
        for (u, v) in picks {
            let cell = Cell::new((u * w) as u32, (v * h) as u32);
            let found = explain(&grid, &model, &shots, cell).expect("shots are valid");
            let sum: f32 = found.iter().map(|c| c.log_odds).sum();
            prop_assert_eq!((sum + 0.0).to_bits(), (grid.log_odds()[grid.frame().index(cell)] + 0.0).to_bits());
            for pair in found.windows(2) {
                let [a, b] = [pair[0].log_odds.abs(), pair[1].log_odds.abs()];
                prop_assert!(a > b || (a.to_bits() == b.to_bits() && pair[0].shot < pair[1].shot));
            }
        }
    }
}

/// A shot along +x from the origin.
fn ahead(reading: Reading) -> Shot {
    Shot {
        stamp: 0.0,
        map_from_base: Pose2::default(),
        bearing: 0.0,
        reading,
    }
}

#[test]
fn relations_follow_the_geometry() {
    let model = SonarModel {
        sigma: 0.02,
        ..SonarModel::default()
    };
    let shots = [
        ahead(Reading::Echo { range: 1.0 }),
        ahead(Reading::NoEcho { listened: 2.0 }),
    ];
    let mut grid = OccupancyGrid::new(0.05).expect("resolution");
    grid.integrate(&model, &shots).expect("shots are valid");
    let at = |x: f64| {
        let cell = grid
            .frame()
            .cell_at(occgrid::Point2::new(x, 0.01))
            .expect("inside");
        explain(&grid, &model, &shots, cell).expect("shots are valid")
    };
    let passed = at(0.51);
    assert_eq!(passed.len(), 2);
    let echo = passed
        .iter()
        .find(|c| c.shot == 0)
        .expect("the echo says something");
    assert_eq!(echo.relation, Relation::InFront);
    assert!(echo.log_odds < 0.0 && (echo.range - 0.525).abs() < 0.01 && echo.offset.abs() < 0.06);
    let silence = passed
        .iter()
        .find(|c| c.shot == 1)
        .expect("silence says something");
    assert_eq!(silence.relation, Relation::InSilence);
    assert_eq!(at(0.99)[0].relation, Relation::AtEcho);
    assert!(
        at(1.51).iter().all(|c| c.shot == 1),
        "nothing is said beyond the echo"
    );
}

#[test]
fn refined_cells_are_explained_too() {
    let world = room(7);
    let shots = every(18, &scan(&world, 7));
    let empty = empty_around(&world, 0.1);
    let refined = Refinement::new(
        &shots,
        &SonarModel::default(),
        &empty,
        &RefineParams::default(),
    )
    .expect("shots are valid");
    let frame = *refined.grid().frame();
    let mut explained = 0;
    for k in 0..40 {
        let cell = Cell::new(frame.width() * (k % 7) / 7, frame.height() * k / 40);
        let sum: f64 = refined
            .explain(cell)
            .iter()
            .map(|c| f64::from(c.log_odds))
            .sum();
        let expected = refined.evidence(cell);
        assert!((sum - expected).abs() < 1e-4, "{cell:?}: {sum} {expected}");
        explained += usize::from(expected.abs() > 0.1);
    }
    assert!(
        explained > 5,
        "the cells that were looked at mean something"
    );
}
