//! From a camera frame of 640 x 480 to a pose, the whole way. The pose is compared with where the frame was taken
//! before it is timed.

use criterion::{Criterion, criterion_group, criterion_main};
use mobot_benches::view::View;
use mobot_hw::sim::Distortion;
use monocal::FixStatus;

/// A webcam's barrel.
const BARREL: Distortion = Distortion::PlumbBob {
    coefficients: [-0.32, 0.12, 0.0008, -0.0006, 0.0],
};

fn frame_to_pose(c: &mut Criterion) {
    for (name, distortion) in [
        ("frame_to_pose", Distortion::None),
        ("frame_to_pose_lens", BARREL),
    ] {
        let mut view = View::corridor(distortion);
        let fix = view.locate();
        let [off, turned] = view.error(&fix);
        assert_eq!(fix.status, FixStatus::Ok, "{fix:?}");
        assert!(off < 0.03 && turned < 0.01, "{off} m, {turned} rad");
        c.bench_function(name, |b| b.iter(|| view.locate()));
    }
}

criterion_group!(benches, frame_to_pose);
criterion_main!(benches);
