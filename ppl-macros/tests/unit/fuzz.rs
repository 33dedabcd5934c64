//! Fuzz tests: for any sequence of tokens, the macro returns valid Rust, because code is mostly invalid while it is
//! typed.

use std::panic::{AssertUnwindSafe, catch_unwind};

use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::expand;

/// Models with every kind of statement.
const MODELS: &str = r##"
    /// A calibration.
    pub fn calibration<'a, const D: usize, F>(forward: &'a F, qois: &[[f64; 3]], own: Vec<f64>)
    where
        F: Differentiable<D, 3>,
    {
        let young ~ Uniform(250.0, 300.0);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);
        #[track] let mean = forward.try_at([young; D])?;
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        own[0] ~ Normal(0.0, 1.0);
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
        #[predict] for _ in qois {
            #[track] let twice = 2.0 * young;
            let again ~ Normal(twice, 1.0);
        }
    }

    fn branches(robust: bool, prior: Option<f64>, kind: u8, ys: &[f64]) {
        let mean ~ Normal(0.0, 2.0);
        let sd = if let Some(scale) = prior {
            let free ~ Normal(0.0, scale).truncate(0.0..);
            free
        } else {
            Real::from(1.0)
        };
        let shift = match kind {
            0 => Real::from(0.0),
            1 | 2 if robust => { let heavy ~ StudentT(3.0, 0.0, 1.0); heavy }
            _ => { let light ~ Normal(0.0, 1.0); light }
        };
        'plate: for (i, y) in ys.iter().enumerate() {
            if y.is_nan() { continue 'plate; } else if i > 3 { break; }
            y ~ Normal(mean + shift, sd);
        }
        let mut total = Real::from(0.0);
        while total < 1.0 { total += mean.abs() + 1.0; }
        let mut h: Vec<Real> = vec![mean; 3];
        for t in 1..3 { h[t] += mean * (h[t - 1] - 1.0); }
        let Some(first) = ys.first() else { reject!("no data in {kind}") };
        const LIMIT: f64 = 3.0;
        if mean > LIMIT { reject!("{mean} is above {LIMIT}"); }
        { let b = 2.0 * total; factor(-b.square() * *first); }
        let f = |x: f64| -> Result<f64, ()> { Ok(x) };
        ys.peak[1] ~ Normal(f(1.0).unwrap(), 0.5);
    }

    fn offsets<T: Into<f64>>(level: Real, scale: T, groups: usize) -> Vec<Real> {
        let spread ~ HalfNormal(scale);
        let z ~ Normal(0.0, 1.0).iid(groups);
        if groups > 0 { z.iter().map(|z| level + spread * *z).collect() } else { Vec::new() }
    }

    fn parts(names: &[&str], xs: &[Option<f64>], ys: &[f64]) -> () {
        #[dims(school = names, year)] let grid ~ Normal(0.0, 1.0).array::<2>();
        #[track] let theta ~ priors::offsets(0.0, 1.0, 4);
        #[allow(unused)]
        #[dims(school)]
        for (x, y) in xs.iter().zip(ys) {
            x.impute() ~ Normal(grid[0], 1.0);
            *y ~ Normal(theta[0] * x, 1.0);
        }
        #[predict] let other ~ offsets(0.0, 1.0, 4);
    }
"##;

/// Tokens that change the meaning of their neighbours.
const WORDS: &str = "let for in if else match while loop return mut ref fn struct impl as self \
    factor reject impute dims track predict Real x y ~ ; , . : :: = => -> ! ? # & | * < > .. 'a 0 \
    1.0 \"text\" _ async await move unsafe const static pub where dyn";

struct Mutator {
    rng: Xoshiro256PlusPlus,
    /// The tokens of [`WORDS`], followed by the tokens of [`MODELS`].
    vocabulary: Vec<TokenTree>,
    /// Number of tokens of [`WORDS`].
    special: usize,
}

impl Mutator {
    fn new(seed: u64) -> Self {
        let corpus = leaves(MODELS.parse().unwrap());
        let mut vocabulary = leaves(WORDS.parse().unwrap());
        let special = vocabulary.len();
        vocabulary.extend(corpus);
        Self { rng: Xoshiro256PlusPlus::seed_from_u64(seed), vocabulary, special }
    }

    fn word(&mut self) -> TokenTree {
        // special tokens are as frequent as tokens of the models
        let special = self.rng.random();
        let from = if special { &self.vocabulary[..self.special] } else { &self.vocabulary[..] };
        from.choose(&mut self.rng).unwrap().clone()
    }

