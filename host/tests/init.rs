//! `delta-cal init`, `completions` and `man`.

use crate::support::{Folder, NOMINAL, TOLERANCE};
use delta_cal_host::files::robot_file::Draft;
use delta_cal_host::{InputText, RobotFile};

const LENGTHS: &str = "init --base-radius 194 --platform-radius 30 --upper-arm 260 --forearm 480";

#[test]
fn the_file_is_the_robot_of_its_options() {
    let folder = Folder::new();
    let run = folder.run(LENGTHS).ok();
    assert!(run.stdout.contains("Written: robot.toml"), "{}", run.stdout);
    let text = folder.read("robot.toml");
    let read = |text: &str| RobotFile::read(&InputText::new("robot.toml", text)).unwrap();
    let noise = "[noise]\nposition_mm = 0.02\njoint_deg = 0.002\n";
    assert_eq!(read(&text), read(&format!("{NOMINAL}{TOLERANCE}{noise}")));
    // A comment for every key.
    let keys = text
        .lines()
        .filter(|line| !line.starts_with('#') && line.contains('='));
    assert!(keys.clone().all(|line| line.contains('#')), "{text}");
    assert_eq!(keys.count(), 10);
    assert!(text.lines().all(|line| line.chars().count() <= 100));

    // What it names as the next step works.
    folder
        .run("plan robot.toml --count 12 --output poses.csv")
        .ok();
}

#[test]
fn other_limits_and_tolerances_are_taken() {
    let folder = Folder::new();
    let options = "--joint-min -30 --joint-max 80 --length-tolerance 0.1 --angle-tolerance 0.05";
    let run = folder.run(&format!("{LENGTHS} {options} --output -")).ok();
    for line in [
        "min_deg = -30 ",
        "max_deg = 80 ",
        "length_mm = 0.1 ",
        "angle_deg = 0.05 ",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
    assert!(folder.names().is_empty());
}

#[test]
fn what_is_no_robot_is_refused_and_no_file_is_replaced() {
    let folder = Folder::new();
    let run = folder.run("init --base-radius 194");
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("platform's centre"), "{}", run.stderr);
    let run = folder.run(&LENGTHS.replace("480", "-480"));
    assert_eq!(run.code, 2, "{}", run.stderr);
    let run = folder.run(&LENGTHS.replace("480", "0"));
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(folder.names().is_empty());
    folder.write("robot.toml", "mine");
    let run = folder.run(LENGTHS);
    assert_eq!(run.code, 4, "{}", run.stderr);
    assert_eq!(folder.read("robot.toml"), "mine");
}

#[test]
fn questions_are_asked_until_a_number_is_given() {
    let mut asked = Vec::new();
    let known = [Some(194.0), None, None, Some(480.0), None, None, None, None];
    let answers = "thirty\n30\n260,5\n\n85\n\n\n";
    let draft = Draft::ask(known, answers.as_bytes(), &mut asked).unwrap();
    assert_eq!(
        draft,
        Draft {
            base_radius: 194.0,
            platform_radius: 30.0,
            upper_arm: 260.5,
            forearm: 480.0,
            joints: (-60.0, 85.0),
            tolerance: (0.5, 0.2),
        }
    );
    let asked = String::from_utf8(asked).unwrap();
    assert_eq!(asked.matches("Enter a number.").count(), 1);
    assert!(
        !asked.contains("z axis"),
        "what is known is not asked: {asked}"
    );
    assert!(Draft::ask([None; 8], "194\n".as_bytes(), Vec::new()).is_err());
}

#[test]
fn shells_and_man_pages_know_every_command() {
    let folder = Folder::new();
    let commands = [
        "init",
        "calibrate",
        "plan",
        "check",
        "simulate",
        "export",
        "device",
    ];
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = folder.run(&format!("completions {shell}")).ok().stdout;
        assert!(commands.iter().all(|name| text.contains(name)), "{shell}");
        assert!(text.contains("held-out"), "{shell}");
    }
    folder.run("man --output man1").ok();
    let page = folder.read("man1/delta-cal-calibrate.1");
    assert!(
        page.contains("held\\-out") && page.starts_with(".ie"),
        "{page}"
    );
    for name in [
        "delta-cal.1",
        "delta-cal-device-verify.1",
        "delta-cal-simulate-merge.1",
    ] {
        assert!(folder.path("man1").join(name).exists(), "{name}");
    }
}
