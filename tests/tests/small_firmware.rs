//! The two smallest controllers of `firmware-example` under QEMU: each measures, refuses what is wrong, calibrates its robot,
//! stores the parameters, restarts with them, and fits its part.

use crate::budgets::check_pages;
use crate::target::directory;
use delta_cal_verify::{Board, Clock, TARGET, cargo, emulate, have};
use object::{Object, ObjectSection, ObjectSymbol};
use std::path::Path;

/// A turn of the control loop. Ticks of 40 ns.
const TURN: i32 = 25_000;

struct Program {
    name: &'static str,
    /// The status of the wrong measurements of the first attempt, and the arm at fault.
    refusal: [i32; 2],
    /// What is left of the error, in parts of it. A tracker's noise is in it, and a block's is not.
    left: i32,
    /// Bytes of flash, and of memory with the stack.
    flash: u64,
    memory: u64,
}

const PROGRAMS: [Program; 2] = [
    Program {
        name: "touch",
        refusal: [75, 1],
        left: 40,
        flash: 47_104,
        memory: 24_576,
    },
    Program {
        name: "arms",
        refusal: [74, 1],
        left: 10,
        flash: 32_768,
        memory: 16_384,
    },
];

#[test]
fn they_calibrate_themselves_in_little_memory() {
    if !have(&["qemu-system-arm", TARGET]) {
        return;
    }
    let directory = directory("firmware");
    let package = [
        "--package",
        "delta-cal-firmware-example",
        "--features",
        "small",
    ];
    let build = ["build", "--profile", "small", "--target", TARGET];
    let programs = ["--bin", "touch", "--bin", "arms"];
    cargo(&directory, &[&build[..], &package, &programs].concat()).expect("the build");
    for program in PROGRAMS {
        let path = directory.join(TARGET).join("small").join(program.name);
        let printed = emulate(Board::M4, Clock::Instructions, &path).expect("the run");
        println!("{}\n{printed}", program.name);
        let shown: Vec<(&str, i32)> = printed.lines().filter_map(line).collect();
        let [refused, arm, stored, turn, drawn, calibrated, last_turn] = shown[..] else {
            panic!("{shown:?}")
        };
        assert_eq!((refused.0, arm.0), ("refused, status:", "arm:"));
        assert_eq!([refused.1, arm.1], program.refusal);
        assert_eq!(stored.0, "calibrated and stored");
        for (what, ticks) in [turn, last_turn] {
            assert_eq!(what, "longest turn, ticks of 25000:");
            assert!((1..TURN / 2).contains(&ticks), "{ticks}");
        }
        assert_eq!(drawn.0, "micrometres off as drawn:");
        assert_eq!(calibrated.0, "micrometres off calibrated:");
        assert!(
            calibrated.1 * program.left < drawn.1,
            "{drawn:?} {calibrated:?}"
        );
        let page = include_str!("../../docs/controller.md");
        for (what, number) in shown {
            let is_same = page.contains(&format!("{what} {number}\n"));
            assert!(is_same || program.name != "touch" || what.starts_with("longest"));
        }
        let (flash, memory) = sizes(&path);
        println!("{flash} bytes of flash, {memory} of memory with the stack");
        assert!(flash <= program.flash && memory <= program.memory);
        let named = |what: &str| format!("{}/{what}", program.name);
        let figures = [(named("flash"), flash), (named("memory"), memory)];
        check_pages(&named(""), &figures.into());
    }
}

/// A text and a number.
fn line(text: &str) -> Option<(&str, i32)> {
    let (text, number) = text.rsplit_once(' ')?;
    Some((text, number.parse().ok()?))
}

/// Bytes of flash, and of memory: the statics and all of the stack, beyond whose end a program faults.
fn sizes(program: &Path) -> (u64, u64) {
    let bytes = std::fs::read(program).expect("the program");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let section = |name| file.section_by_name(name).map_or(0, |it| it.size());
    let flash = [".vector_table", ".text", ".rodata", ".data"].map(section);
    let symbol = |name| file.symbol_by_name(name).expect(name).address();
    let stack = symbol("_stack_start") - symbol("_stack_end");
    (
        flash.iter().sum(),
        section(".data") + section(".bss") + stack,
    )
}
