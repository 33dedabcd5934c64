//! Words with which a case describes a prior: families of distributions with their keys, and
//! bounds.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// Defines a list of words of a case file.
macro_rules! words {
    ($(#[$doc:meta])* $Name:ident: $($Word:ident = $word:literal),* $(,)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum $Name {$(
            #[doc = concat!("`", $word, "`")]
            #[serde(rename = $word)]
            $Word
        ),*}

        impl $Name {
            /// All words.
            pub const ALL: &[Self] = &[$(Self::$Word),*];
        }

        impl fmt::Display for $Name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(match self { $(Self::$Word => $word),* })
            }
        }
    };
}

words! {
    /// Family of distributions of a [`Prior`](crate::Prior).
    PriorFamily:
    Uniform = "uniform",
    Normal = "normal",
    LogNormal = "lognormal",
    Gamma = "gamma",
    Beta = "beta",
    StudentT = "student-t",
    Exponential = "exponential",
    Weibull = "weibull",
    InverseGamma = "inverse-gamma",
    Triangular = "triangular",
}

words! {
    /// Key in the table of a prior in a case.
    PriorKey:
    Distribution = "distribution",
    Range = "range",
    Mean = "mean",
    Sd = "sd",
    Median = "median",
    Factor = "factor",
    Shape = "shape",
    Rate = "rate",
    A = "a",
    B = "b",
    DegreesOfFreedom = "degrees_of_freedom",
    Location = "location",
    Scale = "scale",
    Lower = "lower",
    Mode = "mode",
    Upper = "upper",
}

impl PriorFamily {
    /// Keys of the family's parameters. The lognormal distribution has a median and the factor exp(σ), where σ is the
    /// standard deviation of the logarithm.
    pub fn keys(self) -> &'static [PriorKey] {
        match self {
            Self::Uniform => &[],
            Self::Normal => &[PriorKey::Mean, PriorKey::Sd],
            Self::LogNormal => &[PriorKey::Median, PriorKey::Factor],
            Self::Gamma => &[PriorKey::Shape, PriorKey::Rate],
            Self::Beta => &[PriorKey::A, PriorKey::B],
            Self::StudentT => &[PriorKey::DegreesOfFreedom, PriorKey::Location, PriorKey::Scale],
            Self::Exponential => &[PriorKey::Rate],
            Self::Weibull | Self::InverseGamma => &[PriorKey::Shape, PriorKey::Scale],
            Self::Triangular => &[PriorKey::Lower, PriorKey::Mode, PriorKey::Upper],
        }
    }
}

impl PriorKey {
    /// Meaning of the key, for the user.
    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Distribution => "Family of the distribution.",
            Self::Range => {
                "Lower and upper bound in the unit of the parameter. Default: the quantiles 0.1 % and 99.9 %."
            }
            Self::Mean => "Mean, in the unit of the parameter.",
            Self::Sd => "Standard deviation, in the unit of the parameter.",
            Self::Median => "Median, in the unit of the parameter.",
            Self::Factor => "Exponential of the standard deviation of the logarithm, above 1.",
            Self::Shape => "Shape, dimensionless.",
            Self::Rate => "Rate, in the inverse unit of the parameter.",
            Self::A => "First shape of the beta distribution on 0 to 1.",
            Self::B => "Second shape of the beta distribution on 0 to 1.",
            Self::DegreesOfFreedom => "Degrees of freedom.",
            Self::Location => "Centre, in the unit of the parameter.",
            Self::Scale => "Scale, in the unit of the parameter.",
            Self::Lower => "Lower end of the triangle, in the unit of the parameter.",
            Self::Mode => "Peak of the triangle, in the unit of the parameter.",
            Self::Upper => "Upper end of the triangle, in the unit of the parameter.",
        }
    }
}

/// Lower and upper bound of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct PriorBounds(#[serde(deserialize_with = "two_numbers")] pub [f64; 2]);

/// Reads exactly two numbers. Deserialising an array `[f64; 2]` would ignore further numbers.
pub(super) fn two_numbers<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; 2], D::Error> {
    let values = Vec::<f64>::deserialize(source)?;
    let count = values.len();
    values.try_into().map_err(|_| {
        serde::de::Error::custom(format!("{count} numbers, expected two: [lower, upper]"))
    })
}
