//! How a wall may stand: square to the room's main direction, along it, or at half a right angle between.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Turns of walls that are told apart.
pub(super) const TURNS: usize = 4;
/// Evidence for a wall of each turn against free [log-odds].
pub(super) type Evidence = [f32; TURNS];
pub(super) const NOTHING: Evidence = [0.0; TURNS];

/// Prior of each turn: rooms are mostly right-angled.
const PRIOR: Evidence = [0.43, 0.07, 0.43, 0.07];
/// How fast a surface turned away from its wall becomes unlikely, to 1/e by this angle [rad].
const OFF: f64 = 0.25;
/// Share of answers that a wall gives at any slant.
const ROUGH: f64 = 0.2;

/// Steps of a table over the squared cosine of the slant.
const STEPS: usize = 64;

/// The turns of one room, on the axes of a frame.
#[derive(Debug, Clone)]
pub(super) struct Turns {
    /// Normal of the first [rad].
    main: f64,
    /// Cosine and sine of each normal.
    normals: [[f64; 2]; TURNS],
    /// How surely a wall answers, over the squared cosine of the slant.
    answers: Vec<f32>,
}

impl Turns {
    pub(super) fn new(main: f64, slant: f64) -> Self {
        // near 0, cos^(1 / slant^2) is a Gaussian of that width
        let power = 0.5 / (slant * slant);
        let answer = |k: usize| (k as f64 / STEPS as f64).powf(power);
        let (sin, cos) = main.sin_cos();
        let (sum, difference) = (FRAC_1_SQRT_2 * (cos + sin), FRAC_1_SQRT_2 * (cos - sin));
        Self {
            main,
            normals: [
                [cos, sin],
                [difference, sum],
                [-sin, cos],
                [-sum, difference],
            ],
            answers: (0..=STEPS)
                .map(|k| (ROUGH + (1.0 - ROUGH) * answer(k)) as f32)
                .collect(),
        }
    }

    /// Normal of a turn [rad].
    pub(super) fn normal(&self, turn: usize) -> f64 {
        self.main + turn as f64 * PI / TURNS as f64
    }

    /// The turn whose normal is nearest to a direction, and the angle from the direction to it [rad].
    pub(super) fn nearest(&self, direction: f64) -> (usize, f64) {
        let step = PI / TURNS as f64;
        let turns = ((direction - self.main) / step).round();
        let turn = (turns as i64).rem_euclid(TURNS as i64) as usize;
        (turn, self.main + turns * step - direction)
    }

    /// How surely a wall of each turn answers a pulse that comes along (dx, dy): a smooth one only if it stands about
    /// square to it.
    pub(super) fn answers(&self, [dx, dy]: [f64; 2]) -> Evidence {
        let scale = STEPS as f64 / (dx * dx + dy * dy).max(1e-12);
        self.normals.map(|[x, y]| {
            let along = dx * x + dy * y;
            let place = (along * along * scale).min(STEPS as f64) as f32;
            let step = (place as usize).min(STEPS - 1);
            let (low, high) = (self.answers[step], self.answers[step + 1]);
            low + (high - low) * (place - step as f32)
        })
    }

    /// Prior weight of a surface of one turn, as far off it as given [rad].
    pub(super) fn strength(&self, turn: usize, off: f64) -> f64 {
        f64::from(PRIOR[turn]) * (-off.abs() / OFF).exp()
    }

    /// Evidence for a wall of any turn.
    pub(super) fn any(&self, evidence: &Evidence) -> f32 {
        let weighted = PRIOR.iter().zip(evidence).map(|(p, e)| p * e.exp());
        weighted.sum::<f32>().ln()
    }
}

/// The turn for which the evidence is strongest.
pub(super) fn likeliest(evidence: &Evidence) -> usize {
    let weighted = |k: usize| evidence[k] + PRIOR[k].ln();
    (1..TURNS).fold(0, |best, k| {
        if weighted(k) > weighted(best) {
            k
        } else {
            best
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_told_apart() {
        let turns = Turns::new(0.3, 0.5);
        for k in 0..TURNS {
            let normal = turns.normal(k);
            let (sin, cos) = normal.sin_cos();
            let [x, y] = turns.normals[k];
            assert!((x - cos).abs() < 1e-12 && (y - sin).abs() < 1e-12);
            for direction in [normal - 0.2, normal + 0.2 + PI, normal - 3.0 * PI] {
                assert_eq!(turns.nearest(direction).0, k);
            }
            // a wall answers best from straight ahead
            let answers = turns.answers([2.0 * cos, 2.0 * sin]);
            assert!((0..TURNS).all(|j| j == k || answers[j] < answers[k]));
            assert!((answers[k] - 1.0).abs() < 1e-6);
        }
        assert!((PRIOR.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }
}
