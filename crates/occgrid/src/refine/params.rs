//! What the forward model assumes about sonars and rooms.

use super::RefineError;

/// Parameters of the refinement. The defaults come from a search on simulated rooms of many shapes with a slow, wide,
/// often deaf sonar (beam width, reach, deafness and held values vary) and on real scans of one arena by several robots.
/// Sizes are lengths and angles, never cells.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct RefineParams {
    /// Passes over the whole log, 1 to 100. More cost time in proportion; little changes past 6.
    pub iterations: u32,
    /// Share of echoes that come from nothing on their arc (crosstalk, held values), 0.001 to 0.9. Raising
    /// it weakens all evidence.
    pub false_echoes: f64,
    /// Share of silences that happen in spite of something in the beam (smooth walls at a slant), 0.001 to
    /// 0.99. Raising it weakens the evidence of silence.
    pub false_silences: f64,
    /// Occupancy of a place on the beam's axis near the sonar that a true echo has passed, 0.001 to 0.5.
    pub passed: f64,
    /// The same at the edge of the beam, 0.001 to 0.5.
    pub passed_at_edge: f64,
    /// The same on the axis after silence, 0.001 to 0.5.
    pub passed_in_silence: f64,
    /// Range over which what was passed loses weight, to 1/e [m], 0.05 to 1000: a wall at a slant is missed
    /// more easily from afar.
    pub passed_reach: f64,
    /// Occupancy of a place on the surface that reflected, 0.5 to 0.999.
    pub hit: f64,
    /// Share of that evidence that is left where the sonar turned on the spot by a beam width or more and still
    /// reads the same to the digit, 0 to 1: a sensor that repeats its last value when an echo is lost. 1 for a
    /// sensor that never does.
    pub hit_if_held: f64,
    /// Half the length of a surface that reflects as one [m], 0.005 to 2. Raising it
    /// closes gaps, and narrow doors with them.
    pub patch: f64,
    /// Length over which a surface goes on past that, to 1/e [m], 0.005 to 2.
    pub patch_tail: f64,
    /// Error of a range in proportion to it, added to the sonar's sigma in squares, 0 to 0.2.
    pub relative_sigma: f64,
    /// How much nearer than its echo a surface may be [m], 0 to 0.2: a weak echo is noticed late.
    pub late: f64,
    /// Log-odds at which a place counts as in the way of other shots, -10 to 2, given as the prior of a
    /// place to be occupied.
    pub prior: f64,
    /// How fast known obstacles in front make an echo from behind them unbelievable, 0 to 20.
    pub blocking: f64,
    /// Shots from places this near to each other [m] whose beams overlap share their evidence, 0.001 to 10.
    pub same_place: f64,
    /// 1: overlapping shots from one place count as one; 0: as independent.
    pub redundancy: f64,
    /// Places with less evidence for free than this, and next to none for occupied, are doubtful: p = 0.5 to
    /// 0.52, not free, and unknown to whoever asks for more than a guess; 0 to 5 [log-odds before the gains].
    /// Raising it calls fewer walls free, and fewer free places too.
    pub doubt: f64,
    /// Factor on evidence for free, 0.1 to 5.
    pub free_gain: f64,
    /// Factor on evidence for occupied, 0.01 to 5.
    pub occupied_gain: f64,
    /// Angle from square by which a wall may stand to the beam and still answer at 0.6 of its strength, 0.05 to 10 [rad].
    /// What passes at a larger slant says little against a wall there.
    pub slant: f64,
    /// Over how many beam widths a surface square to the sonar may answer, 1 to 10: near and smooth ones are heard
    /// from well outside the nominal beam.
    pub hearing: f64,
    /// Share of the evidence of having been passed that holds off the way to what answered, 0 to 1.
    pub passed_aside: f64,
    /// Mean length of a wall [m], 0.05 to 1000. Raising it carries walls farther past where they were heard.
    pub wall_length: f64,
    /// Share of places on a line that are wall, before anything is known, 0.001 to 0.5.
    pub walls: f64,
    /// How much of what a place on a wall says of the places along it counts, 0 to 1; 0: walls need not be straight.
    pub straight: f64,
    /// Direction to which most walls are square or parallel, where it is known [rad, in the map]. `None`: it is looked
    /// for, which takes as long as ten passes over a short log.
    pub main_direction: Option<f64>,
    /// Work allowed, as visits of a shot to a cell, 1e5 to 1e12. A log that needs more is thinned first:
    /// shots alike in place, direction and range become one. A visit takes about 50 ns.
    pub max_visits: f64,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            iterations: 6,
            false_echoes: 0.01,
            false_silences: 0.2,
            passed: 0.01,
            passed_at_edge: 0.4,
            passed_in_silence: 0.27,
            passed_reach: 2.0,
            hit: 0.85,
            hit_if_held: 0.0,
            patch: 0.1,
            patch_tail: 0.3,
            relative_sigma: 0.035,
            late: 0.005,
            prior: -2.0,
            blocking: 0.8,
            same_place: 0.06,
            redundancy: 0.95,
            doubt: 1.3,
            free_gain: 1.6,
            occupied_gain: 0.15,
            slant: 0.5,
            hearing: 2.0,
            passed_aside: 0.33,
            wall_length: 0.9,
            walls: 0.05,
            straight: 0.53,
            main_direction: None,
            max_visits: 2e8,
        }
    }
}

