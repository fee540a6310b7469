//! The simulated camera against OpenCV's projections, an independent model of the buildings, and its own
//! geometry to hundredths of a pixel.

use mobot_hw::sim::{
    Block, Building, CameraModel, CameraModelError, CornerKind, Distortion, Look, Renderer, World,
};
use occgrid::{Point2, Pose2};

use crate::files::{building, rows};

/// No noise, no blur, no vignetting: light as it is.
const PLAIN: Look = Look {
    exposure: 1.0,
    gamma: 1.0,
    noise: 0.0,
    blur_px: 0.0,
    vignetting: 0.0,
};

#[test]
fn points_are_seen_where_opencv_sees_them() {
    let golden = rows(
        include_str!("../../../../testdata/golden/sim_pixels.csv"),
        1,
    );
    assert_eq!(golden.len(), 360);
    for (kind, n) in &golden {
        let d = [n[4], n[5], n[6], n[7], n[8]];
        let camera = CameraModel {
            fx: n[0],
            fy: n[1],
            cx: n[2],
            cy: n[3],
            distortion: match kind[0].as_str() {
                "none" => Distortion::None,
                "plumb_bob" => Distortion::PlumbBob { coefficients: d },
                _ => Distortion::Fisheye {
                    coefficients: [d[0], d[1], d[2], d[3]],
                },
            },
            mount_height: n[9],
            mount_x: n[10],
            mount_y: n[11],
            yaw: n[12],
            tilt: n[13],
            roll: n[14],
            ..CameraModel::paper()
        };
        let base = Pose2::new(n[15], n[16], n[17]);
        let [u, v] = camera
            .pixel_of(base, Point2::new(n[18], n[19]), n[20])
            .unwrap();
        assert!(
            (u - n[21]).abs() < 1e-6 && (v - n[22]).abs() < 1e-6,
            "{kind:?}: ({u}, {v}), OpenCV ({}, {})",
            n[21],
            n[22]
        );
    }
}

/// White floor under even light, everything else dark.
fn floor_alone(name: &str) -> World {
    let mut building = building(name);
    building.people.clear();
    building.lamps.clear();
    building.ambient = 1.0;
    building.floor = mobot_hw::sim::Floor {
        brightness: 1.0,
        ..Default::default()
    };
    for wall in &mut building.walls {
        wall.brightness = 0.2;
        wall.posters.clear();
        for door in &mut wall.doors {
            (door.brightness, door.frame_brightness) = (0.2, 0.2);
        }
    }
    building.boxes.iter_mut().for_each(|b| b.brightness = 0.2);
    building
        .cylinders
        .iter_mut()
        .for_each(|c| c.brightness = 0.2);
    World::new(&building).expect("a world")
}

#[test]
fn floor_shows_where_an_independent_model_sees_it() {
    let golden = rows(include_str!("../../../../testdata/golden/sim_floor.csv"), 2);
    let mut renderers = [
        Renderer::new(CameraModel::paper(), PLAIN).unwrap(),
        Renderer::new(CameraModel::vga(), PLAIN).unwrap(),
    ];
    let mut image = image::GrayImage::new(0, 0);
    let mut world = (String::new(), floor_alone("office"));
    let mut view = None;
    let mut checked = [0, 0];
    for (words, n) in &golden {
        if world.0 != words[0] {
            world = (words[0].clone(), floor_alone(&words[0]));
        }
        let now = Some((words.clone(), n[0].to_bits(), n[1].to_bits()));
        if view != now {
            let renderer = &mut renderers[usize::from(words[1] == "vga")];
            image = renderer.render(&world.1, Pose2::new(n[0], n[1], n[2]), 0.0, 0);
            view = now;
        }
        let shows = image.get_pixel(n[3] as u32, n[4] as u32).0[0] == 255;
        assert_eq!(shows, n[5] > 0.5, "{words:?} {n:?}");
        checked[usize::from(shows)] += 1;
    }
    assert!(checked.iter().all(|c| *c > 500), "{checked:?}");
}

