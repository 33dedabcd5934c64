//! Vectors, matrices, states, nested plates, submodels.

use std::fmt::Write;

use rand::Rng;

use super::writer::Writer;

/// Groups of statements; `@a`, `@b` and `@c` stand for new names, `#m`, `#s` and `#p` for formulas as in `FAMILIES`.
const SHAPES: [&str; 16] = [
    // matrices
    "let @a ~ LkjCholesky::<3>(1.5);
    let @b = @a.scale_rows([#s, #s, #s]);
    for row in rows {
        let @c = *row;
        @c ~ MvNormalCholesky([#m, #m, #m], @b);
    }",
    "let @a ~ LkjCholesky::<3>(0.8);
    for (x, row) in xs.iter().zip(rows) {
        let @c = *row;
        @c ~ MvNormalCholesky([#m * x, #m, #m], @a.scale_rows([#s, #s, #s]));
    }",
    // states
    "let mut @a: Vec<Real> = vec![#m + 0.0 * #m; 12];
    for t in 1..12 {
        @a[t] = @a[t - 1] * 0.6 + #m * xs[t];
    }
    for (@b, @c) in @a.iter().zip(ys) {
        @c ~ Normal(*@b, #s);
    }",
    "let @a ~ Normal(#m, #s).iid(12);
    let mut @b: Vec<Real> = @a.to_vec();
    for t in 1..12 {
        @b[t] += 0.4 * #m.tanh() * @b[t - 1];
    }
    for t in 0..12 {
        let @c = ys[t];
        @c ~ Normal(@b[t], #s);
    }",
    "ys[0] ~ Normal(#m, #s);
    for t in 1..12 {
        ys[t] ~ Normal(#m + 0.5 * #m * ys[t - 1], #s);
    }",
    "let mut @a = 0.0;
    let mut @b = [0.5; 12];
    for (x, @c) in xs.iter().zip(ys) {
        @c ~ Normal(@a, #s);
        @a = 0.5 * @a + #m * x;
    }
    for (@c, x) in @b.iter_mut().zip(xs) {
        *@c = *@c * #m - x;
    }
    factor(-0.1 * (@b[3] * @a - @b[7]).square());",
    "let mut @a = 1.0;
    let mut @b = vec![];
    for x in xs {
        @a = if *x > 0.3 { 0.5 } else { #m.tanh() * @a };
        @b.push(@a);
    }
    if @a > 0.1 {
        for @c in ys {
            @c ~ Normal(#m, #s);
        }
    } else {
        for (@c, mean) in positive.iter().zip(&@b) {
            @c ~ Normal(*mean, #s);
        }
    }",
    // plates within plates
    "for i in 0..4 {
        let @a ~ Normal(#m, #s);
        for j in 0..3 {
            let @b = ys[3 * i + j];
            @b ~ Normal(@a + #m * xs[3 * i + j], #s);
        }
        factor(-0.2 * (@a - #m).square());
    }",
    "let @a ~ Normal(#m, #s).iid(4);
    let @b ~ StudentT(5.0, 0.0, #s).iid(3);
    for (i, (x, @c)) in xs.iter().zip(ys).enumerate() {
        @c ~ Normal(@a[i % 4] * #m + @b[i / 4] - #m * x, #s);
    }",
    // mixtures, orders
    "let @a ~ Beta(2.0, 2.0);
    for @c in ys {
        @c ~ Mixture([@a, 1.0 - @a], [Normal(#m, #s), Normal(#m, 0.6)]);
    }",
    "let @a ~ Normal(0.0, 1.5).array::<2>().ordered();
    for (x, @b) in xs.iter().zip(kinds) {
        @b ~ PoissonLog(#m * x + @a[0] - 0.2 * @a[1]);
    }",
    "let @a ~ Normal(0.0, #s).array::<3>();
    for (x, @b) in xs.iter().zip(kinds) {
        @b ~ PoissonLog(@a[0] * x + @a[1] * #m - @a[2]);
    }",
    // scales, gaps, branches
    "for (x, @a) in xs.iter().zip(ys) {
        let @b ~ Normal(#m, #s).non_centered();
        @a ~ Normal(@b + #m * x, 0.7);
    }",
    "for (x, @a) in xs.iter().zip(gaps) {
        @a.impute() ~ Normal(#m * x, #s);
    }",
    "for (x, @a) in xs.iter().zip(ys) {
        if *x > 0.1 {
            @a ~ Normal(#m * x, #s);
        } else {
            let @b ~ Normal(0.0, #s);
            @a ~ StudentT(1.0, @b, #s);
        }
    }",
    "let @a ~ level(#m, ys);
    let @b ~ levels(#s, 4);
    for (i, @c) in ys.iter().enumerate() {
        @c ~ Normal(@a * 0.3 + @b[i % 4], #s);
    }",
];

impl Writer {
    /// Writes one group of statements of `SHAPES`.
    pub(crate) fn shape(&mut self, text: &mut String) -> std::fmt::Result {
        let kind = self.rng.random_range(0..SHAPES.len());
        let mut pattern = SHAPES[kind].to_owned();
        // an entry of an array can be observed only once
        if pattern.starts_with("ys[0]") && text.contains("ys[0] ~") {
            pattern = SHAPES[0].to_owned();
        }
        for place in ["@a", "@b", "@c"] {
            let name = self.name();
            pattern = pattern.replace(place, &name);
        }
        let statements = self.filled(&pattern);
        writeln!(text, "    {statements}")
    }
}
