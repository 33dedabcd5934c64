//! Common parts of the generalised linear models: the linear predictor of a datum, and loops over all data.

use crate::density::DomainError;
use crate::distribution::{Distribution, Sequence};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::{Accumulator, Joined};
use crate::term::parameter::Parameter;
use rand::Rng;

use super::design::Design;
use super::intercept::Intercept;

/// Linear predictor η of one datum: its value, and the parameters on which it depends.
#[derive(Debug)]
pub(super) struct Eta<'g, A, B> {
    value: f64,
    datum: usize,
    row: &'g [f64],
    intercept: &'g A,
    slopes: &'g B,
}

impl<A, B> Clone for Eta<'_, A, B> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A, B> Copy for Eta<'_, A, B> {}

impl<'g, A, B> Eta<'g, A, B> {
    #[inline(always)]
    pub(super) fn new<R: Scalar>(
        x: &'g impl Design,
        intercept: &'g A,
        slopes: &'g B,
        datum: usize,
    ) -> Self
    where
        A: Intercept<R>,
        B: Sequence<Item: Datum<R>>,
    {
        let row = x.row(datum);
        let mut value = intercept.of_group(intercept.group(datum)).number();
        for (k, x) in row.iter().enumerate().take(slopes.items().len()) {
            value += x * slopes.at::<R>(k).value();
        }
        Self { value, datum, row, intercept, slopes }
    }
}

impl<A, B> Parameter for Eta<'_, A, B> {
    #[inline(always)]
    fn number(self) -> f64 {
        self.value
    }
}

impl<R: Scalar, A: Intercept<R>, B: Sequence<Item: Datum<R>>> Datum<R> for Eta<'_, A, B> {
    #[inline(always)]
    fn lift(&self) -> R {
        R::gather(self.value, ((*self, 1.0),))
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(R, f64)) {
        self.intercept.of_group(self.intercept.group(self.datum)).spread(weight, f);
        for (k, x) in self.row.iter().enumerate().take(self.slopes.items().len()) {
            f(self.slopes.at(k), weight * x);
        }
    }
}

/// A regression, described by the distribution of each datum.
pub(super) trait Regression<R: Scalar> {
    /// Distribution of one datum.
    type Each<'g>: Distribution<R>
    where
        Self: 'g;

    /// Number of data.
    fn size(&self) -> usize;

    /// Distribution of datum `i`.
    fn each(&self, i: usize) -> Self::Each<'_>;
}

/// Type of one datum of a regression.
pub(super) type Value<'g, R, G> = <<G as Regression<R>>::Each<'g> as Distribution<R>>::Value;

/// Adds the log density of all data, datum by datum; −∞ if the number of data is wrong.
#[inline(always)]
pub(super) fn add_terms<'g, R, G>(
    regression: &'g G,
    data: impl ExactSizeIterator<Item = Value<'g, R, G>>,
    terms: &mut impl Accumulator<R>,
) where
    R: Scalar,
    G: Regression<R>,
{
    if data.len() != regression.size() {
        return terms.add_number(R::from(f64::NEG_INFINITY));
    }
    for (i, datum) in data.enumerate() {
        regression.each(i).add_terms(&datum, terms);
    }
}

/// Appends the log density of each datum to `out`.
pub(super) fn pointwise<'g, R: Scalar, G: Regression<R>>(
    regression: &'g G,
    data: &[Value<'g, R, G>],
    out: &mut Vec<f64>,
) {
    let each = |(i, datum): (usize, &Value<'g, R, G>)| {
        Joined::of(|terms| regression.each(i).add_terms(datum, terms)).value()
    };
    out.extend(data.iter().take(regression.size()).enumerate().map(each));
}

pub(super) fn draw<'g, R: Scalar, G: Regression<R>>(
    regression: &'g G,
    rng: &mut (impl Rng + ?Sized),
) -> Vec<Value<'g, R, G>> {
    (0..regression.size()).map(|i| regression.each(i).draw(rng)).collect()
}

/// Checks that the design matrix has one row per datum.
pub(super) fn require_length(
    family: &str,
    x: &impl Design,
    data: usize,
) -> Result<(), DomainError> {
    let rows = x.size();
    if rows == data {
        return Ok(());
    }
    let message =
        format!("{family}: x has {rows} rows but there are {data} data; give one row per datum");
    Err(DomainError::new(message))
}

/// Checks that each row of the design matrix has as many predictors as there are slopes, and that all predictors,
/// slopes and intercepts are finite.
pub(super) fn validate<R: Scalar>(
    family: &'static str,
    x: &impl Design,
    intercept: &impl Intercept<R>,
    slopes: &impl Sequence<Item: Datum<R>>,
) -> Result<(), DomainError> {
    let (rows, count) = (x.size(), slopes.items().len());
    for i in 0..rows {
        let predictors = x.row(i);
        if predictors.len() != count {
            let message = format!(
                "{family}: row {i} of x has {} predictors but there are {count} slopes; give one slope \
                 per predictor",
                predictors.len()
            );
            return Err(DomainError::new(message));
        }
        for (k, x) in predictors.iter().enumerate() {
            DomainError::require_finite(family, format_args!("x[{i}][{k}]"), *x)?;
        }
    }
    for k in 0..count {
        DomainError::require_finite(
            family,
            format_args!("slopes[{k}]"),
            slopes.at::<R>(k).value(),
        )?;
    }
    intercept.validate(family, rows)
}
