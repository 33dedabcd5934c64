//! Priors of calibrated parameters.

mod family;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use ppl::prelude::*;
use ppl::transform::Support;
use ppl::{Accumulator, DomainError, Univariate, UnivariateDensity};
use rand::Rng;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use surrogate::{DesignMethod, Input, SurrogateError};

use family::two_numbers;
pub use family::{PriorBounds, PriorFamily, PriorKey};

/// Prior of a calibrated parameter: a univariate distribution, truncated to the range that the surrogate covers.
///
/// # Example
/// ```
/// use breccia_calibration::{PriorFamily, Prior};
/// use ppl::Univariate;
///
/// let young_mpa = Prior::new(PriorFamily::LogNormal, &[280.0, 1.1]).within(200.0, 400.0);
/// assert_eq!(young_mpa.to_string(), "lognormal (median 280, factor 1.1) between 200 and 400");
/// assert!((young_mpa.quantile(0.5) - 280.0).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    family: PriorFamily,
    /// Parameters of the family, in the order of [`PriorFamily::keys`]: NaN if a parameter is missing, zero in unused
    /// entries.
    values: [f64; 3],
    range: [f64; 2],
}

/// Evaluates an expression with the distribution of a prior before truncation.
macro_rules! with_family {
    ($prior:expr, $d:ident => $use:expr) => {{
        let Prior { family, values: [a, b, c], range: [lower, upper] } = *$prior;
        macro_rules! of {
            ($distribution:expr) => {{
                let $d = $distribution;
                $use
            }};
        }
        match family {
            PriorFamily::Uniform => of!(Uniform(lower, upper)),
            PriorFamily::Normal => of!(Normal(a, b)),
            PriorFamily::LogNormal => of!(LogNormal(a.ln(), b.ln())),
            PriorFamily::Gamma => of!(Gamma(a, b)),
            PriorFamily::Beta => of!(Beta(a, b)),
            PriorFamily::StudentT => of!(StudentT(a, b, c)),
            PriorFamily::Exponential => of!(Exponential(a)),
            PriorFamily::Weibull => of!(Weibull(a, b)),
            PriorFamily::InverseGamma => of!(InverseGamma(a, b)),
            PriorFamily::Triangular => of!(Triangular(a, b, c)),
        }
    }};
}

/// Evaluates an expression with the distribution of a prior, truncated to its range.
macro_rules! with_distribution {
    ($prior:expr, $d:ident => $use:expr) => {
        if $prior.is_uniform() {
            let $d = Uniform($prior.range[0], $prior.range[1]);
            $use
        } else {
            with_family!($prior, family => {
                let $d = family.truncate($prior.range[0]..$prior.range[1]);
                $use
            })
        }
    };
}

impl Prior {
    /// Uniform prior.
    pub const fn uniform(lower: f64, upper: f64) -> Self {
        Self { family: PriorFamily::Uniform, values: [0.0; 3], range: [lower, upper] }
    }

    /// Returns uniform priors on the box of a surrogate.
    pub fn uniform_on(inputs: &[Input]) -> Vec<Self> {
        inputs.iter().map(|input| Self::uniform(input.lower, input.upper)).collect()
    }

    /// Creates a prior of a family from its parameters, given in the order of [`PriorFamily::keys`]. The range
    /// extends from the 0.1 % to the 99.9 % quantile. [`Univariate::validate`] reports parameters that are missing
    /// or wrong.
    pub fn new(family: PriorFamily, parameters: &[f64]) -> Self {
        let mut values = [0.0; 3];
        for (i, value) in values.iter_mut().take(family.keys().len()).enumerate() {
            *value = parameters.get(i).copied().unwrap_or(f64::NAN);
        }
        let unlimited = Self { family, values, range: [f64::NAN; 2] };
        // quantiles exist only for valid parameters
        match family != PriorFamily::Uniform && unlimited.check_parameters().is_ok() {
            true => {
                with_family!(&unlimited, d => unlimited.within(d.quantile(0.001), d.upper_quantile(0.001)))
            }
            false => unlimited,
        }
    }

    /// Returns the same distribution, truncated to another range.
    pub const fn within(self, lower: f64, upper: f64) -> Self {
        Self { range: [lower, upper], ..self }
    }

    pub fn family(&self) -> PriorFamily {
        self.family
    }

