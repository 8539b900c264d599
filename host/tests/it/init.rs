//! `delta-cal init`, `completions` and `man`.

use crate::support::{Folder, NOMINAL, TOLERANCE};
use delta_cal::robot::Drive;
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
    // A comment beside every number.
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
    let draft = Draft::ask(Drive::Rotary, &known, answers.as_bytes(), &mut asked).unwrap();
    let text = draft.to_toml("robot.toml").unwrap();
    for line in [
        "base_radius_mm = 194 ",
        "platform_radius_mm = 30 ",
        "upper_arm_mm = 260.5 ",
        "forearm_mm = 480 ",
        "min_deg = -60 ",
        "max_deg = 85 ",
        "length_mm = 0.5 ",
        "angle_deg = 0.2 ",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let asked = String::from_utf8(asked).unwrap();
    assert_eq!(asked.matches("Enter a number.").count(), 1);
    assert!(
        !asked.contains("z axis"),
        "what is known is not asked: {asked}"
    );
    let none = [None; 8];
    assert!(Draft::ask(Drive::Rotary, &none, "194\n".as_bytes(), Vec::new()).is_err());
}

const TOWERS: &str =
    "init --kind linear --tower-radius 140 --forearm 330 --travel-min 100 --travel-max 600";

#[test]
fn the_file_of_carriages_on_towers_is_the_robot_of_its_options() {
    let folder = Folder::new();
    let run = folder.run(&format!("{TOWERS} --zero-tolerance 3")).ok();
    assert!(run.stdout.contains("Written: robot.toml"), "{}", run.stdout);
    let text = folder.read("robot.toml");
    let read = |text: &str| RobotFile::read(&InputText::new("robot.toml", text)).unwrap();
    let same = "[nominal]\nkind = \"linear\"\ntower_radius_mm = 140\nforearm_mm = 330\n\
                [joints]\nmin_mm = 100\nmax_mm = 600\n\
                [tolerance]\nlength_mm = 0.5\nangle_deg = 0.17\nscale = 0.001\nzero_mm = 3\n\
                [noise]\nposition_mm = 0.02\njoint_mm = 0.01\n";
    assert_eq!(read(&text), read(same));
    let keys = text
        .lines()
        .filter(|line| !line.starts_with('#') && line.contains('='));
    assert!(keys.clone().all(|line| line.contains('#')), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 100));
    folder
        .run("plan robot.toml --count 12 --output poses.csv")
        .ok();
}

#[test]
fn options_of_the_other_kind_of_robot_are_refused() {
    let folder = Folder::new();
    for (options, cause) in [
        (format!("{TOWERS} --upper-arm 260"), "--upper-arm"),
        (format!("{LENGTHS} --zero-tolerance 5"), "--zero-tolerance"),
        (
            "init --kind linear --forearm 330".to_owned(),
            "delta radius",
        ),
    ] {
        let run = folder.run(&options);
        assert_eq!(run.code, 2, "{}", run.stderr);
        assert!(run.stderr.contains(cause), "{}", run.stderr);
    }
    assert!(folder.names().is_empty());
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
