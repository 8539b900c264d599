//! From candidates all over to a set, then the same among candidates ever nearer to it; from several
//! random sets, and the best of what they lead to.

use super::exchange::{Candidates, Set};
use super::source::{Rows, Source};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

/// How much is searched.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) struct Effort {
    /// Random sets that the search begins with.
    pub(in crate::planning) starts: usize,
    /// Candidates from all over.
    candidates: usize,
    /// Candidates near the chosen ones.
    near: usize,
    /// How far these are from the chosen ones, one σ in degrees, one round after the other.
    spreads: &'static [f64],
}

impl Effort {
    /// What finds the best.
    pub(in crate::planning) const fn thorough(starts: usize) -> Self {
        Self {
            starts,
            candidates: 1500,
            near: 500,
            spreads: &[8.0, 3.0, 1.0, 0.3],
        }
    }

    /// What comes within some percent of the best, in a fraction of the time.
    pub(in crate::planning) const fn quick(starts: usize) -> Self {
        Self {
            starts,
            candidates: 600,
            near: 300,
            spreads: &[8.0, 2.0],
        }
    }
}

/// A set of candidates, and the criterion: smaller is better.
pub(in crate::planning) struct Found<C> {
    pub(in crate::planning) chosen: Vec<C>,
    pub(in crate::planning) value: f64,
}

/// The best set of so many candidates that was found from so many random sets, in the order in which its
/// members were found; `None` if no set determines anything.
///
/// # Errors
/// The source's.
pub(in crate::planning) fn all_over<
    S: Source<B, D, R>,
    const B: usize,
    const D: usize,
    const R: usize,
>(
    source: &S,
    count: usize,
    effort: &Effort,
    rng: &mut Pcg32,
) -> Result<Option<Found<S::Candidate>>, S::Error> {
    let drawn = source.draw_many(effort.candidates.max(2 * count), rng)?;
    let pool = Pool::new(source, drawn);
    let candidates = pool.candidates(source);
    let starts: Vec<_> = (0..effort.starts)
        .map(|_| {
            let chosen = random_subset(&pool.rows, count, source.most(), rng);
            (chosen, Pcg32::seed_from_u64(rng.next_u64()))
        })
        .collect();
    let found: Vec<_> = starts
        .into_par_iter()
        .filter_map(|(chosen, mut rng)| {
            let set = candidates.exchange(candidates.set(chosen)?);
            nearer(source, pool.chosen(&set), effort, &mut rng)
        })
        .collect();
    Ok(found.into_iter().min_by(|a, b| a.value.total_cmp(&b.value)))
}

/// Exchanges the members of a set for others near them.
pub(in crate::planning) fn nearer<
    S: Source<B, D, R>,
    const B: usize,
    const D: usize,
    const R: usize,
>(
    source: &S,
    mut chosen: Vec<S::Candidate>,
    effort: &Effort,
    rng: &mut Pcg32,
) -> Option<Found<S::Candidate>> {
    let count = chosen.len();
    let each = effort.near.div_ceil(count.max(1)).max(2);
    let mut value = f64::INFINITY;
    for spread in effort.spreads {
        let mut near = chosen.clone();
        for member in &chosen {
            near.extend((0..each).filter_map(|_| source.near(member, spread.to_radians(), rng)));
        }
        let pool = Pool::new(source, near);
        let candidates = pool.candidates(source);
        let set = candidates.exchange(candidates.set((0..count).collect())?);
        value = set.value;
        chosen = pool.chosen(&set);
    }
    Some(Found { chosen, value })
}

/// What is best added to what is given, one after the other; `None` if what is given determines nothing.
///
/// # Errors
/// The source's.
pub(in crate::planning) fn added<
    S: Source<B, D, R>,
    const B: usize,
    const D: usize,
    const R: usize,
>(
    source: &S,
    given: &[S::Candidate],
    count: usize,
    rng: &mut Pcg32,
) -> Result<Option<Vec<S::Candidate>>, S::Error> {
    let mut all = given.to_vec();
    all.extend(source.draw_many(Effort::thorough(1).candidates, rng)?);
    let pool = Pool::new(source, all);
    let candidates = pool.candidates(source);
    let Some(start) = candidates.set((0..given.len()).collect()) else {
        return Ok(None);
    };
    let set = candidates.add(start, count);
    Ok(Some(pool.chosen(&set).split_off(given.len())))
}

/// Candidates and their rows.
struct Pool<C, const B: usize, const D: usize, const R: usize> {
    members: Vec<C>,
    rows: Vec<Rows<B, D, R>>,
}

impl<C: Clone, const B: usize, const D: usize, const R: usize> Pool<C, B, D, R> {
    fn new<S: Source<B, D, R, Candidate = C>>(source: &S, members: Vec<C>) -> Self {
        let rows = source.rows(&members);
        let (members, rows) = members
            .into_iter()
            .zip(rows)
            .filter_map(|(member, rows)| Some((member, rows?)))
            .unzip();
        Self { members, rows }
    }

    fn candidates<'a, S: Source<B, D, R, Candidate = C>>(
        &'a self,
        source: &'a S,
    ) -> Candidates<'a, B, D, R> {
        Candidates::new(&self.rows, source)
    }

    fn chosen(&self, set: &Set<B, D>) -> Vec<C> {
        let members = set.chosen.iter().map(|index| &self.members[*index]);
        members.cloned().collect()
    }
}

/// Different candidates, any as likely as any other, no more of a kind than allowed.
fn random_subset<const B: usize, const D: usize, const R: usize>(
    rows: &[Rows<B, D, R>],
    count: usize,
    most: &[usize],
    rng: &mut Pcg32,
) -> Vec<usize> {
    let mut all: Vec<_> = (0..rows.len()).collect();
    let mut left = most.to_vec();
    let mut chosen = Vec::with_capacity(count);
    let mut place = 0;
    while chosen.len() < count && place < all.len() {
        let others = (all.len() - place) as u64;
        let other = place + usize::try_from(rng.next_u64() % others).unwrap_or(0);
        all.swap(place, other);
        let candidate = all[place];
        place += 1;
        let left = &mut left[rows[candidate].kind];
        if *left > 0 {
            *left -= 1;
            chosen.push(candidate);
        }
    }
    chosen
}
