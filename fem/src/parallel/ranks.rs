//! The ranks of a run: sums and decisions that are the same on all ranks.

use std::sync::Arc;

use bytemuck::Pod;

use super::communicator::{Communicator, RankLost, received};
use super::threads::threads;
use crate::error::FemError;

/// The ranks that solve one problem: processes, or threads of one process. By default there is one rank.
///
/// Each rank builds the same [`Problem`](crate::Problem) from the same input and computes its own elements. Each rank
/// gets the same curve and the fields of the whole body. All ranks must call the same methods in the same order: if one
/// rank does not take a step, the other ranks wait.
///
/// # Example
/// Two threads, each with half of a cylinder:
/// ```
/// use fem::{CompressionTest, CylinderLattice, LinearScheme, Material, Ranks, Schedule, SolverOptions};
///
/// type Error = Box<dyn std::error::Error + Send + Sync>;
/// let force = |ranks: Ranks| {
///     let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.0 }.build()?;
///     let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 1))
///         .builder(mesh)?
///         .materials([Material::hencky(275.0, 0.25)])
///         .options(SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() })
///         .ranks(ranks)
///         .build()?;
///     let outcome = problem.run(&mut ());
///     Ok::<f64, Error>(outcome.curve[0].force_n)
/// };
/// let alone = force(Ranks::default())?;
/// let threads: Vec<_> =
///     Ranks::threads(2).into_iter().map(|rank| std::thread::spawn(move || force(rank))).collect();
/// for thread in threads {
///     let shared = thread.join().expect("no panic")?;
///     assert!((shared - alone).abs() < 1e-6 * alone);
/// }
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Ranks {
    /// Communicator with the other ranks; `None` if there is only one rank.
    others: Option<Arc<dyn Communicator>>,
}

impl Ranks {
    /// Creates the ranks that communicate by `communicator`.
    pub fn new(communicator: impl Communicator + 'static) -> Self {
        let shared = communicator.size() > 1;
        Self { others: shared.then(|| Arc::new(communicator) as Arc<dyn Communicator>) }
    }

    /// Creates `count` ranks within this process, one for each thread that the caller starts.
    ///
    /// A single rank with rayon's threads is faster; use this function to test a problem with several ranks.
    pub fn threads(count: usize) -> Vec<Self> {
        threads(count).into_iter().map(Self::new).collect()
    }

    /// The number of this rank, from 0.
    pub fn rank(&self) -> usize {
        self.others.as_ref().map_or(0, |c| c.rank())
    }

    /// The number of ranks.
    pub fn size(&self) -> usize {
        self.others.as_ref().map_or(1, |c| c.size())
    }

    /// Whether this is the rank that writes files.
    pub fn is_first(&self) -> bool {
        self.rank() == 0
    }

    /// Whether `flag` is true on any rank.
    pub(crate) fn any(&self, flag: bool) -> bool {
        self.gather_even(&[u8::from(flag)]).is_some_and(|all| all.contains(&1)) || flag
    }

    /// Returns the text of the lowest rank that gives a text, with the number of this rank; `None` if no rank gives a
    /// text.
    ///
    /// # Errors
    /// [`RankLost`] if another rank has ended.
    pub fn first_text(&self, text: Option<&str>) -> Result<Option<(usize, String)>, RankLost> {
        let Some(others) = &self.others else { return Ok(text.map(|text| (0, text.into()))) };
        // a leading byte distinguishes an empty text from no text
        let message = text.map_or_else(Vec::new, |text| [b" ", text.as_bytes()].concat());
        let all = others.gather(&message)?;
        let first = all.iter().enumerate().find(|(_, text)| !text.is_empty());
        Ok(first.map(|(rank, text)| (rank, String::from_utf8_lossy(&text[1..]).into_owned())))
    }

    /// Returns `result` if all ranks succeeded; otherwise returns the error of the lowest rank that failed.
    pub(crate) fn agreed<T>(&self, result: Result<T, FemError>) -> Result<T, FemError> {
        let message = result.as_ref().err().map(ToString::to_string);
        match received(self.first_text(message.as_deref())) {
            None => result,
            Some((rank, message)) => result.and(Err(FemError::Rank { rank, message })),
        }
    }

    pub(crate) fn is_alone(&self) -> bool {
        self.others.is_none()
    }

    pub(super) fn others(&self) -> Option<&dyn Communicator> {
        self.others.as_deref()
    }

    fn gather_even(&self, message: &[u8]) -> Option<Vec<u8>> {
        self.others.as_ref().map(|c| received(c.gather_even(message)))
    }

    /// Replaces each value by its sum over the ranks. The terms are added in the order of the ranks, so that all
    /// ranks get the same bits.
    pub(crate) fn sum(&self, values: &mut [f64]) {
        self.reduce(values, |a, b| a + b);
    }

    /// Replaces each value by its maximum over the ranks.
    pub(crate) fn max(&self, values: &mut [f64]) {
        self.reduce(values, f64::max);
    }

    fn reduce(&self, values: &mut [f64], join: impl Fn(f64, f64) -> f64) {
        let Some(all) = self.gather_even(bytemuck::cast_slice(values)) else { return };
        let all: Vec<f64> = decoded(&all);
        let count = values.len();
        values.copy_from_slice(&all[..count]);
        for other in all[count..].chunks_exact(count.max(1)) {
            values.iter_mut().zip(other).for_each(|(v, &o)| *v = join(*v, o));
        }
    }

    /// Collects the values of every rank, in the order of the ranks.
    pub(crate) fn gather<T: Pod>(&self, values: &[T]) -> Vec<Vec<T>> {
        match &self.others {
            None => vec![values.to_vec()],
            Some(others) => {
                let all = received(others.gather(bytemuck::cast_slice(values)));
                all.iter().map(|message| decoded(message)).collect()
            }
        }
    }
}

/// Converts the bytes of a message to values. The bytes need not be aligned in memory.
pub(super) fn decoded<T: Pod>(message: &[u8]) -> Vec<T> {
    message.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}
