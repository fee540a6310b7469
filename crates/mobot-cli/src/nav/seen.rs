//! What a robot that explores has seen clear: a map refined stop by stop, in which unknown is never free.
//!
//! Cell-by-cell Bayes calls walls free that were only passed at a slant, and closes doorways. So the shots
//! from around each new stop are explained together ([`occgrid::refine`]), and what they say of the place
//! around the stop replaces what was thought there before. The whole log is refined once, at the end.

use morpho::BitImage;
use occgrid::{
    Cell, FREE_AT_MOST, FrameError, MapFrame, OCCUPIED_AT_LEAST, OccupancyGrid, OccupancyMap,
    Point2, Pose2, Reading, RefineError, RefineParams, Refinement, Shot, SonarModel,
};
use voronoi_plan::FreeSpace;

use super::angle::wrap;

/// How the map around a stop is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenParams {
    /// Side of a cell [m], 0.02 to 0.25.
    pub resolution: f64,
    /// Shots from stops no farther than this are explained together [m]. Raised: slower, in squares.
    pub window: f64,
    /// How far an echo is believed while exploring [m]; farther ones say only that the way up to here was
    /// silent. Raised: slower, and more walls taken for free that were passed at a slant.
    pub reach: f64,
    /// The map is replaced no farther than this around a new stop [m], at most `window`.
    pub renewed: f64,
    /// What is too close for the sonar to measure stands this far from it [m].
    pub too_close: f64,
    /// The forward model of local maps.
    pub refine: RefineParams,
}

impl Default for SeenParams {
    fn default() -> Self {
        Self {
            resolution: 0.05,
            window: 3.0,
            reach: 3.5,
            renewed: 2.5,
            too_close: 0.19,
            refine: RefineParams {
                // a sonar that stands still for its shots holds no old values
                hit_if_held: 1.0,
                iterations: 4,
                // patches shorter than in a whole log, which shows a doorway from more sides
                patch_tail: 0.1,
                ..RefineParams::default()
            },
        }
    }
}

/// What is known of the floor while exploring.
#[derive(Debug, Clone)]
pub struct Seen {
    params: SeenParams,
    model: SonarModel,
    /// Every shot, as fired.
    shots: Vec<Shot>,
    /// Where surveys were made, and the range of their shots.
    stops: Vec<Stop>,
    frame: MapFrame,
    /// Log-odds of the local maps, in `frame`.
    log_odds: Vec<f32>,
    /// Where the body has been.
    trodden: BitImage,
    /// Surfaces that answered two stops: from foot to foot.
    surfaces: Vec<[Point2; 2]>,
    /// Where it ran into something.
    bumped: Vec<Point2>,
    /// The main direction of the walls [rad], and how many stops there were when it was found.
    main: Option<(f64, usize)>,
}

/// Where a survey was made.
#[derive(Debug, Clone, PartialEq)]
struct Stop {
    at: Point2,
    shots: std::ops::Range<usize>,
}

impl Seen {
    /// Nothing seen yet.
    ///
    /// # Errors
    /// [`FrameError::Resolution`]
    pub fn new(model: SonarModel, params: SeenParams) -> Result<Self, FrameError> {
        let frame = MapFrame::new(1, 1, params.resolution, Pose2::default())?;
        Ok(Self {
            params,
            model,
            shots: Vec::new(),
            stops: Vec::new(),
            frame,
            log_odds: vec![0.0],
            trodden: BitImage::new(1, 1),
            surfaces: Vec::new(),
            bumped: Vec::new(),
            main: None,
        })
    }

    /// Every shot so far, in order.
    #[must_use]
    pub fn shots(&self) -> &[Shot] {
        &self.shots
    }

