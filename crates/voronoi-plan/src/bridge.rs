//! (being written)
use crate::lattice::Lattice;
use crate::skeleton::Trace;
use morpho::BitImage;
pub(crate) fn bridge(
    trace: Trace,
    _core: &BitImage,
    _left_out: &BitImage,
    _lattice: &Lattice<'_>,
) -> Trace {
    trace
}
