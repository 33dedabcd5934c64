//! Finds the peaks of many curves. `tests/python/peak_accuracy.py` runs this program.
//!
//! Standard input: number of readings n and number of curves as little-endian u64, then for each curve n
//! displacements in mm and n forces in N as little-endian f64. Standard output: one line per curve,
//! `displacement_at_peak_mm,peak_force_N`, or `error,` and the reason.

use std::io::{self, Read, Write};

use breccia_calibration::{Qois, TestCurve};

fn main() -> io::Result<()> {
    let mut input = io::stdin().lock();
    let mut output = io::stdout().lock();
    let mut word = [0; 8];
    let mut size = || -> io::Result<u64> {
        input.read_exact(&mut word)?;
        Ok(u64::from_le_bytes(word))
    };
    let (readings, curves) = (size()? as usize, size()?);
    for _ in 0..curves {
        let mut values = || -> io::Result<Vec<f64>> {
            let mut bytes = vec![0; 8 * readings];
            input.read_exact(&mut bytes)?;
            let words = bytes.chunks_exact(8).map(|word| word.try_into().unwrap_or_default());
            Ok(words.map(f64::from_le_bytes).collect())
        };
        let curve = TestCurve::new(values()?, values()?);
        match Qois::of(&curve, 0.3) {
            Ok(qois) => {
                writeln!(output, "{},{}", qois.displacement_at_peak_mm, qois.peak_force_n)?;
            }
            Err(error) => writeln!(output, "error,{error}")?,
        }
    }
    Ok(())
}
