//! `mobot guard`: the process that owns a base's port while another one drives it.

use crate::args::GuardArgs;
use crate::output::Outcome;

pub(super) fn run(args: GuardArgs) -> anyhow::Result<Outcome> {
    mobot_hw::guard::run(args.words)?;
    Ok(Outcome::Done)
}
