//! The plain twins of the fan and of the plan: every ray against everything, one thing after another.

use occgrid::{Point2, Pose2};

use super::building::Texture;
use super::fan::{Fan, Ray};
use super::outline::{Outline, Piece, Shape, Strike, meet, nearest_on};
use super::solid::{Finish, Footprint, Solid};
use crate::dice::Dice;
use crate::real::{Placed, distance};

/// Where a ray in space, from `height` above the origin of `foot`, enters a solid: the way over the floor.
fn enters(solid: &Solid, foot: &Placed, height: f64, ray: &Ray) -> Option<f64> {
    let direction = foot.turned(Point2::new(ray.x, ray.y));
    let upright = [height, -ray.slope, solid.bottom, solid.top];
    let spans = match solid.footprint {
        Footprint::Block { placed, half } => {
            let from = placed.inward(foot.origin);
            let ahead = Point2::new(
                placed.cos * direction.x + placed.sin * direction.y,
                placed.cos * direction.y - placed.sin * direction.x,
            );
            vec![
                [from.x, ahead.x, -half[0], half[0]],
                [from.y, ahead.y, -half[1], half[1]],
                upright,
            ]
        }
        Footprint::Disc { center, radius } => {
            let (x, y) = (center.x - foot.origin.x, center.y - foot.origin.y);
            let along = x * direction.x + y * direction.y;
            let off = x * direction.y - y * direction.x;
            let half = (radius * radius - off * off).sqrt();
            if half.is_nan() {
                return None;
            }
            vec![[0.0, 1.0, along - half, along + half], upright]
        }
    };
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for [at, speed, low, high] in spans {
        let (a, b) = ((low - at) / speed, (high - at) / speed);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave && enter >= 0.0).then_some(enter)
}

fn solid(dice: &mut Dice) -> Solid {
    let at = Point2::new(12.0 * dice.even() - 6.0, 12.0 * dice.even() - 6.0);
    let bottom = if dice.chance(0.3) {
        2.0 * dice.even()
    } else {
        0.0
    };
    let thin = dice.chance(0.1);
    Solid {
        footprint: if dice.chance(0.3) {
            Footprint::Disc {
                center: at,
                radius: 0.05 + dice.even(),
            }
        } else {
            let half = [
                0.05 + 2.0 * dice.even(),
                if thin { 0.0 } else { 0.02 + dice.even() },
            ];
            Footprint::Block {
                placed: Placed::at(Pose2::new(at.x, at.y, 7.0 * dice.even())),
                half,
            }
        },
        bottom,
        top: bottom + 0.1 + 2.0 * dice.even(),
        finish: Finish::plain(0.5, Texture::Plain),
        backed: false,
    }
}

/// Sizes of worlds.
const COUNTS: [usize; 8] = [0, 1, 2, 10, 63, 64, 65, 129];

#[test]
fn the_fan_meets_what_its_plain_twin_meets() {
    let mut dice = Dice::new(1);
    let (mut fan, mut met) = (Fan::default(), 0);
    for round in 0..80 {
        let count = COUNTS[round % COUNTS.len()];
        let solids: Vec<Solid> = (0..count).map(|_| solid(&mut dice)).collect();
        let foot = Placed::at(Pose2::new(dice.even(), dice.even(), 7.0 * dice.even()));
        let height = 0.2 + 1.5 * dice.even();
        let far = if dice.chance(0.5) { f64::INFINITY } else { 6.0 };
        fan.sort(solids.iter(), &foot, height, far);
        for _ in 0..200 {
            let ray = Ray::along([dice.normal(), dice.normal(), dice.normal()]);
            let plain = solids
                .iter()
                .filter_map(|s| enters(s, &foot, height, &ray))
                .fold(f64::INFINITY, f64::min);
            let fast = fan.cast(&ray, far).map(|h| h.range);
            match fast {
                Some(range) => {
                    // the ends of blocks lie a millionth deeper
                    assert!((range - plain).abs() < 1e-5, "{count}: {range} {plain}");
                    met += 1;
                }
                None => assert!(plain >= far - 1e-5, "{count}: nothing, but {plain}"),
            }
        }
    }
    assert!(met > 3_000, "{met}");
}

