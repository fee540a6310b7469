//! Exploration: survey, go on along the wall, then to what is left, until nothing is or the time is over.

use occgrid::{
    FrameError, OccupancyGrid, Point2, Pose2, RefineError, RefineParams, Shot, SonarModel, refine,
};

use super::hop::{Hop, HopParams, HopStep};
use super::itinerary::{Itinerary, ItineraryParams, Leg, Reason};
use super::seen::{Seen, SeenParams};
use super::survey::{Survey, SurveyParams};
use super::{Action, Behaviour, Confidence, Event, Motion, Observation, Outcome, StopCause};

/// How a building is explored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExploreParams {
    /// The sonar.
    pub sonar: SonarModel,
    /// How it looks around.
    pub survey: SurveyParams,
    /// What it makes of it.
    pub seen: SeenParams,
    /// Where it goes.
    pub itinerary: ItineraryParams,
    /// How it gets there.
    pub hop: HopParams,
    /// When it ends, whatever is left [s since the first step].
    pub budget: f64,
    /// A latched stop that is not lifted for this long ends the exploration, and so does a pose that cannot be
    /// trusted [s].
    pub patience: f64,
}

impl Default for ExploreParams {
    fn default() -> Self {
        Self {
            sonar: SonarModel {
                sigma: 0.03,
                ..SonarModel::default()
            },
            survey: SurveyParams::default(),
            seen: SeenParams::default(),
            itinerary: ItineraryParams::default(),
            hop: HopParams::default(),
            budget: f64::INFINITY,
            patience: 20.0,
        }
    }
}

/// Counts of an exploration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Stops chosen along walls.
    pub along_walls: usize,
    /// Stops chosen at frontiers.
    pub at_frontiers: usize,
    /// How often a wall led back to a stop that was known.
    pub loops_closed: usize,
    /// Ways that turned out to be blocked.
    pub blocked: usize,
}

#[derive(Debug, Clone)]
enum State {
    Surveying(Survey),
    Hopping(Hop),
}

/// The behaviour.
#[derive(Debug, Clone)]
pub struct Explore {
    params: ExploreParams,
    seen: Seen,
    itinerary: Itinerary,
    state: State,
    tally: Tally,
    began: Option<f64>,
    halted_since: Option<f64>,
    doubtful_since: Option<f64>,
    /// Where the way was blocked last.
    blocked: Option<Point2>,
}

impl Explore {
    /// About to begin, with a survey where the robot stands.
    ///
    /// # Errors
    /// [`FrameError::Resolution`]
    pub fn new(params: ExploreParams) -> Result<Self, FrameError> {
        Ok(Self {
            seen: Seen::new(params.sonar, params.seen)?,
            itinerary: Itinerary::new(params.itinerary),
            state: State::Surveying(Survey::new(params.survey)),
            tally: Tally::default(),
            began: None,
            halted_since: None,
            doubtful_since: None,
            blocked: None,
            params,
        })
    }

    /// What was seen so far: shots, stops and the map on which ways are chosen.
    #[must_use]
    pub const fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Counts so far.
    #[must_use]
    pub const fn tally(&self) -> Tally {
        self.tally
    }

    /// The map of all shots, explained at once.
    ///
    /// # Errors
    /// [`RefineError`] where the sonar's model is unusable.
    pub fn map(&self) -> Result<OccupancyGrid, RefineError> {
        let mut plain = OccupancyGrid::new(self.params.seen.resolution)?;
        plain.integrate(&self.params.sonar, self.seen.shots())?;
        let params = RefineParams {
            hit_if_held: self.params.seen.refine.hit_if_held,
            ..RefineParams::default()
        };
        let grid = refine(self.seen.shots(), &self.params.sonar, &plain, &params)?;
        let (frame, mut log_odds) = (*grid.frame(), grid.log_odds().to_vec());
        self.seen.complete(&frame, &mut log_odds);
        Ok(OccupancyGrid::from_log_odds(frame, log_odds)?.with_limits(grid.limits()))
    }

