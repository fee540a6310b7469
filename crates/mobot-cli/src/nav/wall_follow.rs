//! Wall following from stop to stop: with a hand on the wall, one step at a time (§2.1).

use occgrid::{Cell, Point2, Pose2};

use super::reach::Reach;

/// The hand that stays on the wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Hand {
    /// Anticlockwise round a room.
    #[default]
    Right,
    /// Clockwise round a room.
    Left,
}

/// How walls are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallFollowParams {
    /// Which side the wall is on.
    pub hand: Hand,
    /// From stop to stop [m], 0.2 to 5. Default 1, the paper's.
    pub step: f64,
    /// Shortest step where there is no room for a whole one [m].
    pub least_step: f64,
    /// Room between the body and the wall [m], 0 or more.
    pub margin: f64,
    /// Room in narrow places, as doors [m], at most `margin`.
    pub narrow_margin: f64,
    /// A stop this near to an earlier one is one that is known [m], below `step`.
    pub known: f64,
}

impl Default for WallFollowParams {
    fn default() -> Self {
        Self {
            hand: Hand::Right,
            step: 1.0,
            least_step: 0.5,
            margin: 0.2,
            narrow_margin: 0.06,
            known: 0.6,
        }
    }
}

/// What following the wall comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Along {
    /// The next stop.
    Next(Point2),
    /// The wall leads back to a stop that is known: a loop is closed, or the way ends.
    Known(Point2),
    /// There is no wall, or nowhere to go.
    Nowhere,
}

/// A stop this near is the one where the robot stands [m].
const HERE: f64 = 0.15;
/// Angle between two directions that are tried [rad].
const TURN: f64 = 10.0 / 180.0 * std::f64::consts::PI;

/// The next stop along the wall from a place, heading as the robot arrived: the directions are tried from behind
/// the hand to the other side, and the first way that was seen clear is taken, as far as one step.
#[must_use]
pub fn along_the_wall(
    reach: &Reach,
    here: Pose2,
    stops: &[Point2],
    params: &WallFollowParams,
) -> Along {
    let side = match params.hand {
        Hand::Right => -1.0,
        Hand::Left => 1.0,
    };
    for margin in [params.margin, params.narrow_margin] {
        // from 130 degrees on the hand's side to 130 on the other: back where it came from is no way along
        for k in 0..27 {
            let direction = here.theta + side * (13.0 - f64::from(k)) * TURN;
            let Some(stop) = farthest(reach, here, direction, margin, params) else {
                continue;
            };
            // short steps end near to where they begin
            let known = stops.iter().find(|known| {
                known.distance(stop) < params.known && known.distance(here.position()) > HERE
            });
            return known.map_or(Along::Next(stop), |&known| Along::Known(known));
        }
    }
    Along::Nowhere
}

fn farthest(
    reach: &Reach,
    here: Pose2,
    direction: f64,
    margin: f64,
    params: &WallFollowParams,
) -> Option<Point2> {
    let (sin, cos) = direction.sin_cos();
    let mut length = params.step;
    while length >= params.least_step {
        let stop = Point2::new(here.x + length * cos, here.y + length * sin);
        let cell: Option<Cell> = reach.space().frame().cell_at(stop);
        let there = cell.is_some_and(|cell| reach.cost(cell).is_some());
        if there && reach.is_clear(here.position(), stop, margin) {
            return Some(stop);
        }
        length -= 0.25;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nav::ReachParams;
    use morpho::BitImage;
    use occgrid::MapFrame;
    use voronoi_plan::FreeSpace;

    /// A room of 6 m x 4 m with its lower left corner at the origin.
    fn room(here: Point2) -> Reach {
        let frame = MapFrame::new(140, 100, 0.05, Pose2::new(-0.5, -0.5, 0.0)).expect("a frame");
        let cells = BitImage::from_fn(140, 100, |x, y| {
            (10..130).contains(&x) && (10..90).contains(&y)
        });
        Reach::from(FreeSpace::new(frame, cells), here, ReachParams::default())
    }

    #[test]
    fn either_hand_leads_round_the_room_and_back() {
        for hand in [Hand::Right, Hand::Left] {
            let params = WallFollowParams {
                hand,
                ..WallFollowParams::default()
            };
            // the wall is on the side of the hand
            let (x, heading) = match hand {
                Hand::Right => (1.0, 0.0),
                Hand::Left => (5.0, std::f64::consts::PI),
            };
            let mut here = Pose2::new(x, 0.6, heading);
            let mut stops = vec![here.position()];
            let mut turned = 0.0;
            let closed = loop {
                let reach = room(here.position());
                match along_the_wall(&reach, here, &stops, &params) {
                    Along::Next(stop) => {
                        let heading = (stop.y - here.y).atan2(stop.x - here.x);
                        turned += crate::nav::angle::wrap(heading - here.theta);
                        here = Pose2::new(stop.x, stop.y, heading);
                        let to_wall = (stop.x.min(6.0 - stop.x)).min(stop.y.min(4.0 - stop.y));
                        assert!(to_wall > 0.35 && to_wall < 0.75, "{stop:?}");
                        stops.push(stop);
                    }
                    Along::Known(stop) => break stop,
                    Along::Nowhere => panic!("nowhere to go from {here:?}"),
                }
                assert!(stops.len() < 40, "no way round: {stops:?}");
            };
            assert!(closed.distance(stops[0]) < 1.7, "{hand:?} {closed:?}");
            assert!(stops.len() >= 12, "{hand:?} {stops:?}");
            let sense = if hand == Hand::Right { 1.0 } else { -1.0 };
            assert!(sense * turned > 4.0, "{hand:?} turned {turned}");
        }
    }

    #[test]
    fn what_was_not_seen_clear_is_no_way() {
        let frame = MapFrame::new(40, 40, 0.05, Pose2::new(-1.0, -1.0, 0.0)).expect("a frame");
        let space = FreeSpace::new(
            frame,
            BitImage::from_fn(40, 40, |x, y| {
                (14..26).contains(&x) && (14..26).contains(&y)
            }),
        );
        let reach = Reach::from(space, Point2::new(0.0, 0.0), ReachParams::default());
        let next = along_the_wall(&reach, Pose2::default(), &[], &WallFollowParams::default());
        assert_eq!(next, Along::Nowhere);
    }
}
