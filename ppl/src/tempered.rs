//! The reading of a model as prior and likelihood apart.

use rand::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::bound::Bound;
use crate::density::Rejection;
use crate::distribution::{Distribution, Unknown};
use crate::explain::explain;
use crate::model::{Context, Model};
use crate::reading::{too_few_coordinates, unpredictable, varying_dimension};
use crate::real::Real;
use crate::site::Site;
use crate::terms::Valued;
use crate::trace::Source;

/// Both factors of a density at a point of unconstrained space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// Log density of the prior, log-Jacobians included.
    pub ln_prior: f64,
    /// Log likelihood.
    pub ln_likelihood: f64,
}

/// A density on ℝᵈ in two factors: a prior that can be drawn from, and a likelihood.
///
/// [`Bound`] implements it for every model: the densities of unknowns (`let x ~ D`) are the prior;
/// what is conditioned on (`place ~ D`) and `factor` are the likelihood. Write it by hand for a
/// density that is not a model; [`Smc`](crate::Smc) has an example.
pub trait Tempered: Sync {
    /// d.
    fn unknowns(&self) -> usize;

    /// A draw from the prior, in unconstrained coordinates.
    ///
    /// # Errors
    /// [`Rejection`] where the density is zero: the evidence counts how often.
    fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Vec<f64>, Rejection>;

    /// Prior and likelihood at `y` (length d).
    ///
    /// # Errors
    /// [`Rejection`] where one of them is zero or not defined.
    fn parts(&self, y: &[f64]) -> Result<Parts, Rejection>;

    /// What can be said, if no draw from the prior has a density, beyond its [`Rejection`], as the
    /// datum at fault; for error messages.
    fn explain_rejection(&self) -> Option<String> {
        None
    }
}

impl<M: Model> Tempered for Bound<M> {
    fn unknowns(&self) -> usize {
        self.layout().map_or(0, |layout| layout.dim)
    }

    fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Vec<f64>, Rejection> {
        let mut split = Split::new(Drawn { rng, y: Vec::new() });
        self.model().run(&mut split)?;
        let y = split.unknowns.y;
        if y.len() != self.unknowns() {
            return Err(varying_dimension("a prior draw has another number than the first"));
        }
        Ok(y)
    }

    fn parts(&self, y: &[f64]) -> Result<Parts, Rejection> {
        let mut split = Split::new(Given(y.iter()));
        self.model().run(&mut split)?;
        match split.unknowns.0.next() {
            Some(_) => Err(varying_dimension("the model stops asking before the last coordinate")),
            None => Ok(split.parts),
        }
    }

    fn explain_rejection(&self) -> Option<String> {
        match self.layout() {
            Ok(_) => explain(self.model(), Source::Prior),
            Err(error) => Some(error.to_string()),
        }
    }
}

/// Where the unknowns come from.
trait Unknowns {
    /// The next unknown, and its log density where that is wanted.
    fn next<D: Unknown<Real<f64>>>(
        &mut self,
        site: &Site,
        distribution: &D,
    ) -> Result<(D::Value, f64), Rejection>;
}

/// Unconstrained coordinates.
struct Given<'y>(std::slice::Iter<'y, f64>);

impl Unknowns for Given<'_> {
    fn next<D: Unknown<Real<f64>>>(
        &mut self,
        site: &Site,
        distribution: &D,
    ) -> Result<(D::Value, f64), Rejection> {
        let mut missing = false;
        let mut next = || {
            Real(self.0.next().copied().unwrap_or_else(|| {
                missing = true;
                f64::NAN
            }))
        };
        let mut terms = Valued::default();
        let value = distribution.constrain(&mut next, true, &mut terms);
        if missing { Err(too_few_coordinates(site)) } else { Ok((value, terms.0)) }
    }
}

/// Draws from the prior, written down in unconstrained coordinates.
struct Drawn<'r, G> {
    rng: &'r mut G,
    y: Vec<f64>,
}

impl<G: Rng> Unknowns for Drawn<'_, G> {
    fn next<D: Unknown<Real<f64>>>(
        &mut self,
        site: &Site,
        distribution: &D,
    ) -> Result<(D::Value, f64), Rejection> {
        let value = site.locate(distribution.try_draw(&mut *self.rng))?;
        distribution.unconstrain(&value, &mut self.y);
        Ok((value, 0.0))
    }
}

/// Adds up prior and likelihood apart.
struct Split<U> {
    unknowns: U,
    parts: Parts,
}

impl<U> Split<U> {
    fn new(unknowns: U) -> Self {
        Self { unknowns, parts: Parts { ln_prior: 0.0, ln_likelihood: 0.0 } }
    }
}

fn finite(site: &Site, value: f64) -> Result<f64, Rejection> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Rejection::NotFinite { place: site.place, value })
    }
}

impl<U: Unknowns> Context for Split<U> {
    type Number = f64;

    fn unknown<D: Unknown<Real<f64>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        let (value, term) = self.unknowns.next(site, &distribution)?;
        self.parts.ln_prior += finite(site, term)?;
        Ok(value)
    }

    fn observe<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        self.parts.ln_likelihood += finite(site, distribution.ln_density(&datum).0)?;
        Ok(())
    }

    fn factor(&mut self, site: &'static Site, weight: Real<f64>) -> Result<(), Rejection> {
        self.parts.ln_likelihood += finite(site, weight.0)?;
        Ok(())
    }

    fn predict<D: Distribution<Real<f64>>>(
        &mut self,
        site: &'static Site,
        _: D,
    ) -> Result<D::Value, Rejection> {
        Err(unpredictable(site))
    }
}
