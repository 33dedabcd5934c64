//! Random statements.

use std::fmt::Write;

use rand::{Rng, seq::IndexedRandom};

use super::writer::Writer;

impl Writer {
    /// Writes one random statement.
    pub(crate) fn statement(&mut self, text: &mut String) -> std::fmt::Result {
        match self.rng.random_range(0..16) {
            0 => text.push_str(&self.unknown("    ")),
            1 => {
                let (name, formula) = (self.name(), self.number(2));
                writeln!(text, "    let {name} = {formula};")?;
                self.scalars.push(name);
            }
            2 => {
                let (name, family) = (self.name(), self.family());
                writeln!(text, "    let {name} ~ {family}.array::<3>();")?;
                self.arrays.push(name);
            }
            3 if !self.arrays.is_empty() => {
                let array = self.arrays.choose(&mut self.rng).expect("not empty").clone();
                let (name, formula) = (self.name(), self.number(1));
                writeln!(text, "    let {name} = {array}.map(|a| {formula} * a - a.sin());")?;
                self.arrays.push(name);
            }
            4 => {
                let formula = self.number(2);
                writeln!(text, "    factor(-0.1 * {formula}.square());")?;
            }
            5 | 6 => self.plate(text)?,
            11 => self.linear(text)?,
            12 | 13 => self.data(text)?,
            14 | 15 => self.shape(text)?,
            7 => {
                let (name, start, step) = (self.name(), self.number(1), self.number(1));
                let (y, other, scale) = (self.name(), self.number(1), self.scale());
                writeln!(text, "    let mut {name} = {start};")?;
                writeln!(text, "    for {y} in ys {{")?;
                writeln!(text, "        {name} = ({name} * 0.4 + {step} * {y}).tanh();")?;
                writeln!(text, "        {name} += {other} * 0.1;")?;
                writeln!(text, "        {y} ~ Normal({name}, {scale});")?;
                writeln!(text, "    }}")?;
                self.scalars.push(name);
            }
            8 => {
                let (a, b, condition) = (self.number(1), self.number(1), self.number(0));
                let test = self.pick(&["flag", "!flag", "#c > 0.3"]).replace("#c", &condition);
                let name = self.name();
                writeln!(text, "    let {name} = if {test} {{ {a} }} else {{ {b} }};")?;
                self.scalars.push(name);
            }
            9 => {
                // sufficient statistics: one distribution for all data
                let (y, mean, scale) = (self.name(), self.number(1), self.scale());
                writeln!(
                    text,
                    "    for {y} in ys {{\n        {y} ~ Normal({mean}, {scale});\n    }}"
                )?;
            }
            _ => {
                let formula = self.number(1);
                writeln!(text, "    if flag {{ factor({formula}.tanh()); }}")?;
            }
        }
        Ok(())
    }
}
