//! What a query is answered with.

use occgrid::Point2;

use crate::Route;

/// The answer to a query.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Plan {
    /// Start and goal are joined.
    Ok(Route),
    /// They are not, for this radius.
    NoRoute {
        /// The narrowest place of the widest way between them; of width 0, in the middle of the thinnest
        /// wall, if there is no way for any radius.
        bottleneck: Bottleneck,
    },
    /// The robot does not fit at the start.
    StartBlocked {
        /// Clearance there [m].
        clearance: f64,
    },
    /// The robot does not fit at the goal.
    GoalBlocked {
        /// Clearance there [m].
        clearance: f64,
    },
    /// Start or goal is not on the map.
    Outside,
}

/// What became of a query, in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum PlanStatus {
    /// There is a route.
    Ok,
    /// There is none for this radius.
    NoRoute,
    /// The robot does not fit at the start.
    StartBlocked,
    /// The robot does not fit at the goal.
    GoalBlocked,
    /// Start or goal is not on the map.
    Outside,
}

impl std::fmt::Display for PlanStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Ok => "ok",
            Self::NoRoute => "no_route",
            Self::StartBlocked => "start_blocked",
            Self::GoalBlocked => "goal_blocked",
            Self::Outside => "outside",
        })
    }
}

impl Plan {
    /// What became of the query.
    #[must_use]
    pub const fn status(&self) -> PlanStatus {
        match self {
            Self::Ok(_) => PlanStatus::Ok,
            Self::NoRoute { .. } => PlanStatus::NoRoute,
            Self::StartBlocked { .. } => PlanStatus::StartBlocked,
            Self::GoalBlocked { .. } => PlanStatus::GoalBlocked,
            Self::Outside => PlanStatus::Outside,
        }
    }

    /// The route, if there is one.
    #[must_use]
    pub const fn route(&self) -> Option<&Route> {
        match self {
            Self::Ok(route) => Some(route),
            _ => None,
        }
    }
}

/// The narrowest place of the widest way between a start and a goal.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bottleneck {
    /// Where it is.
    pub place: Point2,
    /// How wide it is there [m]: a robot of half this radius passes, none larger does.
    pub width: f64,
    /// How wide it would have to be for the robot [m].
    pub needed: f64,
}

/// A way between two nodes of the roadmap.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphRoute {
    /// Arcs in order, as indices in the graph.
    pub arcs: Vec<usize>,
    /// Their length [m].
    pub length: f64,
}
