//! Plates over data of every type.

use std::fmt::Write;

use rand::Rng;

use super::writer::Writer;

/// Arrays of data with distributions for them; `#m` stands for any real number, `#s` for a positive number, `#p` for a
/// probability.
const FAMILIES: [(&str, &[&str]); 5] = [
    (
        "ys",
        &[
            "StudentT(#s + 2.0, #m, #s)",
            "Normal(#m, #s).censor(-0.8..0.9)",
            "Normal(#m, #s).truncate(-2.0..)",
            "Mixture([0.3, 0.7], [Normal(#m, #s), Normal(#m, #s)])",
            "Mixture([0.3, 0.7], [StudentT(1.0, #m, #s), StudentT(1.0, #m, 0.7)])",
        ],
    ),
    (
        "positive",
        &[
            "Gamma(#s, #s)",
            "LogNormal(#m, #s)",
            "Weibull(#s, #s)",
            "Exponential(#s)",
            "Exponential(#s).censor(..2.0)",
            "HalfNormal(#s)",
            "HalfCauchy(#s)",
        ],
    ),
    ("shares", &["Beta(#s, #s)"]),
    (
        "counts",
        &[
            "Poisson(#s)",
            "PoissonLog(#m)",
            "Binomial(9u64, #p)",
            "BinomialLogit(9u64, #m)",
            "Mixture([0.4, 0.6], [Poisson(#s), Poisson(#s)])",
        ],
    ),
    ("hits", &["Bernoulli(#p)", "BernoulliLogit(#m)"]),
];

impl Writer {
    /// Writes a plate over one array of data, whose parameters may vary along the plate.
    pub(crate) fn data(&mut self, text: &mut String) -> std::fmt::Result {
        let (data, families) = FAMILIES[self.rng.random_range(0..FAMILIES.len())];
        let (y, scope) = (self.name(), self.scalars.len());
        let moves = self.rng.random();
        if moves {
            let (name, formula) = (self.name(), self.number(1));
            writeln!(text, "    for (x, {y}) in xs.iter().zip({data}) {{")?;
            writeln!(text, "        let {name} = {formula} * x;")?;
            self.scalars.push(name);
        } else {
            writeln!(text, "    for {y} in {data} {{")?;
        }
        let family = self.pick(families);
        let family = self.filled(&family);
        writeln!(text, "        {y} ~ {family};\n    }}")?;
        self.scalars.truncate(scope);
        Ok(())
    }

    /// Replaces `#m`, `#s` and `#p` in a pattern by random formulas.
    pub(crate) fn filled(&mut self, pattern: &str) -> String {
        let mut pieces = pattern.split('#');
        let mut text = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (place, rest) = piece.split_at(1);
            text += &match place {
                "m" => self.number(1),
                "s" => self.scale(),
                _ => format!("{}.logistic()", self.number(1)),
            };
            text += rest;
        }
        text
    }
}
