//! `delta-cal-web-bindgen PROGRAM.wasm FOLDER`: what the page loads, as wasm-bindgen's own command writes it for the web.

#![forbid(unsafe_code)]

use std::error::Error;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(program), Some(folder)) = (arguments.next(), arguments.next()) else {
        return Err("usage: delta-cal-web-bindgen PROGRAM.wasm FOLDER".into());
    };
    Bindgen::new()
        .input_path(program)
        .web(true)?
        // The page lets it find the program beside it.
        .omit_default_module_path(false)
        .typescript(true)
        .remove_name_section(true)
        .remove_producers_section(true)
        .generate(folder)?;
    Ok(())
}
