//! Random names and formulas.

use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Writer of random statements; it stores the expressions that are in scope.
pub(crate) struct Writer {
    pub(crate) rng: Xoshiro256PlusPlus,
    /// Expressions of one number.
    pub(crate) scalars: Vec<String>,
    /// Names of arrays of three unknowns.
    pub(crate) arrays: Vec<String>,
    names: usize,
}

impl Writer {
    pub(crate) fn new(seed: u64) -> Self {
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        Self { rng, scalars: Vec::new(), arrays: Vec::new(), names: 0 }
    }

    pub(crate) fn name(&mut self) -> String {
        self.names += 1;
        format!("v{}", self.names)
    }

    pub(crate) fn pick(&mut self, from: &[&str]) -> String {
        from.choose(&mut self.rng).expect("not empty").to_string()
    }

    fn leaf(&mut self) -> String {
        match self.rng.random_range(0..6) {
            0 => format!("{:.2}", self.rng.random_range(0.2..2.0)),
            1 if !self.arrays.is_empty() => {
                let array = self.arrays.choose(&mut self.rng).expect("not empty").clone();
                format!("{array}[{}]", self.rng.random_range(0..3))
            }
            _ => self.scalars.choose(&mut self.rng).expect("an unknown comes first").clone(),
        }
    }

    /// A formula that depends on an unknown and is bounded or grows slowly.
    pub(crate) fn number(&mut self, depth: usize) -> String {
        let first = self.scalars.choose(&mut self.rng).expect("an unknown comes first").clone();
        let rest = self.part(depth);
        format!("({first} * 0.5 + {rest})")
    }

    fn part(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.leaf();
        }
        let (a, b) = (self.part(depth - 1), self.part(depth - 1));
        // methods are called on unknowns, as the type of a literal would be ambiguous
        let x = self.scalars.choose(&mut self.rng).expect("an unknown comes first").clone();
        match self.rng.random_range(0..10) {
            0 => format!("({a} + {b})"),
            1 => format!("({a} - {b})"),
            2 => format!("(({x} * {a}).tanh() * {b})"),
            3 => format!("({a} / (1.5 + ({x} + {b}).square()))"),
            4 => format!("-({x} - {a}).sin()"),
            5 => format!("({x} + {a}).logistic()"),
            6 => format!("(({x} * {b}).square() + 1.0).sqrt()"),
            7 => format!("({x} - {b}).softplus().ln_1p()"),
            8 => format!("({x} - {a}).max({b} * 0.5).min({x} + 1.5)"),
            _ => format!("({x} * 0.3).powi(3).cos()"),
        }
    }

    pub(crate) fn scale(&mut self) -> String {
        let formula = self.number(1);
        self.pick(&["0.7", "(#x).softplus() + 0.3", "(#x).tanh().exp()"]).replace("#x", &formula)
    }

    pub(crate) fn family(&mut self) -> String {
        let (mean, scale) = (self.number(1), self.scale());
        self.pick(&[
            "Normal(#m, #s)",
            "StudentT(4.0, #m, #s)",
            "Normal(#m, #s).truncate(-50.0..50.0)",
        ])
        .replace("#m", &mean)
        .replace("#s", &scale)
    }

    pub(crate) fn unknown(&mut self, indent: &str) -> String {
        let name = self.name();
        let prior = match self.rng.random_range(0..6) {
            0 => "Normal(0.2, 1.1)".to_owned(),
            1 => "HalfNormal(0.8)".to_owned(),
            2 => "Uniform(0.2, 1.5)".to_owned(),
            3 => "Exponential(1.3)".to_owned(),
            4 => "Beta(2.0, 3.0)".to_owned(),
            _ if self.scalars.is_empty() => "LogNormal(0.0, 0.5)".to_owned(),
            _ => self.family(),
        };
        self.scalars.push(name.clone());
        format!("{indent}let {name} ~ {prior};\n")
    }
}
