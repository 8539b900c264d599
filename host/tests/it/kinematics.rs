//! `delta-cal forward` and `delta-cal inverse`.

use crate::support::{Folder, HEADER, NOMINAL, csv, distance, exact, nominal_arms, rows_of};

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", NOMINAL);
    folder
}

#[test]
fn a_whole_samples_file_is_computed_from_its_angles_or_from_its_positions() {
    let samples = exact(&nominal_arms(), 25);
    let folder = folder();
    // Columns that are not needed are ignored.
    let without_positions: Vec<_> = samples.iter().map(|(q, _)| (*q, [1.0, 2.0, 3.0])).collect();
    let without_angles: Vec<_> = samples.iter().map(|(_, x)| ([1000.0; 3], *x)).collect();
    folder.write("angles.csv", csv(&without_positions));
    folder.write("positions.csv", csv(&without_angles));
    for (command, from) in [
        ("forward robot.toml", "angles.csv"),
        ("inverse robot.toml -", "positions.csv"),
    ] {
        let run = folder.run(&format!("{} {from}", command.trim_end_matches(" -")));
        let printed = run.ok().stdout;
        // The same from standard input to a file.
        let command = format!("{command} --output out.csv");
        folder.run_where(&command, &folder.read(from), &[]).ok();
        assert_eq!(folder.read("out.csv"), printed);
        let rows = rows_of(&printed);
        assert!(printed.starts_with(HEADER));
        assert_eq!(rows.len(), 25);
        for (row, (q, x)) in rows.iter().zip(&samples) {
            assert!(distance([row[0], row[1], row[2]], *q) < 1e-9, "{row:?}");
            assert!(distance([row[3], row[4], row[5]], *x) < 1e-8, "{row:?}");
        }
    }
}
