//! `delta-cal forward` and `delta-cal inverse`.

use crate::support::{Folder, HEADER, NOMINAL, cases, csv, distance, exact, nominal_arms, rows_of};

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

#[test]
fn a_row_without_solution_is_named_and_nothing_is_written() {
    // At 0° the elbows are 424 mm from the robot's axis, out of reach of forearms of 300 mm. Straight below the first
    // motor, 260 + 480 = 740 mm away, its arm is fully stretched.
    let short = NOMINAL.replace("forearm_mm = 480", "forearm_mm = 300");
    let wide = NOMINAL.replace("= -60", "= -180").replace("= 90", "= 180");
    let table = "
        inverse ⇒ 0,0,-400\\n0,0,-2000 ⇒ in.csv:3: unreachable for arm 1
        inverse ⇒ 0,0,-400\\n164,0,-740 ⇒ in.csv:3: singular (type 1): upper arm and forearm of arm 1
        inverse ⇒ 0,0,-100 ⇒ in.csv:2: unreachable for arm 1
        wide inverse ⇒ 0,0,-400\\n0,0,400 ⇒ in.csv:3: the platform would be above its elbows
        short forward ⇒ 60,60,60\\n# x\\n0,0,0 ⇒ in.csv:4: unreachable for arm
        ";
    let folder = folder();
    folder.write("short.toml", short);
    folder.write("wide.toml", wide);
    for [command, rows, expected] in cases(table) {
        let (robot, command) = command.split_once(' ').unwrap_or(("robot", &command));
        let header = match command {
            "forward" => "q1_deg,q2_deg,q3_deg",
            _ => "x_mm,y_mm,z_mm",
        };
        folder.write("in.csv", format!("{header}\n{rows}\n"));
        for output in ["-", "out.csv"] {
            let run = folder.run(&format!("{command} {robot}.toml in.csv --output {output}"));
            assert_eq!((run.code, run.stdout.as_str()), (3, ""), "{expected}");
            assert!(run.stderr.contains(&expected), "{expected}: {}", run.stderr);
        }
        assert_eq!(
            folder.names(),
            ["in.csv", "robot.toml", "short.toml", "wide.toml"]
        );
    }
}