    /// Makes one random change in the stream.
    fn mutate(&mut self, stream: TokenStream) -> TokenStream {
        let mut trees: Vec<TokenTree> = stream.into_iter().collect();
        let sizes: Vec<usize> = trees.iter().map(size).collect();
        let mut at = self.rng.random_range(0..=sizes.iter().sum());
        for (i, size) in sizes.into_iter().enumerate() {
            if at >= size {
                at -= size;
                continue;
            }
            match &trees[i] {
                TokenTree::Group(group) if at > 0 => {
                    let mut inner = Group::new(group.delimiter(), self.mutate(group.stream()));
                    inner.set_span(group.span());
                    trees[i] = inner.into();
                }
                _ => self.change(&mut trees, i),
            }
            return trees.into_iter().collect();
        }
        trees.push(self.word());
        trees.into_iter().collect()
    }

    fn change(&mut self, trees: &mut Vec<TokenTree>, i: usize) {
        match self.rng.random_range(0..8) {
            0 => drop(trees.remove(i)),
            1 => trees.insert(i, trees[i].clone()),
            2 if i + 1 < trees.len() => trees.swap(i, i + 1),
            3 => trees.insert(i, self.word()),
            4 => {
                let delimiters = [Delimiter::Brace, Delimiter::Parenthesis, Delimiter::Bracket];
                let delimiter = *delimiters.choose(&mut self.rng).unwrap();
                trees[i] = Group::new(delimiter, trees[i].clone().into()).into();
            }
            5 => {
                // unwrap a group, as a superfluous closing delimiter would
                if let TokenTree::Group(group) = trees[i].clone() {
                    trees.splice(i..=i, group.stream());
                }
            }
            6 => trees.truncate(i),
            _ => trees[i] = self.word(),
        }
    }
}

fn size(tree: &TokenTree) -> usize {
    match tree {
        TokenTree::Group(group) => 1 + group.stream().into_iter().map(|t| size(&t)).sum::<usize>(),
        _ => 1,
    }
}

fn leaves(stream: TokenStream) -> Vec<TokenTree> {
    stream
        .into_iter()
        .flat_map(|tree| match tree {
            TokenTree::Group(group) => leaves(group.stream()),
            leaf => vec![leaf],
        })
        .collect()
}

/// Expands the input, checks that the result is valid Rust, and returns the text of the result.
fn answer(input: &TokenStream) -> Result<String, String> {
    let expanded = catch_unwind(AssertUnwindSafe(|| expand(input.clone())))
        .map_err(|_| "the macro panicked".to_owned())?;
    let text = expanded.to_string();
    match syn::parse2::<syn::File>(expanded) {
        Ok(_) => Ok(text),
        Err(error) => Err(format!("not Rust: {error}\n{text}")),
    }
}

/// Returns each model separately, so that an error in one model does not hide errors in other models.
fn corpus() -> Vec<TokenStream> {
    let mut models = vec![Vec::new()];
    for tree in MODELS.parse::<TokenStream>().unwrap() {
        let ends = matches!(&tree, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace);
        models.last_mut().unwrap().push(tree);
        if ends {
            models.push(Vec::new());
        }
    }
    models.retain(|model| !model.is_empty());
    models.into_iter().map(|model| model.into_iter().collect()).collect()
}

#[test]
fn valid_models_have_no_errors() {
    assert_eq!(corpus().len(), 4);
    for model in corpus() {
        let expanded = answer(&model).unwrap_or_else(|problem| panic!("{problem}\nfor {model}"));
        assert!(!expanded.contains("compile_error"), "{expanded}");
    }
}

#[test]
fn no_input_makes_the_macro_panic() {
    const CASES: usize = 1500;
    let corpus = corpus();
    let mut mutator = Mutator::new(7);
    let mut refused = 0;
    for case in 0..CASES {
        let mut input = corpus[case % corpus.len()].clone();
        for _ in 0..mutator.rng.random_range(1..=4) {
            input = mutator.mutate(input);
        }
        let expanded =
            answer(&input).unwrap_or_else(|problem| panic!("case {case}: {problem}\nfor {input}"));
        refused += usize::from(expanded.contains("compile_error"));
    }
    // most mutants are invalid, and the macro detects many of them
    assert!(refused > CASES / 3, "{refused} of {CASES} refused");
}
