//! The lines that are written.

use core::fmt::{Arguments, Result, Write};

pub(crate) struct Report<'a> {
    pub(crate) console: &'a mut dyn Write,
}

impl<'a> Report<'a> {
    pub(crate) fn new(console: &'a mut dyn Write) -> Self {
        Self { console }
    }

    pub(crate) fn line(
        &mut self,
        item: Arguments<'_>,
        value: usize,
        unit: &str,
        words: &str,
    ) -> Result {
        writeln!(self.console, "MEASURED {item} {value} {unit}, {words}")
    }

    pub(crate) fn instructions(&mut self, item: Arguments<'_>, value: u32, words: &str) -> Result {
        self.line(item, value as usize, "instructions", words)
    }
}