impl RefineParams {
    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`RefineError::Parameter`] names the first field that is out of range.
    pub fn validate(&self) -> Result<(), RefineError> {
        let fields: [(&'static str, f64, f64, f64); 28] = [
            ("iterations", f64::from(self.iterations), 1.0, 100.0),
            ("false_echoes", self.false_echoes, 0.001, 0.9),
            ("false_silences", self.false_silences, 0.001, 0.99),
            ("passed", self.passed, 0.001, 0.5),
            ("passed_at_edge", self.passed_at_edge, 0.001, 0.5),
            ("passed_in_silence", self.passed_in_silence, 0.001, 0.5),
            ("passed_reach", self.passed_reach, 0.05, 1000.0),
            ("hit", self.hit, 0.5, 0.999),
            ("hit_if_held", self.hit_if_held, 0.0, 1.0),
            ("patch", self.patch, 0.005, 2.0),
            ("patch_tail", self.patch_tail, 0.005, 2.0),
            ("relative_sigma", self.relative_sigma, 0.0, 0.2),
            ("late", self.late, 0.0, 0.2),
            ("prior", self.prior, -10.0, 2.0),
            ("blocking", self.blocking, 0.0, 20.0),
            ("same_place", self.same_place, 0.001, 10.0),
            ("redundancy", self.redundancy, 0.0, 1.0),
            ("doubt", self.doubt, 0.0, 5.0),
            ("free_gain", self.free_gain, 0.1, 5.0),
            ("occupied_gain", self.occupied_gain, 0.01, 5.0),
            ("slant", self.slant, 0.05, 10.0),
            ("hearing", self.hearing, 1.0, 10.0),
            ("passed_aside", self.passed_aside, 0.0, 1.0),
            ("wall_length", self.wall_length, 0.05, 1000.0),
            ("walls", self.walls, 0.001, 0.5),
            ("straight", self.straight, 0.0, 1.0),
            (
                "main_direction",
                self.main_direction.unwrap_or(0.0),
                -1e3,
                1e3,
            ),
            ("max_visits", self.max_visits, 1e5, 1e12),
        ];
        match fields
            .into_iter()
            .find(|&(_, found, low, high)| !(low..=high).contains(&found))
        {
            None => Ok(()),
            Some((key, found, low, high)) => Err(RefineError::Parameter {
                key,
                low,
                high,
                found,
            }),
        }
    }
}
