//! The kinematics component in LinuxCNC, where LinuxCNC is.

use crate::check::{Check, output};

/// The Debian package with the component compiler; LinuxCNC itself comes with it.
pub(crate) const PACKAGE: &str = "linuxcnc-uspace-dev";

/// What LinuxCNC's component compiler says of itself, if it is there.
pub(crate) fn found() -> Option<String> {
    output("halcompile --help")?;
    Some("halcompile, LinuxCNC's component compiler".to_owned())
}

pub(crate) fn check(check: &mut Check) {
    if found().is_none() {
        return check.skip(&format!(
            "the Debian package {PACKAGE} is not installed; install it: apt-get install {PACKAGE}"
        ));
    }
    // Not every container may mount; the tests say so as well.
    if output("unshare --user --map-root-user --mount true").is_none() {
        return check.skip(
            "this system allows no private mounts (unshare --user --map-root-user --mount), in which LinuxCNC's \
             folder of modules is changed",
        );
    }
    check.chosen_tests(
        1,
        "cargo test --package delta-cal-host --test it -- --nocapture in_linuxcnc::",
    );
}
