//! The passes over the log: every shot explained by what all others say, again and again.

use crate::{MapFrame, SonarModel};

use super::RefineParams;
use super::beam::Scratch;
use super::heading;
use super::lines::along_walls;
use super::rays::{Ray, work};
use super::turns::{Evidence, NOTHING, Turns, likeliest};

/// Strongest belief that one shot may hold about its own arc or about what is in its way [log-odds].
const BELIEF_LIMIT: f64 = 6.0;
/// Beliefs of single cells count up to here when the parts of an arc are compared [log-odds].
const CELL_LIMIT: f64 = 4.0;
/// Share of a shot's last hidden state that stays in the next pass: keeps pairs of shots from swinging.
const DAMPING: f64 = 0.3;
/// Main directions that are tried, and passes for each.
const TRIES: usize = 3;
const PASSES_A_TRY: u32 = 2;
/// Directions tried beside the best one [rad].
const BESIDE: f64 = 0.035;
/// How much the agreement of places on walls of a direction counts beside the fit of the passes.
const AGREEMENT: f64 = 0.5;
/// Share of the allowed work that the choice of the direction may take.
const CHOICE: f64 = 0.1;

/// What the passes found out.
#[derive(Debug, Clone)]
pub(super) struct Beliefs {
    pub(super) rays: Vec<Ray>,
    pub(super) turns: Turns,
    /// What all shots say of each cell.
    pub(super) sums: Vec<Evidence>,
    /// What goes along walls.
    along: Vec<Evidence>,
    /// How well the rays were explained [log-odds].
    fit: f64,
}

impl Beliefs {
    fn all(&self, at: usize) -> Evidence {
        let (sum, along) = (&self.sums[at], &self.along[at]);
        std::array::from_fn(|k| sum[k] + along[k])
    }

    /// The turn of the wall that may be in a cell.
    pub(super) fn likeliest(&self, at: usize) -> usize {
        likeliest(&self.all(at))
    }

    /// Evidence for a wall of any turn in each cell; exactly 0 where nothing is known.
    pub(super) fn any(&self) -> Vec<f32> {
        let any = |at: usize| {
            let all = self.all(at);
            if all.iter().all(|e| e.abs() < 1e-3) {
                0.0
            } else {
                self.turns.any(&all)
            }
        };
        (0..self.sums.len()).map(any).collect()
    }
}

/// Explains a log, with walls mostly square and parallel to a direction [rad, in the map].
pub(super) fn explain_log(
    rays: Vec<Ray>,
    scratch: &mut Scratch,
    fine: &MapFrame,
    main: f64,
    params: &RefineParams,
) -> Beliefs {
    let turns = Turns::new(main - fine.origin().theta, params.slant);
    scratch.face(turns.clone());
    let nothing = vec![NOTHING; fine.cell_count()];
    let mut beliefs = Beliefs {
        rays,
        turns,
        sums: nothing.clone(),
        along: nothing,
        fit: 0.0,
    };
    for _ in 0..params.iterations {
        let mut next = vec![NOTHING; fine.cell_count()];
        beliefs.fit = 0.0;
        for ray in &mut beliefs.rays {
            let before = (&beliefs.sums[..], &beliefs.along[..]);
            beliefs.fit += pass(ray, scratch, before, &mut next, params);
        }
        beliefs.along = along_walls(fine, &next, &beliefs.turns, params);
        beliefs.sums = next;
    }
    beliefs
}

/// The direction to which most walls are square or parallel [rad]: of those on which places agree, the one with
/// which the log is explained best.
pub(super) fn main_direction(
    rays: &[Ray],
    scratch: &mut Scratch,
    fine: &MapFrame,
    model: &SonarModel,
    params: &RefineParams,
) -> f64 {
    let candidates = heading::candidates(rays, model, params, TRIES);
    let some = sample(rays, model, params, fine.resolution());
    let total: f64 = some.iter().filter(|r| r.echo).map(|r| r.weight).sum();
    let few = RefineParams {
        iterations: PASSES_A_TRY,
        ..*params
    };
    let mut fit = |main| explain_log(some.clone(), scratch, fine, main, &few).fit / (total + 1e-9);
    let mut best = (f64::NEG_INFINITY, 0.0, 0.0);
    for (main, agreement) in candidates {
        let fit = fit(main);
        let score = fit + AGREEMENT * agreement.ln();
        if score > best.0 {
            best = (score, fit, main);
        }
    }
    let (_, mut best_fit, mut main) = best;
    for beside in [best.2 - BESIDE, best.2 + BESIDE] {
        let fit = fit(beside);
        if fit > best_fit {
            (best_fit, main) = (fit, beside);
        }
    }
    main
}

/// Enough rays to tell directions apart: no more than are independent, nor than the work allowed.
fn sample(rays: &[Ray], model: &SonarModel, params: &RefineParams, resolution: f64) -> Vec<Ray> {
    let independent: f64 = rays.iter().map(|ray| ray.weight).sum();
    let passes = (TRIES as f64 + 2.0) * f64::from(PASSES_A_TRY);
    let work = work(rays, model, params, resolution) * passes / (CHOICE * params.max_visits);
    let every = (0.5 * rays.len() as f64 / (independent + 1e-9)).max(work.ceil());
    let every = (every as usize).max(1);
    let kept = rays.iter().step_by(every);
    kept.map(|ray| Ray {
        weight: ray.weight * every as f64,
        ..ray.clone()
    })
    .collect()
}

/// One shot in one pass: takes its own last message out of the sums, explains its reading by what the others
/// believe, and adds its new message. Returns how well the reading is explained [log-odds].
fn pass(
    ray: &mut Ray,
    scratch: &mut Scratch,
    (sums, along): (&[Evidence], &[Evidence]),
    next: &mut [Evidence],
    params: &RefineParams,
) -> f64 {
    scratch.collect(ray);
    scratch.cover(&ray.shares);
    scratch.beliefs_of_others(sums, along, ray.trust, ray.weight);
    let blocked = scratch.blocked();
    let (false_share, log_ratio) = if ray.echo {
        let (support, shares) = scratch.explain_arc(CELL_LIMIT, &blocked);
        for (old, new) in ray.shares.iter_mut().zip(shares) {
            *old = (DAMPING as f32) * *old + (1.0 - DAMPING as f32) * new;
        }
        (
            params.false_echoes,
            support.clamp(-BELIEF_LIMIT, BELIEF_LIMIT),
        )
    } else {
        let mean = blocked.iter().sum::<f64>() / blocked.len() as f64;
        (params.false_silences, -mean.min(BELIEF_LIMIT))
    };
    let prior = ((1.0 - false_share) / false_share).ln();
    let trust = 1.0 / (1.0 + (-(prior + log_ratio)).exp());
    ray.trust = DAMPING * ray.trust + (1.0 - DAMPING) * trust;
    scratch.cover(&ray.shares);
    let weight = ray.weight as f32;
    for (index, message) in scratch.messages(ray.trust) {
        for (sum, m) in next[index as usize].iter_mut().zip(message) {
            *sum += weight * m;
        }
    }
    ray.weight * (false_share + (1.0 - false_share) * log_ratio.exp()).ln()
}
