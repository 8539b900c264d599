//! A correction table, read again from its file.

use crate::support::Point;
use std::collections::BTreeMap;

/// A table as its file has it: corrections and kind of each node.
pub(crate) struct Table {
    pub(crate) header: String,
    pub(crate) spacing: f64,
    pub(crate) nodes: BTreeMap<[i64; 3], (Option<Point>, String)>,
}

impl Table {
    pub(crate) fn read(text: &str, spacing: f64) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let header = lines.next().unwrap().to_owned();
        let mut nodes = BTreeMap::new();
        for line in lines {
            let fields: Vec<_> = line.split(',').collect();
            let [x, y, z, first, second, third, kind] = fields[..] else {
                panic!("{line}");
            };
            let index = [x, y, z].map(|c| {
                let place = c.parse::<f64>().unwrap() / spacing;
                assert!((place - place.round()).abs() < 1e-9, "{line}");
                #[allow(clippy::cast_possible_truncation)] // some thousand
                let place = place.round() as i64;
                place
            });
            let by =
                (!first.is_empty()).then(|| [first, second, third].map(|c| c.parse().unwrap()));
            assert_eq!(by.is_none(), kind == "empty", "{line}");
            assert!(nodes.insert(index, (by, kind.to_owned())).is_none());
        }
        Self {
            header,
            spacing,
            nodes,
        }
    }

    pub(crate) fn count(&self, kind: &str) -> usize {
        self.nodes.values().filter(|(_, own)| own == kind).count()
    }

    /// Linear along x, then y, then z.
    pub(crate) fn at(&self, at: Point) -> Option<Point> {
        #[allow(clippy::cast_possible_truncation)] // some thousand
        let low = at.map(|c| (c / self.spacing).floor() as i64);
        let part = [0, 1, 2].map(|k| (at[k] / self.spacing).rem_euclid(1.0));
        let node =
            |x: i64, y: i64, z: i64| self.nodes.get(&[low[0] + x, low[1] + y, low[2] + z])?.0;
        let between = |a: Point, b: Point, t: f64| [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]));
        let along_x = |y, z| Some(between(node(0, y, z)?, node(1, y, z)?, part[0]));
        let along_y = |z| Some(between(along_x(0, z)?, along_x(1, z)?, part[1]));
        Some(between(along_y(0)?, along_y(1)?, part[2]))
    }
}
