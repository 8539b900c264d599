//! The fixture of `target-tests` under QEMU and on this machine: the same bits. And the core
//! for the bare target with every combination of its features.

// A test fails by panicking.
#![allow(clippy::expect_used, clippy::panic)]

mod on_target {
    use std::io::Read;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Stdio};
    use std::sync::{Mutex, MutexGuard, PoisonError};
    use std::time::{Duration, Instant};

    const TARGET: &str = "thumbv7em-none-eabihf";
    const PACKAGE: &str = "delta-cal-target-tests";
    /// The run takes a second or two; a firmware that hangs must not hang the tests.
    const LONGEST_RUN: Duration = Duration::from_mins(5);

    #[test]
    fn same_bits_as_on_the_host() {
        compare();
    }

    #[test]
    fn core_builds_with_every_combination_of_features() {
        let _exclusive = directory_lock();
        require_target();
        for features in ["", "defmt", "serde", "defmt,serde"] {
            cargo(&[
                "build",
                "--release",
                "--package",
                "delta-cal",
                "--target",
                TARGET,
                "--features",
                features,
            ]);
        }
    }

    fn compare() {
        let _exclusive = directory_lock();
        require_target();
        require_qemu();
        let build = ["build", "--release", "--package", PACKAGE];
        cargo(&[&build[..], &["--target", TARGET]].concat());
        cargo(&build);
        let target = qemu(&directory().join(TARGET).join("release").join(PACKAGE));
        let host = run(Command::new(directory().join("release").join(PACKAGE)));

        println!("on the Cortex-M4F (instructions, not cycles):");
        for line in target.lines().filter(|line| line.starts_with("INSTR")) {
            println!("  {line}");
        }
        let (target, host) = (bits(&target), bits(&host));
        for scalar in ["f32", "f64"] {
            let lines = host.iter().filter(|line| line.starts_with(scalar)).count();
            assert!(
                lines > 500,
                "only {lines} lines of {scalar}: the fixture was cut short"
            );
        }
        for (number, (target, host)) in target.iter().zip(&host).enumerate() {
            assert_eq!(
                target, host,
                "line {number} differs: target left, host right"
            );
        }
        assert_eq!(
            target.len(),
            host.len(),
            "number of lines on target and host"
        );
    }

    fn bits(output: &str) -> Vec<&str> {
        output
            .lines()
            .filter_map(|line| line.strip_prefix("BITS "))
            .collect()
    }

    /// A target directory of its own, so that no other build exchanges the programs meanwhile.
    fn directory() -> PathBuf {
        Path::new(env!("CARGO_TARGET_TMPDIR"))
            .parent()
            .expect("the temporary directory is in the target directory")
            .join("firmware")
    }

    /// The builds overwrite each other's programs, with and without a feature.
    fn directory_lock() -> MutexGuard<'static, ()> {
        static LOCK: Mutex<()> = Mutex::new(());
        LOCK.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn cargo(arguments: &[&str]) {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        command
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .args(arguments)
            .arg("--quiet")
            .arg("--target-dir")
            .arg(directory());
        run(command);
    }

    fn require_target() {
        let mut rustc = Command::new("rustc");
        rustc
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .args(["--print", "target-libdir", "--target", TARGET]);
        assert!(
            Path::new(run(rustc).trim()).is_dir(),
            "the Rust target is missing; install it: rustup target add {TARGET}"
        );
    }

    fn require_qemu() {
        assert!(
            Command::new("qemu-system-arm")
                .arg("--version")
                .output()
                .is_ok_and(|output| output.status.success()),
            "QEMU is missing; install it: apt-get install qemu-system-arm"
        );
    }

    fn qemu(firmware: &Path) -> String {
        let mut command = Command::new("qemu-system-arm");
        command
            .args("-machine mps2-an386 -nographic -monitor none -serial none".split(' '))
            .args("-semihosting-config enable=on,target=native".split(' '))
            .args("-icount shift=0,sleep=off -kernel".split(' '))
            .arg(firmware);
        run(command)
    }

    /// Standard output of a program that must succeed.
    fn run(mut command: Command) -> String {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let mut pipe = child.stdout.take().expect("the output is piped");
        let reader = std::thread::spawn(move || {
            let mut text = String::new();
            pipe.read_to_string(&mut text).map(|_| text)
        });
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().expect("the child can be waited for") {
                break status;
            }
            if start.elapsed() > LONGEST_RUN {
                let _ = child.kill();
                panic!("{command:?} has not ended after {LONGEST_RUN:?}");
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let text = reader
            .join()
            .expect("the reader does not panic")
            .expect("the output is text");
        assert!(status.success(), "{command:?}: {status}\n{}", tail(&text));
        text
    }

    fn tail(text: &str) -> &str {
        let start = text.len().saturating_sub(2000);
        text.get(start..).unwrap_or(text)
    }
}
