//! Turns the example's measurements into a constant array, and links for the bare target.

use std::env;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// The host tool's example. Columns: three joint angles in degrees, three coordinates in millimetres.
const DATA: &str = "../../host/examples/paper-robot/samples.csv";
const COLUMNS: [&str; 6] = ["q1_deg", "q2_deg", "q3_deg", "x_mm", "y_mm", "z_mm"];

/// A realistic part, not the board's 4 MiB, so that outgrowing it fails. The stack lies below the
/// statics: growing beyond its end it leaves the memory and faults instead of overwriting them.
fn memory() -> String {
    let stack = 112;
    format!(
        "\
MEMORY
{{
  FLASH : ORIGIN = 0x00000000, LENGTH = 1024K
  STACK : ORIGIN = 0x20000000, LENGTH = {stack}K
  RAM   : ORIGIN = 0x20000000 + {stack}K, LENGTH = 16K
}}
_stack_start = ORIGIN(STACK) + LENGTH(STACK);
_stack_end = ORIGIN(STACK);
"
    )
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={DATA}");
    fs::write(out.join("samples.rs"), samples(Path::new(DATA))?)?;

    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        // Not a file of this package: the linker would find it here before it looks in OUT_DIR.
        fs::write(out.join("memory.x"), memory())?;
        println!("cargo::rustc-link-search={}", out.display());
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
        println!("cargo::rustc-link-arg-bins=--nmagic");
    }
    Ok(())
}

/// The bit patterns of all samples, radians and millimetres, as a Rust constant.
fn samples(path: &Path) -> Result<String, Box<dyn Error>> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut lines = text
        .lines()
        .filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let header: Vec<&str> = lines
        .next()
        .unwrap_or("")
        .split(',')
        .map(str::trim)
        .collect();
    let mut places = [0; 6];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = header
            .iter()
            .position(|name| *name == column)
            .ok_or_else(|| format!("{}: no column {column}", path.display()))?;
    }

    let mut rows = String::new();
    let mut count = 0;
    for line in lines {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        rows.push_str("    [");
        for (index, place) in places.into_iter().enumerate() {
            let value: f64 = fields
                .get(place)
                .and_then(|field| field.parse().ok())
                .ok_or_else(|| format!("{}: not a sample: {line}", path.display()))?;
            let value = if index < 3 { value.to_radians() } else { value };
            write!(rows, "0x{:016x}, ", value.to_bits())?;
        }
        rows.push_str("],\n");
        count += 1;
    }
    Ok(format!(
        "pub(crate) const SAMPLES: [[u64; 6]; {count}] = [\n{rows}];\n"
    ))
}