    /// Where surveys were made, in order.
    pub fn stops(&self) -> impl DoubleEndedIterator<Item = Point2> + ExactSizeIterator + '_ {
        self.stops.iter().map(|stop| stop.at)
    }

    /// Where cells are; changes as the map grows.
    #[must_use]
    pub const fn frame(&self) -> &MapFrame {
        &self.frame
    }

    /// The map so far, in percent: with the surfaces that two stops heard, and free where the body was.
    #[must_use]
    pub fn map(&self) -> OccupancyMap {
        let mut log_odds = self.log_odds.clone();
        self.complete(&self.frame, &mut log_odds);
        match OccupancyGrid::from_log_odds(self.frame, log_odds) {
            Ok(grid) => grid.to_occupancy_map(FREE_AT_MOST, OCCUPIED_AT_LEAST),
            // the values come from grids, which hold only finite ones
            Err(_) => OccupancyMap::new(
                self.frame,
                vec![-1; self.frame.cell_count()],
                FREE_AT_MOST,
                OCCUPIED_AT_LEAST,
            ),
        }
    }

    /// Puts what cells alone do not show into a map of the same places: the surfaces that two stops heard, and the
    /// floor on which the body was.
    pub fn complete(&self, frame: &MapFrame, log_odds: &mut [f32]) {
        for &[a, b] in &self.surfaces {
            let steps = (a.distance(b) / (0.4 * frame.resolution())).ceil().max(1.0);
            for k in 0..=steps as u32 {
                let t = f64::from(k) / steps;
                let at = Point2::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
                if let Some(cell) = frame.cell_at(at) {
                    log_odds[frame.index(cell)] = CERTAIN;
                }
            }
        }
        let cells = (0..self.frame.height())
            .flat_map(|row| (0..self.frame.width()).map(move |col| Cell::new(col, row)));
        for cell in cells.filter(|c| self.trodden.get(c.col as usize, c.row as usize)) {
            if let Some(cell) = frame.cell_at(self.frame.center_of(cell)) {
                let value = &mut log_odds[frame.index(cell)];
                *value = value.min(-CERTAIN);
            }
        }
    }

    /// The log-odds of the map so far, row 0 = top.
    #[must_use]
    pub fn log_odds(&self) -> &[f32] {
        &self.log_odds
    }

    /// What was seen clear, or trodden, and never run into.
    #[must_use]
    pub fn free_space(&self) -> FreeSpace {
        let (width, height) = (self.frame.width() as usize, self.frame.height() as usize);
        let most = free_log_odds();
        let log_odds = self.completed();
        let mut cells = BitImage::from_fn(width, height, |x, y| log_odds[y * width + x] <= most);
        for &place in &self.bumped {
            self.around(place, self.params.resolution, |x, y| cells.set(x, y, false));
        }
        FreeSpace::new(self.frame, cells)
    }

    /// What is not known to be occupied: where the robot might fit, for all that was seen.
    #[must_use]
    pub fn open_space(&self) -> FreeSpace {
        let (width, height) = (self.frame.width() as usize, self.frame.height() as usize);
        let least = occupied_log_odds();
        let log_odds = self.completed();
        let mut cells = BitImage::from_fn(width, height, |x, y| log_odds[y * width + x] < least);
        for &place in &self.bumped {
            self.around(place, self.params.resolution, |x, y| cells.set(x, y, false));
        }
        FreeSpace::new(self.frame, cells)
    }

    fn completed(&self) -> Vec<f32> {
        let mut log_odds = self.log_odds.clone();
        self.complete(&self.frame, &mut log_odds);
        log_odds
    }

    /// The body stood or drove here: what it covered is free.
    pub fn tread(&mut self, place: Point2, radius: f64) {
        self.cover(place, radius + self.params.resolution);
        let mut trodden = std::mem::take(&mut self.trodden);
        self.around(place, radius, |x, y| trodden.set(x, y, true));
        self.trodden = trodden;
    }

    /// The body ran into something here.
    pub fn bump(&mut self, place: Point2) {
        self.cover(place, self.params.resolution);
        self.bumped.push(place);
    }

    /// A survey was made at a place: its shots, and with them the shots from around it, make the map there anew.
    ///
    /// # Errors
    /// [`RefineError`] where the sonar's model or a shot is unusable; the shots are kept all the same.
    pub fn survey(&mut self, at: Point2, shots: &[Shot]) -> Result<(), RefineError> {
        let first = self.shots.len();
        self.shots.extend_from_slice(shots);
        let shots = first..self.shots.len();
        self.stops.push(Stop { at, shots });
        self.find_surfaces();
        let near = |stop: &&Stop| stop.at.distance(at) <= self.params.window;
        let window: Vec<Shot> = self
            .stops
            .iter()
            .filter(near)
            .flat_map(|stop| &self.shots[stop.shots.clone()])
            .map(|shot| self.believed(shot))
            .collect();
        let mut plain = OccupancyGrid::new(self.params.resolution)?;
        plain.integrate(&self.model, &window)?;
        // looked for anew whenever there are twice as many stops
        let known = self.main.filter(|m| self.stops.len() < 2 * m.1);
        let params = RefineParams {
            main_direction: known.map(|m| m.0),
            ..self.params.refine
        };
        let local = Refinement::new(&window, &self.model, &plain, &params)?;
        if known.is_none() {
            self.main = Some((local.main_direction(), self.stops.len()));
        }
        self.renew(at, local.grid());
        Ok(())
    }

    fn believed(&self, shot: &Shot) -> Shot {
        let reach = self.params.reach;
        let reading = match shot.reading {
            Reading::Echo { range } if range > reach => Reading::NoEcho { listened: reach },
            Reading::NoEcho { listened } => Reading::NoEcho {
                listened: listened.min(reach),
            },
            Reading::TooClose => Reading::Echo {
                range: self.params.too_close,
            },
            other @ (Reading::Echo { .. } | Reading::Fault) => other,
        };
        Shot { reading, ..*shot }
    }

    /// The surfaces that the newest stop and one before heard both.
    fn find_surfaces(&mut self) {
        let Some((newest, before)) = self.stops.split_last() else {
            return;
        };
        let heard = |stop: &Stop| -> Vec<Heard> {
            let shots = self.shots[stop.shots.clone()].iter();
            shots.filter_map(|shot| self.heard(shot)).collect()
        };
        let here = heard(newest);
        let near = |stop: &&Stop| stop.at.distance(newest.at) <= MOST_APART;
        let there: Vec<Heard> = before.iter().filter(near).flat_map(heard).collect();
        let found = here.iter().flat_map(|a| {
            let pairs = there.iter();
            pairs.filter_map(move |b| surface(a, b))
        });
        let found: Vec<[Point2; 2]> = found.collect();
        self.surfaces.extend(found);
    }

    fn heard(&self, shot: &Shot) -> Option<Heard> {
        let Reading::Echo { range } = self.believed(shot).reading else {
            return None;
        };
        let at = shot
            .map_from_base
            .transform_from(self.model.mount.position());
        (range <= SURFACE_REACH).then_some(Heard {
            at,
            direction: shot.map_from_base.theta + shot.bearing,
            range,
        })
    }

    /// Takes over a local map around a stop.
    fn renew(&mut self, at: Point2, local: &OccupancyGrid) {
        let reach = self.params.renewed;
        self.cover(at, reach);
        let mut values = std::mem::take(&mut self.log_odds);
        let width = self.frame.width() as usize;
        self.around(at, reach, |x, y| {
            let center = self.frame.center_of(Cell::new(x as u32, y as u32));
            if let Some(cell) = local.frame().cell_at(center) {
                values[y * width + x] = local.log_odds()[local.frame().index(cell)];
            }
        });
        self.log_odds = values;
    }

    /// Calls `f` with every cell whose centre is no farther than `reach` from a place.
    fn around(&self, place: Point2, reach: f64, mut f: impl FnMut(usize, usize)) {
        let at = self.frame.grid_from_map(place);
        let cells = reach / self.params.resolution;
        let span = |mid: f64, side: u32| {
            let from = (mid - cells).floor().max(0.0) as usize;
            let to = (mid + cells).ceil().clamp(0.0, f64::from(side)) as usize;
            from..to
        };
        for y in span(at.row, self.frame.height()) {
            for x in span(at.col, self.frame.width()) {
                let (dx, dy) = (x as f64 + 0.5 - at.col, y as f64 + 0.5 - at.row);
                if dx.hypot(dy) <= cells {
                    f(x, y);
                }
            }
        }
    }

    /// Makes the frame hold a disc.
    fn cover(&mut self, place: Point2, reach: f64) {
        /// Frames grow by whole blocks of this many cells.
        const BLOCK: f64 = 64.0;
        let resolution = self.params.resolution;
        let old = self.frame;
        let (left, bottom) = (old.origin().x / resolution, old.origin().y / resolution);
        let (right, top) = (
            left + f64::from(old.width()),
            bottom + f64::from(old.height()),
        );
        let low = |v: f64, at: f64| v.min(((at - reach) / resolution / BLOCK).floor() * BLOCK);
        let high = |v: f64, at: f64| v.max(((at + reach) / resolution / BLOCK).ceil() * BLOCK);
        let (new_left, new_bottom) = (low(left, place.x).round(), low(bottom, place.y).round());
        let (new_right, new_top) = (high(right, place.x).round(), high(top, place.y).round());
        let (width, height) = ((new_right - new_left) as u32, (new_top - new_bottom) as u32);
        if (width, height) == (old.width(), old.height()) {
            return;
        }
        let origin = Pose2::new(new_left * resolution, new_bottom * resolution, 0.0);
        // a map past all limits stays as it is
        let Ok(frame) = MapFrame::new(width, height, resolution, origin) else {
            return;
        };
        let (dx, dy) = (
            (left - new_left).round() as usize,
            (new_top - top).round() as usize,
        );
        let mut log_odds = vec![0.0; frame.cell_count()];
        let mut trodden = BitImage::new(width as usize, height as usize);
        for y in 0..old.height() as usize {
            for x in 0..old.width() as usize {
                log_odds[(y + dy) * width as usize + x + dx] =
                    self.log_odds[y * old.width() as usize + x];
                if self.trodden.get(x, y) {
                    trodden.set(x + dx, y + dy, true);
                }
            }
        }
        self.frame = frame;
        self.log_odds = log_odds;
        self.trodden = trodden;
    }
}

