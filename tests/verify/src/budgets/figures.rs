//! What is measured, and what of it is limited.

use std::collections::BTreeMap;

/// What stands in `budgets.toml`.
#[derive(Debug)]
pub(super) struct Budgets {
    pub(super) budgets: Vec<Budget>,
    pub(super) peers: Vec<Peer>,
}

/// What an item may cost, and what it did when the limit was last raised.
#[derive(Debug)]
pub(super) struct Budget {
    pub(super) item: String,
    pub(super) limit: u64,
    pub(super) measured: u64,
}

/// Another solver, measured elsewhere.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) name: String,
    pub(super) at_20: String,
    pub(super) at_60: String,
    pub(super) at_1000: String,
}

/// One line that the firmware wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Figure {
    pub(super) value: u64,
    pub(super) unit: String,
    pub(super) words: String,
}

pub(super) type Figures = BTreeMap<String, Figure>;

impl Budgets {
    /// Reads the file; a key that is missing or unknown is an error.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let table: toml::Table = text
            .parse()
            .map_err(|error: toml::de::Error| error.to_string())?;
        Ok(Self {
            budgets: rows(&table, "budget", &["item", "limit", "measured"])?
                .into_iter()
                .map(|[item, limit, measured]| {
                    Ok(Budget {
                        item: words(item)?,
                        limit: number(limit)?,
                        measured: number(measured)?,
                    })
                })
                .collect::<Result<_, String>>()?,
            peers: rows(&table, "peer", &["name", "at_20", "at_60", "at_1000"])?
                .into_iter()
                .map(|values| {
                    let [name, at_20, at_60, at_1000] = values.map(words);
                    Ok(Peer {
                        name: name?,
                        at_20: at_20?,
                        at_60: at_60?,
                        at_1000: at_1000?,
                    })
                })
                .collect::<Result<_, String>>()?,
        })
    }
}

/// The values of these keys in each `[[name]]`.
fn rows<'a, const N: usize>(
    table: &'a toml::Table,
    name: &str,
    keys: &[&str; N],
) -> Result<Vec<[&'a toml::Value; N]>, String> {
    let rows = table.get(name).and_then(toml::Value::as_array);
    let rows = rows.ok_or_else(|| format!("there is no [[{name}]]"))?;
    rows.iter()
        .map(|row| {
            let row = row.as_table().filter(|row| row.len() == N);
            let values = keys.map(|key| row?.get(key));
            values
                .into_iter()
                .collect::<Option<Vec<_>>>()
                .and_then(|values| values.try_into().ok())
                .ok_or_else(|| format!("a [[{name}]] has the keys {}", keys.join(", ")))
        })
        .collect()
}

fn words(value: &toml::Value) -> Result<String, String> {
    let text = value.as_str().map(str::to_owned);
    text.ok_or_else(|| format!("{value:?} is no text"))
}

fn number(value: &toml::Value) -> Result<u64, String> {
    let number = value.as_integer().and_then(|value| value.try_into().ok());
    number.ok_or_else(|| format!("{value:?} is no count"))
}

/// `MEASURED <item> <value> <unit>, <words>`
pub(super) fn figure(line: &str) -> Option<(String, Figure)> {
    let (item, rest) = line.strip_prefix("MEASURED ")?.split_once(' ')?;
    let (value, rest) = rest.split_once(' ')?;
    let (unit, words) = rest.split_once(", ")?;
    let figure = Figure {
        value: value.parse().ok()?,
        unit: unit.to_owned(),
        words: words.to_owned(),
    };
    Some((item.to_owned(), figure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_firmware_are_read() {
        let read = Figure {
            value: 451,
            unit: "instructions".to_owned(),
            words: "forward, worst".to_owned(),
        };
        assert_eq!(
            figure("MEASURED f32/forward 451 instructions, forward, worst"),
            Some(("f32/forward".to_owned(), read))
        );
        assert_eq!(figure("measured nothing"), None);
    }

    #[test]
    fn the_file_is_read() -> Result<(), String> {
        let file = Budgets::read(include_str!("../../../target/budgets.toml"))?;
        let mut budgets = file.budgets.iter();
        assert!(budgets.any(|budget| budget.item == "f32/forward" && budget.limit == 600));
        assert!(!file.peers.is_empty());
        Ok(())
    }

    #[test]
    fn a_key_that_is_missing_or_unknown_is_an_error() {
        let peer = "[[peer]]\nname = \"a\"\nat_20 = \"1\"\nat_60 = \"2\"\nat_1000 = \"3\"\n";
        let read = |budget: &str| Budgets::read(&format!("[[budget]]\n{budget}\n{peer}")).is_ok();
        assert!(read("item = \"x\"\nlimit = 2\nmeasured = 1"));
        assert!(!read("item = \"x\"\nlimit = 2"));
        assert!(!read("item = \"x\"\nlimit = 2\nmeasures = 1"));
        assert!(!read("item = \"x\"\nlimit = 2\nmeasured = 1\nmore = 1"));
        assert!(!read("item = \"x\"\nlimit = -2\nmeasured = 1"));
    }
}
