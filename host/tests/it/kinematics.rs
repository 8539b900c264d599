//! `delta-cal forward` and `delta-cal inverse`.

use crate::support::{
    Folder, HEADER, NOMINAL, TOWERS, cases, csv, distance, exact, nominal_arms, robot_toml, rows_of,
};

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("robot.toml", NOMINAL);
    folder
}

#[test]
fn forward_agrees_with_the_published_positions_of_a_robot() {
    // The Delta of the Trossen forum: arms at −90°, 30°, 150°.
    let radius = (457.3 - 115.0) / (2.0 * 3f64.sqrt());
    let arms = [-90.0, 30.0, 150.0_f64].map(|theta| {
        let (sin, cos) = theta.to_radians().sin_cos();
        [
            radius * cos,
            radius * sin,
            0.0,
            theta,
            0.0,
            112.0,
            0.0,
            232.0,
        ]
    });
    let folder = Folder::new();
    folder.write("robot.toml", robot_toml(&arms));
    let run = folder
        .run_with(
            "forward robot.toml",
            "q1_deg,q2_deg,q3_deg\n0,0,0\n10,20,30\n",
        )
        .ok();
    assert!(run.stdout.starts_with(HEADER));
    let rows = rows_of(&run.stdout);
    let published = [[0.0, 0.0, -96.8590], [10.1168, -16.3280, -148.1187]];
    for (row, expected) in rows.iter().zip(published) {
        assert!(
            distance([row[3], row[4], row[5]], expected) < 1e-4,
            "{row:?}"
        );
    }

    // And back, from standard input to a file.
    folder
        .run_with("inverse robot.toml - --output angles.csv", &run.stdout)
        .ok();
    for (row, expected) in rows_of(&folder.read("angles.csv"))
        .iter()
        .zip([[0.0; 3], [10.0, 20.0, 30.0]])
    {
        assert!(
            distance([row[0], row[1], row[2]], expected) < 1e-9,
            "{row:?}"
        );
    }
}

#[test]
fn a_whole_samples_file_is_computed_from_its_angles_or_from_its_positions() {
    let samples = exact(&nominal_arms(), 25);
    let folder = folder();
    // What is not needed is not looked at.
    let mut wrong = samples.clone();
    for (_, x) in &mut wrong {
        *x = [1.0, 2.0, 3.0];
    }
    folder.write("angles.csv", csv(&wrong));
    wrong.clone_from(&samples);
    for (q, _) in &mut wrong {
        *q = [1000.0; 3];
    }
    folder.write("positions.csv", csv(&wrong));
    for command in [
        "forward robot.toml angles.csv",
        "inverse robot.toml positions.csv",
    ] {
        let run = folder.run(command).ok();
        let rows = rows_of(&run.stdout);
        assert!(run.stdout.starts_with(HEADER));
        assert_eq!(rows.len(), 25);
        for (row, (q, x)) in rows.iter().zip(&samples) {
            assert!(distance([row[0], row[1], row[2]], *q) < 1e-9, "{row:?}");
            assert!(distance([row[3], row[4], row[5]], *x) < 1e-8, "{row:?}");
        }
    }
}

#[test]
fn radians_and_metres_are_read() {
    let folder = folder();
    let degrees = folder
        .run_with("forward robot.toml", "q1_deg,q2_deg,q3_deg\n90,0,-45\n")
        .ok();
    let radians = format!(
        "q2_rad,q1_rad,q3_rad\n0,{:?},{:?}\n",
        std::f64::consts::FRAC_PI_2,
        -std::f64::consts::FRAC_PI_4
    );
    let same = folder.run_with("forward robot.toml -", &radians).ok();
    assert_eq!(degrees.stdout, same.stdout);

    let millimetres = folder
        .run_with("inverse robot.toml", "x_mm,y_mm,z_mm\n62.5,-125,-400\n")
        .ok();
    let same = folder
        .run_with("inverse robot.toml", "x_m,y_m,z_m\n0.0625,-0.125,-0.4\n")
        .ok();
    assert_eq!(millimetres.stdout, same.stdout);
}

