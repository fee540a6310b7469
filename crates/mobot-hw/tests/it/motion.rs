//! Dead reckoning.

use mobot_hw::{Odometry, Twist2, WheelTravel};
use occgrid::Pose2;

#[test]
fn wheels_and_twists_are_each_others_inverse() {
    let twist = Twist2::new(0.3, -1.2);
    let again = Twist2::from_wheels(twist.wheels(0.25), 0.25);
    assert!((again.linear - 0.3).abs() < 1e-15 && (again.angular + 1.2).abs() < 1e-15);
    assert!(!Twist2::new(f64::NAN, 0.0).is_finite());
}

#[test]
fn odometry_follows_exact_arcs_however_they_are_cut() {
    // a quarter circle of radius 1 to the left, wheels 0.2 apart
    let quarter = std::f64::consts::FRAC_PI_2;
    for steps in [1, 7, 1000] {
        let mut odometry = Odometry::new(Pose2::new(1.0, 2.0, 0.0), 0.2);
        for k in 0..=steps {
            let share = quarter * f64::from(k) / f64::from(steps);
            odometry.update(WheelTravel {
                left: 5.0 + 0.9 * share,
                right: -3.0 + 1.1 * share,
            });
        }
        let pose = odometry.pose();
        assert!(
            (pose.x - 2.0).abs() < 1e-9 && (pose.y - 3.0).abs() < 1e-9,
            "{pose:?}"
        );
        assert!((pose.theta - quarter).abs() < 1e-9);
    }
}