    pub fn is_uniform(&self) -> bool {
        self.family == PriorFamily::Uniform
    }

    /// Ends of the range.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns an input of a surrogate with the range of this prior.
    ///
    /// # Errors
    /// The errors of [`Input::new`].
    pub fn input(&self, name: impl Into<String>) -> Result<Input, SurrogateError> {
        Input::new(name, self.range[0], self.range[1])
    }

    /// Standard deviation.
    pub fn sd(&self) -> f64 {
        self.variance().sqrt()
    }

    /// Returns points (value, density) of the probability density over the range.
    pub fn curve(&self) -> Vec<(f64, f64)> {
        let [lower, upper] = self.range;
        let steps = if self.is_uniform() { 1 } else { 120 };
        let at = |i: i32| lower + (upper - lower) * f64::from(i) / f64::from(steps);
        (0..=steps).map(at).map(|x| (x, UnivariateDensity::<f64>::ln_pdf(self, x).exp())).collect()
    }

    /// Draws `n` points whose coordinates have the priors `priors`. A design in the unit cube is mapped by the
    /// quantile functions.
    ///
    /// # Errors
    /// The errors of [`DesignMethod::sample`].
    pub fn sample_design(
        priors: &[Self],
        method: DesignMethod,
        n: usize,
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let unit: Vec<Input> =
            priors.iter().map(|_| Input::new("u", 0.0, 1.0)).collect::<Result<_, _>>()?;
        let mut design = method.sample(&unit, n, seed)?;
        for (x, prior) in design.iter_mut().flat_map(|point| point.iter_mut().zip(priors)) {
            *x = prior.quantile(*x).clamp(prior.range[0], prior.range[1]);
        }
        Ok(design)
    }

    /// Checks the parameters of the family, but not the range.
    fn check_parameters(&self) -> Result<(), DomainError> {
        if self.family == PriorFamily::LogNormal {
            let [median, factor, _] = self.values;
            DomainError::require_positive("lognormal", "median", median)?;
            let is_above = factor > 1.0 && factor.is_finite();
            return DomainError::require(is_above, "lognormal", "factor", "above 1", factor);
        }
        match self.is_uniform() {
            true => Ok(()),
            false => with_family!(self, d => Univariate::validate(&d)),
        }
    }
}

impl Default for Prior {
    fn default() -> Self {
        Self::uniform(0.0, 1.0)
    }
}

impl fmt::Display for Prior {
    /// Writes the prior as in `uniform between 250 and 300`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { family, values, range: [lower, upper] } = self;
        write!(f, "{family}")?;
        for (i, (key, value)) in family.keys().iter().zip(values).enumerate() {
            write!(f, "{}{key} {value}", if i == 0 { " (" } else { ", " })?;
        }
        let end = if family.keys().is_empty() { "" } else { ")" };
        write!(f, "{end} between {lower} and {upper}")
    }
}

ppl::univariate!([] Prior);

impl Univariate for Prior {
    fn validate(&self) -> Result<(), DomainError> {
        self.check_parameters()?;
        with_distribution!(self, d => Univariate::validate(&d))?;
        if self.is_uniform() {
            return Ok(());
        }
        let [lower, upper] = self.range;
        let (first, last) = with_family!(self, d => UnivariateDensity::<f64>::support(&d)).bounds();
        let name = "range of the prior";
        let at_least = format_args!("at least {first}, the lower end of the distribution");
        DomainError::require(lower >= first, "", name, at_least, lower)?;
        let at_most = format_args!("at most {last}, the upper end of the distribution");
        DomainError::require(upper <= last, "", name, at_most, upper)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        with_distribution!(self, d => d.sample(rng))
    }

    fn mean(&self) -> f64 {
        with_distribution!(self, d => d.mean())
    }

    fn variance(&self) -> f64 {
        with_distribution!(self, d => d.variance())
    }

    fn cdf(&self, x: f64) -> f64 {
        with_distribution!(self, d => d.cdf(x))
    }

    fn sf(&self, x: f64) -> f64 {
        with_distribution!(self, d => d.sf(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        with_distribution!(self, d => d.quantile(p))
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        with_distribution!(self, d => d.upper_quantile(q))
    }
}

impl<R: Scalar> UnivariateDensity<R> for Prior {
    const CONSTANT: bool = true;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Between(R::from(self.range[0]), R::from(self.range[1]))
    }

    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        with_distribution!(self, d => d.add_ln_pdf(x, terms));
    }

