//! The order in which measurements are taken.

use super::planned::Planned;
use crate::planning::poses::ordered_by;

/// Sorted by what has to be set up: instrument, gauge block, point; and within each in the order of a short
/// travel.
pub(super) fn in_sequence(measurements: &[Planned]) -> Vec<Planned> {
    let setup = |own: &Planned| (own.kind.name(), own.block, own.point);
    let mut groups: Vec<_> = measurements.iter().map(setup).collect();
    groups.sort_unstable();
    groups.dedup();
    let of_group = |group| {
        let members = measurements.iter().filter(move |own| setup(own) == group);
        let members: Vec<_> = members.cloned().collect();
        ordered_by(&members, |own| &own.pose)
    };
    groups.into_iter().flat_map(of_group).collect()
}