    /// A latched stop: lifted where that may be, else the end.
    fn halted(&mut self, seen: &Observation<'_>) -> Option<Action> {
        let Some(halt) = seen.halt else {
            self.halted_since = None;
            return None;
        };
        let since = *self.halted_since.get_or_insert(seen.now);
        if halt.cause.needs_a_person() || seen.now - since > self.params.patience {
            return Some(Action::done(Outcome::Stopped(halt.cause)));
        }
        Some(Action {
            motion: Motion::Resume,
            ..Action::stand("resuming")
        })
    }

    /// A pose that is not trusted for long: the map would smear.
    fn doubtful(&mut self, seen: &Observation<'_>) -> Option<Action> {
        let cause = match seen.pose.confidence {
            Confidence::Tracking => {
                self.doubtful_since = None;
                return None;
            }
            Confidence::Uncertain => StopCause::PoseUncertain,
            Confidence::Lost => StopCause::Lost,
        };
        let since = *self.doubtful_since.get_or_insert(seen.now);
        (seen.now - since > self.params.patience).then(|| Action::done(Outcome::Stopped(cause)))
    }

    fn surveyed(&mut self, shots: &[Shot], here: Pose2) -> Action {
        if let Err(error) = self.seen.survey(here.position(), shots) {
            return Action::done(Outcome::GaveUp(error.to_string()));
        }
        let Some(Leg {
            way,
            reason,
            closed_at,
        }) = self.itinerary.next(&self.seen, here)
        else {
            return Action::done(Outcome::Done);
        };
        match reason {
            Reason::Wall => self.tally.along_walls += 1,
            Reason::Frontier => self.tally.at_frontiers += 1,
        }
        self.tally.loops_closed += usize::from(closed_at.is_some());
        let said = match (closed_at, way.last()) {
            (Some(at), _) => format!("loop closed at ({:.2}, {:.2})", at.x, at.y),
            (None, Some(to)) => format!("{reason:?}: next stop ({:.2}, {:.2})", to.x, to.y),
            (None, None) => String::new(),
        };
        self.state = State::Hopping(Hop::new(way, self.params.hop));
        Action::stand("next stop chosen")
            .saying(Event::Note(said))
            .learning(self.seen.map())
    }

    /// A blocked way is looked at from where it ended; one that is blocked twice is not asked for again.
    fn hop_blocked(&mut self, goal: Option<Point2>) {
        self.tally.blocked += 1;
        if let Some(goal) = goal {
            if self.blocked.is_some_and(|b| b.distance(goal) < 0.3) {
                self.itinerary.refuse(goal);
            }
            self.blocked = Some(goal);
        }
    }
}

impl Behaviour for Explore {
    fn step(&mut self, seen: &Observation<'_>) -> Action {
        let here = seen.pose.map_from_base;
        let began = *self.began.get_or_insert(seen.now);
        self.seen
            .tread(here.position(), self.params.itinerary.reach.radius);
        if seen.now - began >= self.params.budget {
            return Action::done(Outcome::BudgetOver);
        }
        if let Some(action) = self.halted(seen).or_else(|| self.doubtful(seen)) {
            return action;
        }
        match &mut self.state {
            State::Surveying(survey) => {
                if let Some(action) = survey.step(seen) {
                    return action;
                }
                let shots = std::mem::replace(survey, Survey::new(self.params.survey)).into_shots();
                self.surveyed(&shots, here)
            }
            State::Hopping(hop) => match hop.step(seen) {
                HopStep::Go(action) => action,
                HopStep::Arrived => {
                    self.state = State::Surveying(Survey::new(self.params.survey));
                    Action::stand("arrived")
                }
                HopStep::Blocked(cause) => {
                    let goal = hop.goal();
                    self.hop_blocked(goal);
                    self.state = State::Surveying(Survey::new(self.params.survey));
                    Action::stand("blocked").saying(Event::Note(format!("way blocked: {cause}")))
                }
            },
        }
    }
}