    /// Delegates to the family's distribution, because for `Uniform` the density and the Jacobian of the transform
    /// cancel.
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        with_distribution!(self, d => d.at_coordinate(y, terms))
    }
}

/// Creates the error of a key, with the help for the user.
fn error<E: Error>(problem: impl fmt::Display, help: impl fmt::Display) -> E {
    E::custom(format!("{problem}; help: {help}"))
}

impl Serialize for Prior {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.is_uniform() {
            return self.range.serialize(serializer);
        }
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry(&PriorKey::Distribution, &self.family)?;
        for (key, value) in self.family.keys().iter().zip(self.values) {
            map.serialize_entry(key, &value)?;
        }
        map.serialize_entry(&PriorKey::Range, &self.range)?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for Prior {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_any(PriorVisitor)
    }
}

impl JsonSchema for Prior {
    fn schema_name() -> Cow<'static, str> {
        "Prior".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let range = generator.subschema_for::<PriorBounds>();
        let families = PriorFamily::ALL.iter().map(|family| {
            let numbers = family.keys().iter().map(|key| {
                let number = json_schema!({ "type": "number", "description": key.meaning() });
                (key.to_string(), number)
            });
            let mut properties: BTreeMap<String, Schema> = numbers.collect();
            let mut required: Vec<String> = properties.keys().cloned().collect();
            required.push("distribution".into());
            if *family == PriorFamily::Uniform {
                required.push("range".into());
            }
            let (name, bounds) = (PriorKey::Distribution.meaning(), PriorKey::Range.meaning());
            let name = json_schema!({ "const": family, "description": name });
            properties.insert("distribution".into(), name);
            let bounds = json_schema!({ "description": bounds, "allOf": [range] });
            properties.insert("range".into(), bounds);
            json_schema!({
                "type": "object",
                "properties": properties,
                "required": required,
                "additionalProperties": false,
            })
        });
        let mut forms = vec![range.clone()];
        forms.extend(families);
        json_schema!({
            "description": "The prior: a range [lower, upper], in which the prior is uniform, or a distribution that is \
                            truncated to a range.",
            "anyOf": forms,
        })
    }
}

/// Visitor that reads a range or a table.
struct PriorVisitor;

impl<'de> Visitor<'de> for PriorVisitor {
    type Value = Prior;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[lower, upper] or a table with a distribution")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<Prior, A::Error> {
        let [lower, upper] = two_numbers(SeqAccessDeserializer::new(sequence))?;
        Ok(Prior::uniform(lower, upper))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Prior, A::Error> {
        let (mut family, mut range, mut values) = (None, None, BTreeMap::new());
        while let Some(key) = map.next_key::<PriorKey>()? {
            match key {
                PriorKey::Distribution => family = Some(map.next_value::<PriorFamily>()?),
                PriorKey::Range => range = Some(map.next_value::<PriorBounds>()?.0),
                key => drop(values.insert(key, map.next_value::<f64>()?)),
            }
        }
        let family = family.ok_or_else(|| {
            let help = "State the distribution, such as distribution = \"lognormal\", or write [lower, upper].";
            error("the prior names no distribution", help)
        })?;
        let keys = family.keys();
        let names: Vec<String> = keys.iter().map(|key| format!("{key} = …")).collect();
        let write = || {
            let names: String = names.iter().map(|name| format!("{name}, ")).collect();
            format!("Write {{ distribution = \"{family}\", {names}range = [lower, upper] }}.")
        };
        if let Some(key) = values.keys().find(|key| !keys.contains(key)) {
            return Err(error(format!("the distribution {family} has no key {key}"), write()));
        }
        let is_missing = |key: &&PriorKey| !values.contains_key(key);
        if let Some(key) = keys.iter().find(is_missing) {
            return Err(error(format!("the distribution {family} needs the key {key}"), write()));
        }
        let values: Vec<f64> = keys.iter().map(|key| values[key]).collect();
        let prior = Prior::new(family, &values);
        match range {
            Some([lower, upper]) => Ok(prior.within(lower, upper)),
            None if prior.is_uniform() => Err(error("a uniform prior needs a range", write())),
            None => Ok(prior),
        }
    }
}

#[cfg(test)]
mod tests;
