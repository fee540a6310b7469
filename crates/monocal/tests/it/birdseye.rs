//! The floor from above: squares come out square.

use image::{GrayImage, ImageBuffer, Luma, Rgb};
use monocal::{
    BirdseyeParams, CameraMatrix, Distortion, FloorCamera, FloorHomography, GroundPoint, Lens,
    PixelPoint, birdseye,
};

use crate::pinhole::Pinhole;

/// A floor of squares of 0.5 m, seen through a lens.
fn floor(truth: &Pinhole, lens: Option<&Lens>, [width, height]: [u32; 2]) -> GrayImage {
    ImageBuffer::from_fn(width, height, |column, row| {
        let pixel = PixelPoint::new(f64::from(column), f64::from(row));
        let ideal = lens.map_or(Some(pixel), |lens| lens.undistort(pixel));
        let seen = ideal.and_then(|p| truth.floor(p.into()));
        Luma([seen.map_or(0, shade)])
    })
}

fn shade([x, y]: [f64; 2]) -> u8 {
    let odd = ((x / 0.5).floor() + (y / 0.5).floor()).rem_euclid(2.0) > 0.5;
    if odd { 220 } else { 90 }
}

#[test]
fn squares_come_out_square_through_a_lens_too() {
    let truth = Pinhole {
        center: [319.5, 239.5],
        ..Pinhole::paper()
    };
    let matrix = CameraMatrix {
        fx: 450.0,
        fy: 450.0,
        cx: 319.5,
        cy: 239.5,
    };
    let bent = Lens::new(
        matrix,
        Distortion::PlumbBob([-0.2, 0.02, 0.001, -0.001, 0.0]),
    )
    .unwrap();
    for lens in [None, Some(bent)] {
        let frame = floor(&truth, lens.as_ref(), [640, 480]);
        let camera = FloorCamera {
            lens,
            image_size: Some([640, 480]),
            ..FloorCamera::exact(FloorHomography::new(truth.pixel_to_floor()).unwrap())
        };
        let params = BirdseyeParams {
            near: 1.5,
            far: 3.5,
            left: 0.75,
            right: -0.75,
            metres_per_pixel: 0.01,
        };
        let above = birdseye(&frame, &camera, &params).unwrap();
        assert_eq!(above.picture.dimensions(), (150, 200));
        assert!(above.origin.distance(GroundPoint::new(3.495, 0.745)) < 1e-9);
        let (mut right, mut all) = (0, 0);
        for (column, row, pixel) in above.picture.enumerate_pixels() {
            let x = above.origin.x - 0.01 * f64::from(row);
            let y = above.origin.y - 0.01 * f64::from(column);
            if camera
                .pixel_of(GroundPoint::new(x, y))
                .is_none_or(|p| !(0.0..639.0).contains(&p.u) || !(0.0..479.0).contains(&p.v))
            {
                continue;
            }
            all += 1;
            right += usize::from(pixel.0[0].abs_diff(shade([x, y])) < 40);
        }
        // pixels on the borders of squares are mixed
        assert!(all > 25_000 && right * 100 > all * 93, "{right} of {all}");
    }
}

#[test]
fn blank_where_the_camera_does_not_see_and_colours_stay() {
    let truth = Pinhole::paper();
    let frame = ImageBuffer::from_pixel(480, 220, Rgb([10_u8, 200, 30]));
    let camera = FloorCamera::exact(FloorHomography::new(truth.pixel_to_floor()).unwrap());
    let params = BirdseyeParams {
        near: -1.0,
        far: 4.0,
        left: 3.0,
        right: -3.0,
        metres_per_pixel: 0.05,
    };
    let above = birdseye(&frame, &camera, &params).unwrap();
    let at = |x: f64, y: f64| {
        let column = ((above.origin.y - y) / 0.05).round() as u32;
        let row = ((above.origin.x - x) / 0.05).round() as u32;
        above.picture.get_pixel(column, row).0
    };
    assert_eq!(at(3.0, 0.0), [10, 200, 30]);
    assert_eq!(at(-0.5, 0.0), [0, 0, 0], "behind the camera");
    assert_eq!(at(2.0, 2.5), [0, 0, 0], "beside the picture");
}

#[test]
fn the_view_s_own_region_is_found() {
    let camera =
        FloorCamera::exact(FloorHomography::new(Pinhole::paper().pixel_to_floor()).unwrap());
    let params = BirdseyeParams::of_view(&camera, [480, 220], 0.05, 2000).unwrap();
    assert!(
        (params.near - 1.0 / (24f64.to_radians() + (110.0_f64 / 450.0).atan()).tan()).abs() < 0.1,
        "{params:?}"
    );
    assert!((4.0..5.0).contains(&params.far), "{params:?}");
    assert!(params.left > 1.0 && params.right < -1.0, "{params:?}");
    let sky = Pinhole {
        tilt: -0.6,
        ..Pinhole::paper()
    };
    let sky = FloorCamera::exact(FloorHomography::new(sky.pixel_to_floor()).unwrap());
    assert_eq!(BirdseyeParams::of_view(&sky, [480, 220], 0.05, 2000), None);
}

#[test]
fn impossible_floors_are_refused() {
    let camera =
        FloorCamera::exact(FloorHomography::new(Pinhole::paper().pixel_to_floor()).unwrap());
    let frame = GrayImage::new(8, 8);
    let good = BirdseyeParams {
        near: 1.0,
        far: 2.0,
        left: 1.0,
        right: -1.0,
        metres_per_pixel: 0.01,
    };
    for bad in [
        BirdseyeParams { far: 0.5, ..good },
        BirdseyeParams {
            left: f64::NAN,
            ..good
        },
        BirdseyeParams {
            metres_per_pixel: 0.0,
            ..good
        },
        BirdseyeParams {
            metres_per_pixel: -0.01,
            ..good
        },
        BirdseyeParams {
            metres_per_pixel: 1e-6,
            ..good
        },
        BirdseyeParams {
            far: f64::INFINITY,
            ..good
        },
    ] {
        assert!(birdseye(&frame, &camera, &bad).is_err(), "{bad:?}");
    }
    assert!(
        birdseye(&GrayImage::new(0, 0), &camera, &good).is_ok(),
        "all black"
    );
}