/// Log-odds of what is certain.
const CERTAIN: f32 = 4.0;
/// Stops that are farther apart than this hear different things [m].
const MOST_APART: f64 = 0.8;
/// Stops nearer than this hear the same thing twice [m].
const LEAST_APART: f64 = 0.1;
/// Echoes from farther may have come over a second wall [m].
const SURFACE_REACH: f64 = 1.2;
/// A surface answers square to within this of the beam's axis [rad].
const SQUARE: f64 = 12.0 / 180.0 * std::f64::consts::PI;
/// A point answers this far off the beam's axis [rad].
const BEAM: f64 = 15.0 / 180.0 * std::f64::consts::PI;
/// From foot to foot at most [m]: narrower than any way through which the body fits with room to spare.
const FOOT_TO_FOOT: f64 = 0.55;

/// An echo from a near surface.
#[derive(Debug, Clone, Copy)]
struct Heard {
    at: Point2,
    /// Of the beam's axis [rad].
    direction: f64,
    range: f64,
}

/// Where a surface answered both, from the foot of one perpendicular to that of the other. Each echo came from
/// somewhere on its arc; a flat surface touches both arcs, square to both beams. `None` where there is none such, or
/// the feet are so far apart that something else may be between them.
fn surface(a: &Heard, b: &Heard) -> Option<[Point2; 2]> {
    let apart = a.at.distance(b.at);
    let nearer = a.range - b.range;
    if !(LEAST_APART..=MOST_APART).contains(&apart) || nearer.abs() >= apart {
        return None;
    }
    let (way, off) = (
        (b.at.y - a.at.y).atan2(b.at.x - a.at.x),
        (nearer / apart).acos(),
    );
    let square = |normal: &f64| {
        wrap(normal - a.direction).abs() <= SQUARE && wrap(normal - b.direction).abs() <= SQUARE
    };
    let normal = [way + off, way - off].into_iter().find(square)?;
    let (sin, cos) = normal.sin_cos();
    let foot = |h: &Heard| Point2::new(h.at.x + h.range * cos, h.at.y + h.range * sin);
    let feet = [foot(a), foot(b)];
    let narrow = feet[0].distance(feet[1]) <= FOOT_TO_FOOT;
    (narrow && !one_point(a, b, apart, way)).then_some(feet)
}