fn plain_cast(pieces: &[Piece], from: Point2, to: Point2, far: f64, height: f64) -> Option<Strike> {
    let stands = pieces
        .iter()
        .filter(|p| (p.bottom..=p.top).contains(&height));
    let strikes = stands.filter_map(|p| meet(&p.shape, from, to));
    strikes
        .filter(|s| s.range < far)
        .min_by(|a, b| a.range.total_cmp(&b.range))
}

#[test]
fn the_plan_meets_what_its_plain_twin_meets() {
    let mut dice = Dice::new(2);
    let (mut met, mut near) = (0, 0);
    for round in 0..80 {
        let count = COUNTS[round % COUNTS.len()];
        let solids: Vec<Solid> = (0..count).map(|_| solid(&mut dice)).collect();
        let outline = Outline::of(&solids);
        for _ in 0..200 {
            let from = Point2::new(24.0 * dice.even() - 12.0, 24.0 * dice.even() - 12.0);
            let toward = Placed::at(Pose2::new(0.0, 0.0, 7.0 * dice.even()));
            let direction = match dice.next() % 8 {
                0 => Point2::new(1.0, 0.0),
                1 => Point2::new(0.0, -1.0),
                _ => Point2::new(toward.cos, toward.sin),
            };
            let (far, height) = (30.0 * dice.even(), 3.0 * dice.even());
            let fast = outline.cast(from, direction, far, height);
            let plain = plain_cast(&outline.pieces, from, direction, far, height);
            assert_eq!(
                fast.map(|s| s.range.to_bits()),
                plain.map(|s| s.range.to_bits())
            );
            met += usize::from(fast.is_some());

            let reach = 3.0 * dice.even();
            let below = outline.pieces.iter().filter(|p| p.bottom < height);
            let plain = below
                .map(|p| distance(nearest_on(&p.shape, from), from))
                .filter(|d| *d < reach)
                .min_by(f64::total_cmp);
            let fast = outline
                .nearest(from, reach, height)
                .map(|p| distance(p, from));
            assert_eq!(fast.map(f64::to_bits), plain.map(f64::to_bits));
            near += usize::from(fast.is_some());
        }
    }
    assert!(met > 2_000 && near > 2_000, "{met} {near}");
}

#[test]
fn an_outline_keeps_what_is_free_on_its_left_and_nothing_inside() {
    let mut dice = Dice::new(3);
    for _ in 0..40 {
        let mut solids: Vec<Solid> = (0..20).map(|_| solid(&mut dice)).collect();
        for s in &mut solids {
            // one height, so that every solid hides what is inside it
            (s.bottom, s.top) = (0.0, 2.0);
        }
        let solids: Vec<Solid> = solids
            .into_iter()
            .filter(|s| matches!(s.footprint, Footprint::Block { half, .. } if half[1] > 0.0))
            .collect();
        let inside = |p: Point2| solids.iter().any(|s| s.footprint.contains(p));
        for piece in Outline::of(&solids).pieces {
            let Shape::Line([a, b]) = piece.shape else {
                panic!("blocks have lines only");
            };
            let long = distance(a, b);
            for t in [0.01, 0.5, 0.99] {
                let at = |d: f64| {
                    Point2::new(
                        a.x + (b.x - a.x) * t - d * (b.y - a.y) / long,
                        a.y + (b.y - a.y) * t + d * (b.x - a.x) / long,
                    )
                };
                if long > 1e-3 {
                    assert!(inside(at(-1e-7)) && !inside(at(1e-9)), "{a:?} {b:?} at {t}");
                }
            }
        }
    }
}