/// A black box on a white floor, seen from a base at the origin.
fn black_box() -> World {
    World::new(&Building {
        ambient: 1.0,
        floor: mobot_hw::sim::Floor {
            brightness: 1.0,
            ..Default::default()
        },
        boxes: vec![Block {
            at: [3.6, 0.3],
            size: [1.0, 6.0],
            yaw_deg: 7.0,
            height: 2.0,
            brightness: 0.0,
            ..Block::default()
        }],
        ..Building::default()
    })
    .expect("a world")
}

/// The foot of the box's near side, map frame.
fn foot(along: f64) -> Point2 {
    let (sin, cos) = 7.0_f64.to_radians().sin_cos();
    Point2::new(3.6 - 0.5 * cos - along * sin, 0.3 - 0.5 * sin + along * cos)
}

#[test]
fn edges_lie_where_the_geometry_puts_them() {
    let lenses = [
        Distortion::None,
        Distortion::PlumbBob {
            coefficients: [-0.25, 0.06, 0.001, -0.002, 0.0],
        },
        Distortion::Fisheye {
            coefficients: [0.02, -0.01, 0.002, 0.0],
        },
    ];
    for distortion in lenses {
        for blur_px in [0.0, 0.8] {
            let camera = CameraModel {
                distortion,
                roll: 0.02,
                ..CameraModel::paper()
            };
            let look = Look { blur_px, ..PLAIN };
            let image =
                Renderer::new(camera, look)
                    .unwrap()
                    .render(&black_box(), Pose2::default(), 0.0, 0);
            let pixel = |along: f64| camera.pixel_of(Pose2::default(), foot(along), 0.0).unwrap();
            let mut errors = Vec::new();
            for column in 20..460 {
                // the place on the foot that this column shows
                let (mut low, mut high) = (-2.9, 2.9);
                for _ in 0..60 {
                    let middle = (low + high) / 2.0;
                    // to the left in the world is to the left in the picture
                    if pixel(middle)[0] > f64::from(column) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let truth = pixel(low)[1];
                // black above, white below: the sum of the black is the edge's place
                let (from, to) = ((truth - 12.0) as u32, (truth + 12.0) as u32);
                let black: f64 = (from..to)
                    .map(|row| 1.0 - f64::from(image.get_pixel(column, row).0[0]) / 255.0)
                    .sum();
                errors.push(f64::from(from) - 0.5 + black - truth);
            }
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            let worst = errors.iter().fold(0.0_f64, |w, e| w.max(e.abs()));
            assert!(mean.abs() < 0.01, "{distortion:?}: mean {mean}");
            // one of sixteen samples
            assert!(worst < 1.0 / 16.0, "{distortion:?}: worst {worst}");
        }
    }
}

#[test]
fn true_corners_and_edges_are_those_in_sight() {
    let world = World::new(&building("office")).unwrap();
    let mut renderer = Renderer::new(CameraModel::vga(), Look::default()).unwrap();
    let base = Pose2::new(2.0, 3.0, -0.9);
    let corners = renderer.door_corners(&world, base, 2.0);
    // the doorway right ahead, its frame, and the shut door across the corridor seen through it
    let near = |x: f64, y: f64, kind: CornerKind| {
        corners
            .iter()
            .any(|c| c.corner.kind == kind && c.corner.position.distance(Point2::new(x, y)) < 1e-9)
    };
    assert!(near(2.5, 1.06, CornerKind::Opening) && near(3.4, 1.06, CornerKind::Opening));
    assert!(near(2.43, 1.06, CornerKind::Frame) && near(3.47, 1.06, CornerKind::Frame));
    assert!(near(3.6, -0.94, CornerKind::Opening) && near(4.5, -0.94, CornerKind::Opening));
    // behind the wall
    assert!(!near(2.5, 0.94, CornerKind::Frame) && !near(6.0, 1.06, CornerKind::Opening));
    for corner in &corners {
        let again = renderer
            .camera()
            .pixel_of(base, corner.corner.position, 0.0);
        assert_eq!(again, Some(corner.pixel));
    }
    let edges = renderer.floor_edges(&world, base, 2.0);
    assert!(edges.len() > 5);
    let image = Renderer::new(CameraModel::vga(), PLAIN).unwrap().render(
        &floor_alone("office"),
        base,
        2.0,
        0,
    );
    for edge in &edges {
        let [[u0, v0], [u1, v1]] = edge.pixels;
        let (u, v) = ((u0 + u1) / 2.0, (v0 + v1) / 2.0);
        if (u1 - u0).hypot(v1 - v0) < 20.0
            || !(4.0..635.0).contains(&u)
            || !(4.0..475.0).contains(&v)
        {
            continue;
        }
        // floor on one side of the middle of the edge, none on the other
        let (nx, ny) = ((v1 - v0), (u0 - u1));
        let long = nx.hypot(ny);
        let at = |d: f64| {
            image
                .get_pixel(
                    (u + d * nx / long).round() as u32,
                    (v + d * ny / long).round() as u32,
                )
                .0[0]
                == 255
        };
        assert_ne!(at(3.0), at(-3.0), "{edge:?}");
    }
}

#[test]
fn exposure_noise_and_blur_do_what_they_say() {
    let world = black_box();
    let base = Pose2::new(0.0, 0.0, 3.0); // looks away: floor only
    let render = |look: Look, seed| {
        Renderer::new(CameraModel::paper(), look)
            .unwrap()
            .render(&world, base, 0.0, seed)
    };
    let half = Look {
        exposure: 0.5,
        noise: 3.0,
        ..PLAIN
    };
    let noisy = render(half, 7);
    let (n, sum, squares) = noisy.as_raw().iter().fold((0.0, 0.0, 0.0), |(n, s, q), p| {
        let d = f64::from(*p) - 127.5;
        (n + 1.0, s + d, q + d * d)
    });
    let (mean, sigma) = (sum / n, (squares / n - (sum / n) * (sum / n)).sqrt());
    assert!(mean.abs() < 0.1, "{mean}");
    // rounding adds 1/12
    assert!(
        (sigma - (9.0_f64 + 1.0 / 12.0).sqrt()).abs() < 0.05,
        "{sigma}"
    );
    assert_ne!(noisy, render(half, 8));
    assert_eq!(noisy, render(half, 7));
    let gamma = render(
        Look {
            exposure: 0.25,
            gamma: 2.0,
            ..PLAIN
        },
        0,
    );
    assert!(
        gamma.as_raw().iter().all(|p| *p == 128),
        "sqrt(0.25) of 255"
    );
}

#[test]
fn impossible_cameras_are_refused() {
    let flat = |camera: CameraModel| Renderer::new(camera, PLAIN).map(|_| ()).unwrap_err();
    let paper = CameraModel::paper();
    assert!(matches!(
        flat(CameraModel { width: 0, ..paper }),
        CameraModelError::Value { name: "width", .. }
    ));
    assert!(matches!(
        flat(CameraModel {
            fx: f64::NAN,
            ..paper
        }),
        CameraModelError::Value { name: "fx", .. }
    ));
    // folds over well inside the picture
    let distortion = Distortion::PlumbBob {
        coefficients: [-2.0, 0.0, 0.0, 0.0, 0.0],
    };
    assert!(matches!(
        flat(CameraModel {
            distortion,
            ..paper
        }),
        CameraModelError::Lens { .. }
    ));
}

#[test]
fn a_camera_sees_up_and_level_too() {
    let world = World::new(&building("hall")).unwrap();
    for tilt in [0.0, -0.6, 1.5] {
        let camera = CameraModel {
            tilt,
            ..CameraModel::centred(320, 240, 200.0, 1.0, tilt)
        };
        let image =
            Renderer::new(camera, Look::default())
                .unwrap()
                .render(&world, world.start(), 1.0, 1);
        let (low, high) = image
            .as_raw()
            .iter()
            .fold((255, 0), |(l, h), p| (l.min(*p), h.max(*p)));
        assert!(high - low > 40, "tilt {tilt}: {low}..{high}");
    }
}
