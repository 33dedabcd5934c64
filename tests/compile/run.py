#!/usr/bin/env python3
"""Measures the processor time and the elapsed time that a model adds to the compilation of a user's crate.

Three crates are compiled with the same, already compiled `ppl`: one samples a density written by hand,
one samples a model of 20 lines, and one is empty. Prints CSV
`profile,crate,processor_s,clock_s`; each time is the least of three.

    python3 tests/compile/run.py
"""

import os
import pathlib
import resource
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

EMPTY = "fn main() {}\n"

DENSITY = """
use ppl::{LogDensity, Nuts, Rejection};

struct Normal;

impl LogDensity for Normal {
    type Workspace = ();
    fn dim(&self) -> usize {
        1
    }
    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-0.5 * y[0] * y[0])
    }
    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = -y[0];
        self.log_density(y, w)
    }
}

fn main() {
    let chains = Nuts::default().run(&Normal).unwrap();
    println!("{}", chains.chains[0].draws[0]);
}
"""

MODEL = """
use ppl::prelude::*;

ppl::model! {
    fn radon(counties: usize, county: &[usize], floor: &[f64], uranium: &[f64], y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(1.0);
        let sd ~ HalfNormal(1.0);
        let slope ~ Normal(0.0, 10.0);
        let uranium_slope ~ Normal(0.0, 10.0);
        let z ~ Normal(0.0, 1.0).iid(counties);
        for i in 0..y.len() {
            let level = mu + tau * z[county[i]];
            let mean = level + slope * floor[i] + uranium_slope * uranium[i];
            y[i] ~ Normal(mean, sd);
        }
        #[track] let ratio = tau / sd;
        #[track] let first = mu + tau * z[0];
        #[predict] let next ~ Normal(mu, sd);
    }
}

fn main() {
    let model = radon(2, &[0, 1, 1], &[0.0, 1.0, 1.0], &[0.1, 0.2, 0.3], &[1.0, 2.0, 3.0]);
    let posterior = Nuts::default().seed(7).sample(&model).unwrap();
    println!("{}", posterior.summary());
}
"""

MANIFEST = """
[package]
name = "user"
version = "0.1.0"
edition = "2024"

[dependencies]
ppl = {{ path = {path!r} }}

[workspace]
"""


def spent():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main():
    print("profile,crate,processor_s,clock_s")
    with tempfile.TemporaryDirectory() as folder:
        crate = pathlib.Path(folder)
        (crate / "src").mkdir()
        (crate / "Cargo.toml").write_text(MANIFEST.format(path=str(ROOT / "ppl")))
        (crate / "Cargo.lock").write_text((ROOT / "Cargo.lock").read_text())
        environment = dict(os.environ, CARGO_INCREMENTAL="0")
        environment["CARGO_TARGET_DIR"] = str(ROOT / "target" / "compile-study")

        def build(profile, text):
            (crate / "src" / "main.rs").write_text(text)
            before, start = spent(), time.perf_counter()
            command = ["cargo", "build", "--quiet", "--profile", profile]
            subprocess.run(command, cwd=crate, env=environment, check=True)
            return spent() - before, time.perf_counter() - start

        for profile in ["dev", "release"]:
            build(profile, EMPTY)
            for name, text in [("empty", EMPTY), ("density", DENSITY), ("model", MODEL)]:
                builds = [build(profile, f"// {number}\n{text}") for number in range(3)]
                processor, clock = map(min, zip(*builds))
                print(f"{profile},{name},{processor:.2f},{clock:.2f}", flush=True)


if __name__ == "__main__":
    main()