/// Whether a single point, as a corner or a door's edge, may have answered both.
fn one_point(a: &Heard, b: &Heard, apart: f64, way: f64) -> bool {
    let along = (apart * apart + a.range * a.range - b.range * b.range) / (2.0 * apart);
    let across = (a.range * a.range - along * along).max(0.0).sqrt();
    [across, -across].into_iter().any(|across| {
        let off = |from: f64, h: &Heard| wrap(way + across.atan2(along - from) - h.direction);
        off(0.0, a).abs() <= BEAM && off(apart, b).abs() <= BEAM
    })
}

/// Log-odds up to which a cell is free in a finished map, which holds whole percents.
fn free_log_odds() -> f32 {
    let most = (f32::from(FREE_AT_MOST) + 0.5) / 100.0;
    (most / (1.0 - most)).ln()
}

/// Probability from which a place is surely in the way: a doorway's edges, and the straight walls beside it, make a
/// few places in it look occupied at first.
const OCCUPIED: f32 = 0.8;

/// The same as log-odds.
fn occupied_log_odds() -> f32 {
    (OCCUPIED / (1.0 - OCCUPIED)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_grows_with_the_body_and_forgets_nothing() {
        let mut seen = Seen::new(SonarModel::default(), SeenParams::default()).expect("a map");
        let places = [(0.0, 0.0), (5.0, -3.0), (-7.3, 2.2), (0.4, 12.0)];
        for (x, y) in places {
            seen.tread(Point2::new(x, y), 0.2);
        }
        let space = seen.free_space();
        let is_free = |x: f64, y: f64| {
            let cell = space.frame().cell_at(Point2::new(x, y)).expect("inside");
            space.cells().get(cell.col as usize, cell.row as usize)
        };
        for (x, y) in places {
            assert!(is_free(x, y) && is_free(x + 0.15, y) && !is_free(x + 0.3, y));
        }
        let area = space.cells().count_ones() as f64 * 0.0025;
        assert!(
            (area / 4.0 - std::f64::consts::PI * 0.04).abs() < 0.02,
            "{area}"
        );
        seen.bump(Point2::new(0.0, 0.0));
        let cell = seen.frame().cell_at(Point2::new(0.0, 0.0)).expect("inside");
        let bumped = seen.free_space();
        assert!(!bumped.cells().get(cell.col as usize, cell.row as usize));
    }

    #[test]
    fn a_survey_in_a_square_room_shows_floor_up_to_its_walls() {
        // echoes as a sonar of 18 degrees gives them in the middle of a room of 2 m x 2 m
        let shots: Vec<Shot> = (0..20)
            .map(|k| {
                let bearing = f64::from(k) * 18.0_f64.to_radians();
                let off = (bearing + std::f64::consts::FRAC_PI_4)
                    .rem_euclid(std::f64::consts::FRAC_PI_2)
                    - std::f64::consts::FRAC_PI_4;
                let range = 1.0 / (off.abs() - 0.2).max(0.0).cos();
                Shot {
                    stamp: 0.0,
                    map_from_base: Pose2::default(),
                    bearing,
                    reading: Reading::Echo { range },
                }
            })
            .collect();
        let model = SonarModel {
            sigma: 0.03,
            ..SonarModel::default()
        };
        let mut seen = Seen::new(model, SeenParams::default()).expect("a map");
        seen.tread(Point2::new(0.0, 0.0), 0.2);
        seen.survey(Point2::new(0.0, 0.0), &shots).expect("a map");
        let space = seen.free_space();
        for k in 0..36 {
            let (sin, cos) = (f64::from(k) * 10.0_f64.to_radians()).sin_cos();
            let free_at = |r: f64| {
                let place = Point2::new(r * cos, r * sin);
                let cell = space.frame().cell_at(place);
                cell.is_some_and(|c| space.cells().get(c.col as usize, c.row as usize))
            };
            assert!(free_at(0.6), "direction {k}");
            assert!(!free_at(1.6), "direction {k}");
        }
        assert_eq!(seen.stops().len(), 1);
        assert_eq!(seen.shots().len(), 20);
    }

    #[test]
    fn a_surface_at_any_angle_is_known_between_the_feet_of_two_echoes() {
        // a table's edge at 15 degrees, 0.4 m to the left of two stops 0.45 m apart
        let edge = 15.0_f64.to_radians();
        let normal = edge + std::f64::consts::FRAC_PI_2;
        let echo = |x: f64, y: f64, off: f64| {
            let range = 0.4 + y * -normal.sin() - x * normal.cos();
            Heard {
                at: Point2::new(x, y),
                direction: normal + off,
                range,
            }
        };
        let feet = surface(&echo(0.0, 0.0, 0.1), &echo(0.45, 0.05, -0.15)).expect("a surface");
        for foot in feet {
            let off = foot.x * normal.cos() + foot.y * normal.sin() - 0.4;
            assert!(off.abs() < 1e-9, "{feet:?}");
        }
        let [a, b] = feet;
        assert!(
            ((b.y - a.y).atan2(b.x - a.x) - edge).abs() < 1e-6,
            "{feet:?}"
        );
        // a corner that both hear is no surface
        let corner = |x: f64| Heard {
            at: Point2::new(x, 0.0),
            direction: 0.9_f64.atan2(0.2 - x),
            range: 0.9_f64.hypot(0.2 - x),
        };
        assert_eq!(surface(&corner(0.0), &corner(0.4)), None);
        // askew to a beam, or a doorway apart, it is none
        assert_eq!(surface(&echo(0.0, 0.0, 0.3), &echo(0.45, 0.05, 0.0)), None);
        assert_eq!(surface(&echo(0.0, 0.0, 0.0), &echo(0.7, 0.0, 0.0)), None);
    }

    #[test]
    fn what_is_too_close_to_measure_is_in_the_way() {
        let mut seen = Seen::new(SonarModel::default(), SeenParams::default()).expect("a map");
        let shot = |reading| Shot {
            stamp: 0.0,
            map_from_base: Pose2::default(),
            bearing: 0.0,
            reading,
        };
        let shots = [shot(Reading::TooClose)];
        seen.survey(Point2::new(0.0, 0.0), &shots).expect("a map");
        let state = |x: f64| {
            seen.map()
                .frame()
                .cell_at(Point2::new(x, 0.0))
                .map(|c| seen.map().state(c))
        };
        assert_ne!(state(0.19), Some(occgrid::CellState::Free));
    }
}
