//! Where the platform may be.

use delta_cal::Real;
use nalgebra::Vector3;
use rand_core::Rng;

/// A box along the robot's axes, or an upright cylinder about its z axis. Lengths in mm, in the
/// robot's frame. Written `x=-100..100,y=-100..100,z=-500..-400` and `r=200,z=-500..-400`.
///
/// ```
/// use delta_cal_host::planning::Region;
/// let region: Region = "r=200, z=-500..-400".parse().unwrap();
/// assert!(region.contains(&nalgebra::Vector3::new(0.0, 199.0, -450.0)));
/// assert!("r=200".parse::<Region>().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Smallest and largest x, y and z.
    pub(crate) ranges: [(f64, f64); 3],
    /// Of a cylinder.
    pub(crate) radius: Option<f64>,
}

impl Region {
    /// Whether a position is inside or on the boundary.
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        let mut coordinates = x.iter().zip(&self.ranges);
        coordinates.all(|(x, (low, high))| x >= low && x <= high)
            && self.radius.is_none_or(|radius| x.xy().norm() <= radius)
    }

    /// The part within a box; `None` if there is none.
    pub(crate) fn clipped(&self, to: &[(f64, f64); 3]) -> Option<Self> {
        let mut ranges = self.ranges;
        for ((low, high), (least, most)) in ranges.iter_mut().zip(to) {
            (*low, *high) = (low.max(*least), high.min(*most));
            if *low > *high {
                return None;
            }
        }
        let furthest = |(low, high): (f64, f64)| low.abs().max(high.abs()).squared();
        let corner = (furthest(to[0]) + furthest(to[1])).square_root();
        let radius = self.radius.map(|radius| radius.min(corner));
        Some(Self { ranges, radius })
    }

    /// Positions throughout it, its middle and its edges among them.
    pub(crate) fn grid(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        const PARTS: u32 = 5;
        let at = |axis: usize, part: u32| {
            let (low, high) = self.ranges[axis];
            low + (high - low) * f64::from(part) / f64::from(PARTS - 1)
        };
        (0..PARTS.pow(3)).map(move |cell| {
            let [x, y, z] = [cell / PARTS / PARTS, cell / PARTS % PARTS, cell % PARTS];
            Vector3::new(at(0, x), at(1, y), at(2, z))
        })
    }

    /// A uniformly distributed position in it.
    pub(crate) fn random<R: Rng + ?Sized>(&self, rng: &mut R) -> Vector3<f64> {
        let mut between = |(low, high): (f64, f64)| low + (high - low) * uniform(rng);
        let Some(radius) = self.radius else {
            return Vector3::from(self.ranges.map(between));
        };
        let distance = radius * between((0.0, 1.0)).sqrt();
        let (sine, cosine) = between((0.0, std::f64::consts::TAU)).sine_cosine();
        Vector3::new(distance * cosine, distance * sine, between(self.ranges[2]))
    }
}

/// A uniformly distributed number in [0, 1).
pub(crate) fn uniform<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    // 53 bits, the precision of a double.
    let bits = rng.next_u64() >> 11;
    let number = bits as f64;
    number * f64::EPSILON / 2.0
}

/// A uniformly distributed whole number below `number`.
pub(crate) fn below(number: usize, rng: &mut impl Rng) -> usize {
    usize::try_from(rng.next_u64() % number.max(1) as u64).unwrap_or(0)
}
