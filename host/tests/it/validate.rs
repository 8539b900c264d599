//! `delta-cal validate`: a robot file against independent measurements and a limit. Its figures and refusals are `cases`.

use crate::support::{Folder, NOISE, NOMINAL, csv, exact, nominal_arms};

/// The requested number of poses suffices for a decision if they scatter as before.
#[test]
fn as_many_poses_as_are_asked_for_decide() {
    let folder = Folder::new();
    folder.write("robot.toml", format!("{NOMINAL}{NOISE}"));
    // All are off by 0.05 mm.
    let validate = |count: u32| {
        let mut samples = exact(&nominal_arms(), count);
        for (_, [x, y, _]) in &mut samples {
            (*x, *y) = (*x + 0.03, *y - 0.04);
        }
        folder.write("check.csv", csv(&samples));
        folder.run("validate robot.toml check.csv --limit 0.051mm --json -")
    };
    let few = validate(16).ends(6, "Measure ").json();
    let asked = few["rms_error"]["poses_to_decide"].as_u64().unwrap();
    assert!(asked > 16, "{asked}");
    // The scatter falls with each further row, and the requested number is more than enough.
    validate(u32::try_from(asked).unwrap()).ok();
}
