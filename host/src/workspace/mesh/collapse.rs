//! Edges that are much shorter than the lattice's spacing, taken out of a surface.

use nalgebra::Vector3;

/// The triangles that are left when the two ends of every edge shorter than `least` have become one, if the surface
/// stays what it is: closed, without branches, and turned the same way. The end that has the higher rank stays.
/// Returned with the triangle's own number.
pub(super) fn collapsed(
    positions: &[Vector3<f64>],
    ranks: &[usize],
    triangles: &[[usize; 3]],
    least: f64,
) -> Vec<(usize, [usize; 3])> {
    let mut surface = Surface {
        positions,
        triangles: triangles.iter().copied().map(Some).collect(),
        around: vec![Vec::new(); positions.len()],
    };
    for (number, triangle) in triangles.iter().enumerate() {
        for corner in triangle {
            surface.around[*corner].push(number);
        }
    }
    for number in 0..triangles.len() {
        for at in 0..3 {
            let Some(triangle) = surface.triangles[number] else {
                break;
            };
            let (one, other) = (triangle[at], triangle[(at + 1) % 3]);
            if (positions[one] - positions[other]).norm() < least {
                let (kept, gone) = if ranks[one] >= ranks[other] {
                    (one, other)
                } else {
                    (other, one)
                };
                let _ = surface.merge(kept, gone)
                    || ranks[one] == ranks[other] && surface.merge(gone, kept);
            }
        }
    }
    let left = surface.triangles.into_iter().enumerate();
    left.filter_map(|(number, triangle)| Some((number, triangle?)))
        .collect()
}

struct Surface<'a> {
    positions: &'a [Vector3<f64>],
    triangles: Vec<Option<[usize; 3]>>,
    /// The triangles about each corner.
    around: Vec<Vec<usize>>,
}

impl Surface<'_> {
    /// Moves `gone` to `kept`, the other end of an edge, if the surface allows it.
    fn merge(&mut self, kept: usize, gone: usize) -> bool {
        // With a third common neighbour the surface would branch there, and four triangles would close on themselves.
        let (of_kept, of_gone) = (self.neighbours(kept), self.neighbours(gone));
        let common = of_kept.iter().filter(|corner| of_gone.contains(corner));
        if common.count() != 2 || of_kept.len() + of_gone.len() < 8 {
            return false;
        }
        let moved = |triangle: [usize; 3]| triangle.map(|at| if at == gone { kept } else { at });
        let (vanishing, staying): (Vec<usize>, Vec<usize>) = self.around[gone]
            .iter()
            .partition(|number| self.triangles[**number].is_some_and(|t| t.contains(&kept)));
        for triangle in staying.iter().filter_map(|number| self.triangles[*number]) {
            let (before, after) = (self.normal(triangle), self.normal(moved(triangle)));
            if !(before.dot(&after) > 0.0) && before.norm() > 0.0 {
                return false;
            }
        }
        for number in vanishing {
            if let Some(triangle) = self.triangles[number].take() {
                for corner in triangle {
                    self.around[corner].retain(|other| *other != number);
                }
            }
        }
        for number in staying {
            self.triangles[number] = self.triangles[number].map(moved);
            self.around[kept].push(number);
        }
        self.around[gone].clear();
        true
    }

    fn neighbours(&self, corner: usize) -> Vec<usize> {
        let triangles = self.around[corner].iter();
        let mut neighbours: Vec<usize> = triangles
            .filter_map(|number| self.triangles[*number])
            .flatten()
            .filter(|other| *other != corner)
            .collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    fn normal(&self, [a, b, c]: [usize; 3]) -> Vector3<f64> {
        let [a, b, c] = [a, b, c].map(|corner| self.positions[corner]);
        (b - a).cross(&(c - a))
    }
}
