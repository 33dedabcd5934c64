//! Linear and logarithmic scales: the coordinates in which an expansion is a polynomial.

use serde::{Deserialize, Serialize};

use crate::dataset::Input;
use crate::error::SurrogateError;

/// Scale on which an input or an output is expanded: the number itself or its logarithm.
///
/// A power law becomes a polynomial of order 1 if its input and its output are on logarithmic scales.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Linear scale: the number itself.
    #[default]
    Linear,
    /// Logarithmic scale: the natural logarithm of the number. The lower bound of an input must be above 0.
    Log,
}

impl Scale {
    /// The coordinate of the number y on the scale: z = y or z = ln y.
    #[inline]
    pub(crate) fn coordinate(self, y: f64) -> f64 {
        match self {
            Self::Linear => y,
            Self::Log => y.ln(),
        }
    }

    /// The number y at the coordinate z on the scale, and the derivative dy/dz, which is 1 or y.
    #[inline]
    pub(crate) fn value_and_slope(self, z: f64) -> (f64, f64) {
        match self {
            Self::Linear => (z, 1.0),
            Self::Log => {
                let y = z.exp();
                (y, y)
            }
        }
    }

    /// Returns the derivative dy/dz as a function of the number `y`, where z is the coordinate of y on the scale.
    #[inline]
    pub(crate) fn slope_at(self, y: f64) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Log => y,
        }
    }

    /// Returns the residual y − f of a number y in the unit of y, given its residual r on the scale. For a
    /// logarithmic scale, r = ln y − ln f, and the result is y (1 − e^(−r)).
    pub(crate) fn residual(self, y: f64, r: f64) -> f64 {
        match self {
            Self::Linear => r,
            Self::Log => -y * (-r).exp_m1(),
        }
    }
}

/// The interval of an input on its linear or logarithmic scale, and the map of this interval onto
/// [−1, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) scale: Scale,
    /// Lower bound of the interval, as a coordinate on the scale.
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Axis {
    /// The interval of `input` on `scale`.
    ///
    /// # Errors
    /// If the scale is logarithmic and the lower bound is not above 0.
    pub(crate) fn new(input: &Input, scale: Scale) -> Result<Self, SurrogateError> {
        if scale == Scale::Log && input.lower <= 0.0 {
            return Err(SurrogateError::Logarithm { name: input.name.clone(), value: input.lower });
        }
        let [lower, upper] = [input.lower, input.upper].map(|x| scale.coordinate(x));
        Ok(Self { scale, lower, upper })
    }

    /// The coordinate t of the value `x`; t ∈ [−1, 1] inside the interval.
    #[inline]
    pub(crate) fn to_unit(self, x: f64) -> f64 {
        let z = self.scale.coordinate(x);
        ((z - self.lower) - (self.upper - z)) / (self.upper - self.lower)
    }

    /// The value x at the coordinate t ∈ [−1, 1].
    pub(crate) fn at_unit(self, t: f64) -> f64 {
        let z = 0.5 * ((1.0 - t) * self.lower + (1.0 + t) * self.upper);
        self.scale.value_and_slope(z).0
    }

    /// Returns the derivative dt/dz of the coordinate t ∈ [−1, 1] with respect to the coordinate z on the scale.
    #[inline]
    pub(crate) fn unit_slope(self) -> f64 {
        2.0 / (self.upper - self.lower)
    }

    /// Returns the derivative dt/dx of the coordinate t ∈ [−1, 1] with respect to the input x, at the value `x`.
    #[inline]
    pub(crate) fn slope_at(self, x: f64) -> f64 {
        self.unit_slope() / self.scale.slope_at(x)
    }

    /// Whether `x` is inside the interval, or outside by no more than the fraction `tolerance` of the
    /// interval's width on the scale. False for NaN.
    pub(crate) fn is_near(self, x: f64, tolerance: f64) -> bool {
        let margin = tolerance * (self.upper - self.lower);
        let z = self.scale.coordinate(x);
        self.lower - margin <= z && z <= self.upper + margin
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn an_axis_maps_its_interval_and_back() {
        let input = Input::new("x", 1e-5, 5e-3).unwrap();
        for scale in [Scale::Linear, Scale::Log] {
            let axis = Axis::new(&input, scale).unwrap();
            assert_relative_eq!(axis.to_unit(1e-5), -1.0, epsilon = 1e-14);
            assert_relative_eq!(axis.to_unit(5e-3), 1.0, epsilon = 1e-14);
            assert_relative_eq!(axis.at_unit(axis.to_unit(7e-4)), 7e-4, max_relative = 1e-13);
            let h = 1e-9;
            let slope = (axis.to_unit(7e-4 + h) - axis.to_unit(7e-4 - h)) / (2.0 * h);
            assert_relative_eq!(axis.slope_at(7e-4), slope, max_relative = 1e-7);
        }
        // the middle of a logarithmic interval is the geometric mean of its bounds
        let middle = Axis::new(&input, Scale::Log).unwrap().at_unit(0.0);
        assert_relative_eq!(middle, (1e-5 * 5e-3f64).sqrt(), max_relative = 1e-13);
    }

    #[test]
    fn a_tolerance_is_a_fraction_of_the_width_on_the_scale() {
        let axis = Axis::new(&Input::new("x", 1.0, 100.0).unwrap(), Scale::Log).unwrap();
        assert!(axis.is_near(0.96, 0.01) && !axis.is_near(0.95, 0.01));
        assert!(axis.is_near(104.0, 0.01) && !axis.is_near(105.0, 0.01));
        assert!([0.0, -1.0, f64::NAN].iter().all(|&x| !axis.is_near(x, 0.01)));
        let zero = Input::new("x", 0.0, 1.0).unwrap();
        assert!(matches!(Axis::new(&zero, Scale::Log), Err(SurrogateError::Logarithm { .. })));
    }

    #[test]
    fn a_residual_of_a_logarithm_is_that_of_the_number() {
        let (y, f) = (3.0f64, 2.5f64);
        assert_relative_eq!(Scale::Log.residual(y, y.ln() - f.ln()), 0.5, max_relative = 1e-14);
        assert_eq!(Scale::Linear.residual(y, y - f), 0.5);
    }
}
