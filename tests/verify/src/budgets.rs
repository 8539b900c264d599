//! What the core costs on a Cortex-M4F, against `tests/target/budgets.toml`.

mod figures;
mod flash;
mod measure;
mod panic_free;
mod profiles;
mod tables;

use crate::check::{Check, directory};
use figures::Budgets;
use measure::measure;

const BUDGETS: &str = include_str!("../../target/budgets.toml");

pub(crate) fn check(check: &mut Check) {
    let budgets = match Budgets::read(BUDGETS) {
        Ok(budgets) => budgets,
        Err(error) => return check.fail(format!("budgets.toml: {error}")),
    };
    match measure(&directory("firmware"), &[]) {
        Err(error) => check.fail(error),
        Ok(figures) => {
            tables::budgets(check, &budgets.budgets, &figures);
            tables::rest(&budgets.budgets, &figures);
            tables::document(check, &figures);
            tables::peers(check, &budgets.peers, &figures);
        }
    }
    panic_free::check(check, &directory("firmware"));
}

/// What other profiles than the one of the budgets cost.
pub(crate) fn profiles(check: &mut Check) {
    profiles::check(check, &directory("profiles"));
}
