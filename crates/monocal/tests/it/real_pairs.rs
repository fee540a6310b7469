//! Other people's cameras and marks.

use monocal::{CalibrateParams, CameraInfo, Pair, calibrate};

use crate::csv::{lines, numbers, testdata};

fn groups(name: &str) -> Vec<(String, Vec<Vec<f64>>)> {
    let mut groups: Vec<(String, Vec<Vec<f64>>)> = Vec::new();
    for row in lines(name, true) {
        if groups.last().is_none_or(|g| g.0 != row[0]) {
            groups.push((row[0].clone(), Vec::new()));
        }
        groups
            .last_mut()
            .expect("by construction")
            .1
            .push(numbers(&row[1..]));
    }
    groups
}

fn pairs(rows: &[Vec<f64>]) -> Vec<Pair> {
    rows.iter()
        .map(|n| Pair::new([n[0], n[1]], [n[2], n[3]]))
        .collect()
}

/// Points on a corridor's floor, found by others in two views, up to 40 units away; what the published
/// cameras see is the truth.
#[test]
fn a_corridor_s_floor_is_where_its_published_cameras_see_it() {
    for (view, rows) in groups("calibration/vgg-corridor.csv") {
        let params = CalibrateParams {
            image_size: Some([512, 512]),
            ..CalibrateParams::default()
        };
        let found = calibrate(&pairs(&rows), &params).unwrap();
        println!(
            "{view}: {} pairs, outliers {:?}, {:.2} px, residual {:?}, held out {:?}",
            rows.len(),
            found.outliers,
            found.pixel_sigma_px,
            found.residual,
            found.held_out
        );
        assert!(found.outliers.len() <= 3, "{view}: {:?}", found.outliers);
        assert!(
            found.pixel_sigma_px < 0.5,
            "{view}: {}",
            found.pixel_sigma_px
        );
        let mut offs = Vec::new();
        for (row, error) in rows.iter().zip(&found.errors) {
            if error.fits {
                let seen = found.camera.pixel_of([row[2], row[3]].into()).unwrap();
                let off = (seen.u - row[4]).hypot(seen.v - row[5]);
                offs.push(off);
            }
        }
        offs.sort_by(f64::total_cmp);
        println!(
            "{view}: off by {:.2} px (median), {:.2} px at most",
            offs[offs.len() / 2],
            offs[offs.len() - 1]
        );
        assert!(
            offs[offs.len() / 2] < 0.3 && offs[offs.len() - 1] < 1.0,
            "{view}: {offs:?}"
        );
    }
}

#[test]
fn chessboards_lie_as_flat_as_opencv_finds_them_once_the_lens_is_undone() {
    let theirs = lines("golden/flatness.csv", false);
    let mut theirs = theirs
        .iter()
        .map(|row| (row[0].as_str(), row[1].parse::<f64>().unwrap()));
    let (mut compared, mut better) = (0, 0);
    for name in ["chessboard", "udacity"] {
        let info = CameraInfo::load(&testdata(&format!("calibration/{name}.yaml"))).unwrap();
        for (picture, rows) in &groups(&format!("calibration/{name}.csv")) {
            let (of, rms) = theirs.next().unwrap();
            assert_eq!(of, name);
            let pairs = pairs(rows);
            let with = CalibrateParams {
                lens: Some(info.lens),
                image_size: Some(info.image_size),
                ..CalibrateParams::default()
            };
            let with = calibrate(&pairs, &with).unwrap();
            let without = calibrate(&pairs, &CalibrateParams::default());
            let without_px = without.as_ref().map_or(f64::INFINITY, |w| w.pixel_sigma_px);
            better += usize::from(with.pixel_sigma_px < without_px);
            let squared: f64 = with
                .errors
                .iter()
                .map(|e| e.pixel[0].powi(2) + e.pixel[1].powi(2))
                .sum();
            let ours = (squared / (2.0 * pairs.len() as f64)).sqrt();
            println!(
                "{picture}: {ours:.4} px, OpenCV {rms:.4}; without the lens {without_px:.2}; outliers {:?}",
                with.outliers
            );
            assert!(with.outliers.len() <= 1, "{picture}: {:?}", with.outliers);
            if with.outliers.is_empty() {
                compared += 1;
                // the noise of a picture's point is undone with its lens, so the weights differ a little
                assert!((ours - rms).abs() < 0.01 * rms, "{picture}: {ours} {rms}");
            }
        }
    }
    assert!(theirs.next().is_none());
    assert!(
        compared >= 20 && better >= 21,
        "{compared} compared, {better} better with the lens"
    );
}

#[test]
fn a_cloth_under_a_fisheye_is_metric() {
    let info = CameraInfo::load(&testdata("calibration/floor-cloth.yaml")).unwrap();
    let rows: Vec<Vec<f64>> = lines("calibration/floor-cloth.csv", true)
        .iter()
        .map(|r| numbers(r))
        .collect();
    let params = CalibrateParams {
        lens: Some(info.lens),
        image_size: Some(info.image_size),
        ..CalibrateParams::default()
    };
    let found = calibrate(&pairs(&rows), &params).unwrap();
    // the pairs are exact by the published projection: the fit is too, through the fisheye
    assert!(found.residual.max < 1e-6, "{:?}", found.residual);
    assert!(found.outliers.is_empty());
    let geometry = found.camera.geometry().unwrap();
    println!("{geometry:?}");
    assert!((0.3..1.5).contains(&geometry.height), "{geometry:?}");
}
