//! Cut points between ordered grades.

use super::Vector;
use crate::density::DomainError;
use crate::scalar::Scalar;

/// The cut points below and above a grade, as far as there are any; `None` if there is no such
/// grade.
pub(super) fn around<R: Scalar>(
    cuts: &impl Vector<R>,
    grade: u64,
) -> Option<(Option<R>, Option<R>)> {
    let k = usize::try_from(grade).ok().filter(|k| *k <= cuts.size())?;
    Some(((k > 0).then(|| cuts.at(k - 1)), (k < cuts.size()).then(|| cuts.at(k))))
}

/// The grade of a latent value.
pub(super) fn grade<R: Scalar>(cuts: &impl Vector<R>, latent: f64) -> u64 {
    (0..cuts.size()).take_while(|&i| cuts.at(i).value() < latent).count() as u64
}

pub(super) fn validate<R: Scalar>(
    distribution: &str,
    predictor: f64,
    cuts: &impl Vector<R>,
) -> Result<(), DomainError> {
    DomainError::require_finite(distribution, "predictor", predictor)?;
    (0..cuts.size()).try_for_each(|i| {
        let (name, cut) = (format_args!("cut point {i}"), cuts.at(i).value());
        DomainError::require_finite(distribution, name, cut)?;
        let before = if i > 0 { cuts.at(i - 1).value() } else { f64::NEG_INFINITY };
        let above = format_args!("above the one before, {before}");
        DomainError::require(cut > before, distribution, name, above, cut)
    })
}
