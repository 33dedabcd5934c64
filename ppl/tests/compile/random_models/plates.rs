//! Plates with linear and other predictors.

use std::fmt::Write;

use rand::{Rng, seq::IndexedRandom};

use super::writer::Writer;

impl Writer {
    /// Writes a sum over unknowns as a loop, and returns its name.
    fn sum(&mut self, array: &str, text: &mut String) -> Result<String, std::fmt::Error> {
        let (name, start, factor) = (self.name(), self.number(1), self.number(1));
        let head = self.pick(&["d in 0..3", "(a, r) in #.iter().zip(row)"]).replace('#', array);
        let [a, r] = match head.starts_with('d') {
            true => [format!("{array}[d]"), "row[d]".to_owned()],
            false => ["a", "r"].map(str::to_owned),
        };
        let step = self.pick(&["+= #a * #r", "-= #a * #r * #f", "+= (#a * #f).sin() * #r"]);
        let step = step.replace("#a", &a).replace("#r", &r).replace("#f", &factor);
        self.write_sum(&name, &start, &head, &step, text)?;
        if self.rng.random() {
            writeln!(text, "        {name} -= {factor};")?;
        }
        if self.rng.random_range(0..4) == 0 {
            self.scalars.push(name.clone());
        }
        Ok(name)
    }

    /// Writes a sum of products with data, and returns its name.
    fn sum_of_products(
        &mut self,
        array: &str,
        text: &mut String,
    ) -> Result<String, std::fmt::Error> {
        let (name, start, factor) = (self.name(), self.number(1), self.number(0));
        let step = self.pick(&["+= #a * r * #f", "-= (#a - #f) * r", "+= r * #a + r * x * #f"]);
        let heads = ["(d, r) in rows[i].iter().enumerate()", "(a, r) in #.iter().zip(&rows[i])"];
        let head = self.pick(&heads).replace('#', array);
        let a = if head.starts_with("(d") { format!("{array}[d]") } else { "a".to_owned() };
        let step = step.replace("#a", &a).replace("#f", &factor);
        self.write_sum(&name, &start, &head, &step, text)?;
        Ok(name)
    }

    /// Writes a sum that begins at `start` and adds the terms of a loop or of an iterator.
    fn write_sum(
        &mut self,
        name: &str,
        start: &str,
        head: &str,
        step: &str,
        text: &mut String,
    ) -> std::fmt::Result {
        let (pat, iter) = head.split_once(" in ").expect("the head of a loop");
        let (sign, value) = step.split_once("= ").expect("an assignment");
        if self.rng.random_range(0..3) == 0 {
            let sum = format!("({iter}).map(|{pat}| {value}).sum::<Real<_>>()");
            // a variable that later statements change
            return writeln!(text, "        let mut {name} = {start} {sign} {sum};");
        }
        writeln!(text, "        let mut {name} = {start};")?;
        writeln!(text, "        for {head} {{\n            {name} {step};\n        }}")
    }

    /// Writes a plate with a linear predictor, which the model may evaluate from a matrix of data.
    pub(crate) fn linear(&mut self, text: &mut String) -> std::fmt::Result {
        let (y, scale) = (self.name(), self.scale());
        writeln!(text, "    for (i, (x, {y})) in xs.iter().zip(ys).enumerate() {{")?;
        writeln!(text, "        let away = x * 0.5 - 0.1;")?;
        let mut mean = self.number(1);
        for _ in 0..self.rng.random_range(1..5) {
            let (a, b) = (self.number(1), self.number(0));
            let array = self.arrays.choose(&mut self.rng).cloned();
            let term = match (self.rng.random_range(0..8), array) {
                (0, Some(array)) => format!("{array}[i % 3] * {b}"),
                (1, Some(array)) => format!("away * ({a} - {array}[i / 5 % 2])"),
                (2, Some(array)) => format!("dot(&rows[i], &{array}) / (1.5 + x * x)"),
                (3, Some(array)) => format!("away * {}", self.sum_of_products(&array, text)?),
                (4, Some(array)) => self.sum_of_products(&array, text)?,
                (5, _) => "0.3 * away".to_owned(),
                (6, _) => format!("({a} + {b} * x) * away"),
                _ => format!("x * {a}"),
            };
            write!(mean, "{}{term}", self.pick(&[" + ", " - "]))?;
        }
        if self.rng.random() {
            let name = self.name();
            writeln!(text, "        let {name} = {mean};")?;
            mean = name;
        }
        writeln!(text, "        {y} ~ Normal({mean}, {scale});")?;
        writeln!(text, "    }}")
    }

    pub(crate) fn plate(&mut self, text: &mut String) -> std::fmt::Result {
        let scope = self.scalars.len();
        let y = self.name();
        writeln!(text, "    for ((x, row), {y}) in xs.iter().zip(rows).zip(ys) {{")?;
        if self.rng.random() {
            text.push_str(&self.unknown("        "));
        }
        for _ in 0..self.rng.random_range(0..3) {
            let (name, formula) = (self.name(), self.number(1));
            writeln!(text, "        let {name} = {formula} * x;")?;
            self.scalars.push(name);
        }
        let product = match self.arrays.choose(&mut self.rng).cloned() {
            Some(array) if self.rng.random() => self.sum(&array, text)?,
            Some(array) => format!("dot(row, &{array})"),
            None => "row[0]".to_owned(),
        };
        let (mean, scale) = (self.number(1), self.scale());
        let family = self.pick(&["Normal(#m, #s)", "StudentT(5.0, #m, #s)"]);
        let mean = format!("{mean} + {product}");
        let family = family.replace("#m", &mean).replace("#s", &scale);
        writeln!(text, "        {y} ~ {family};")?;
        writeln!(text, "    }}")?;
        self.scalars.truncate(scope);
        Ok(())
    }
}