#[test]
fn travels_are_written_in_the_unit_of_the_robot_file() {
    let folder = Folder::new();
    let robot = format!("{TOWERS}\n[convention]\nlength_unit = \"inch\"\n");
    folder.write("robot.toml", robot);
    // An inch is 25.4 mm.
    folder.write("travels.csv", "s1_mm,s2_mm,s3_mm\n254,279.4,304.8\n");
    let inches = folder.run("forward robot.toml travels.csv").ok().stdout;
    let header = "s1_in,s2_in,s3_in,x_in,y_in,z_in\n10,11,12,";
    assert!(inches.starts_with(header), "{inches}");
    folder.write("inches.csv", &inches);
    let again = folder.run("forward robot.toml inches.csv").ok().stdout;
    assert_eq!(again, inches);
}

#[test]
fn numbers_are_written_with_at_most_nine_decimals() {
    let folder = folder();
    // A symmetric robot at equal angles is on its axis: √(480² − (164 + 260)²) below its elbows.
    let run = folder
        .run_with("forward robot.toml", "q1_deg,q2_deg,q3_deg\n-0,0,0\n")
        .ok();
    let z = -(480f64.powi(2) - 424f64.powi(2)).sqrt();
    assert_eq!(run.stdout, format!("{HEADER}0,0,0,0,0,{z:.9}\n"));
    let run = folder
        .run_with(
            "forward robot.toml",
            "q1_deg,q2_deg,q3_deg\n12.50,100e-1,1.23456789012\n",
        )
        .ok();
    let row = run.stdout.lines().nth(1).unwrap();
    assert!(row.starts_with("12.5,10,1.23456789,"), "{row}");
}

#[test]
fn a_row_without_solution_is_named_and_nothing_is_written() {
    // At 0° the elbows are 424 mm from the robot's axis, further than forearms of 300 mm reach.
    // Straight below the first motor, 260 + 480 = 740 mm away, its arm is stretched.
    let short = NOMINAL.replace("forearm_mm = 480", "forearm_mm = 300");
    let wide = NOMINAL.replace("= -60", "= -180").replace("= 90", "= 180");
    let table = "
        inverse ⇒ 0,0,-400\\n0,0,-2000 ⇒ in.csv:3: unreachable for arm 1
        inverse ⇒ 0,0,-400\\n164,0,-740 ⇒ in.csv:3: singular (type 1): upper arm and forearm of arm 1
        inverse ⇒ 0,0,-100 ⇒ in.csv:2: unreachable for arm 1
        wide inverse ⇒ 0,0,-400\\n0,0,400 ⇒ in.csv:3: the platform would be above its elbows
        short forward ⇒ 60,60,60\\n# x\\n0,0,0 ⇒ in.csv:4: unreachable for arm
        ";
    for [command, rows, expected] in cases(table) {
        let (robot, command) = command.split_once(' ').unwrap_or(("", &command));
        let header = match command {
            "forward" => "q1_deg,q2_deg,q3_deg",
            _ => "x_mm,y_mm,z_mm",
        };
        let folder = folder();
        folder.write(
            "robot.toml",
            match robot {
                "wide" => &wide,
                "short" => &short,
                _ => NOMINAL,
            },
        );
        folder.write("in.csv", format!("{header}\n{rows}\n"));
        let run = folder.run(&format!("{command} robot.toml in.csv --output out.csv"));
        assert_eq!(run.code, 3, "{expected}");
        assert!(run.stderr.contains(&expected), "{expected}: {}", run.stderr);
        let run = folder.run(&format!("{command} robot.toml in.csv"));
        assert_eq!((run.code, run.stdout.as_str()), (3, ""));
        assert_eq!(folder.names(), ["in.csv", "robot.toml"]);
    }
}

#[test]
fn an_input_file_is_never_replaced() {
    let folder = folder();
    let angles = "q1_deg,q2_deg,q3_deg\n0,0,0\n";
    folder.write("in.csv", angles);
    for output in ["in.csv", "robot.toml"] {
        let run = folder.run(&format!("forward robot.toml in.csv --output {output}"));
        assert_eq!(run.code, 2);
    }
    assert_eq!(folder.read("in.csv"), angles);
    assert_eq!(folder.read("robot.toml"), NOMINAL);
}
