//! The files of a page.

use delta_cal_host::{InputError, InputText, RobotFile};

/// Files by name, in the order in which they came.
#[derive(Debug, Default)]
pub(crate) struct Folder(Vec<(String, Vec<u8>)>);

impl Folder {
    pub(crate) fn put(&mut self, name: &str, bytes: &[u8]) {
        match self.0.iter_mut().find(|(own, _)| own == name) {
            Some((_, own)) => *own = bytes.to_vec(),
            None => self.0.push((name.to_owned(), bytes.to_vec())),
        }
    }

    pub(crate) fn remove(&mut self, name: &str) {
        self.0.retain(|(own, _)| own != name);
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_str())
    }

    fn bytes(&self, name: &str) -> Result<&[u8], InputError> {
        let found = self.0.iter().find(|(own, _)| own == name);
        let found = found.map(|(_, bytes)| bytes.as_slice());
        found.ok_or_else(|| InputError::new(name, "the file is not in the list"))
    }

    /// As the text of a robot or of a configuration.
    pub(crate) fn settings(&self, name: &str) -> Result<InputText, InputError> {
        InputText::of_settings(name, self.bytes(name)?)
    }

    pub(crate) fn robot(&self, name: &str) -> Result<RobotFile, InputError> {
        RobotFile::read(&self.settings(name)?)
    }

    /// As a table.
    pub(crate) fn table(&self, name: &str) -> Result<InputText, InputError> {
        InputText::from_reader(name, self.bytes(name)?)
    }

    /// The files that a line of a configuration includes. A page sees no folders: the last part of the path counts, and
    /// `*` stands for anything.
    pub(crate) fn included(&self, from: &str, wanted: &str) -> Result<Vec<InputText>, InputError> {
        let wanted = base(wanted);
        let named = self.names().filter(|own| matches(wanted, base(own)));
        let named = named.filter(|own| *own != from);
        named.map(|own| self.settings(own)).collect()
    }
}

/// The last part of a path.
fn base(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Whether a name fits a pattern with `*`.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((before, after)) = pattern.split_once('*') else {
        return pattern == name;
    };
    let Some(rest) = name.strip_prefix(before) else {
        return false;
    };
    let mut starts = rest.char_indices().map(|(start, _)| start);
    matches(after, "") || starts.any(|start| matches(after, rest.get(start..).unwrap_or_default()))
}
