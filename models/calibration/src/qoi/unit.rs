//! Unit of a quantity of interest.

use std::fmt;

/// Unit of a quantity of interest, as powers of N, mm and s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    pub newton: i8,
    pub millimetre: i8,
    pub second: i8,
}

impl Unit {
    /// No unit.
    pub const ONE: Self = Self { newton: 0, millimetre: 0, second: 0 };
    /// Force.
    pub const N: Self = Self { newton: 1, ..Self::ONE };
    /// Displacement.
    pub const MM: Self = Self { millimetre: 1, ..Self::ONE };
    /// Stiffness.
    pub const N_PER_MM: Self = Self { newton: 1, millimetre: -1, second: 0 };
    /// Energy.
    pub const N_MM: Self = Self { newton: 1, millimetre: 1, second: 0 };
    /// Time.
    pub const S: Self = Self { second: 1, ..Self::ONE };
}

impl fmt::Display for Unit {
    /// Writes the unit as in `N/mm`, `N mm` or, for a quantity without unit, `1`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let powers = [("N", self.newton), ("mm", self.millimetre), ("s", self.second)];
        let part = |sign: i8| {
            let factors = powers.iter().filter(move |(_, power)| power * sign > 0);
            let factors = factors.map(|(symbol, power)| match power.abs() {
                1 => (*symbol).to_owned(),
                power => format!("{symbol}^{power}"),
            });
            factors.collect::<Vec<_>>()
        };
        let (above, below) = (part(1), part(-1));
        let numerator = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match below.as_slice() {
            [] => f.write_str(&numerator),
            [one] => write!(f, "{numerator}/{one}"),
            several => write!(f, "{numerator}/({})", several.join(" ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_as_in_tables() {
        for (unit, text) in [
            (Unit::ONE, "1"),
            (Unit::N, "N"),
            (Unit::MM, "mm"),
            (Unit::N_PER_MM, "N/mm"),
            (Unit::N_MM, "N mm"),
            (Unit { newton: 1, millimetre: -2, second: 0 }, "N/mm^2"),
            (Unit { newton: 0, millimetre: -1, second: -1 }, "1/(mm s)"),
        ] {
            assert_eq!(unit.to_string(), text);
        }
    }
}
