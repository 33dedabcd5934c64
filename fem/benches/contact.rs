//! A rigid ball on an elastic block, refined towards Hertz's theory.
//!
//! `cargo bench -p fem --bench contact [-- ELEMENTS…]` presses the ball with the given
//! numbers of elements over the contact radius (default 4 6 8) and prints a line each: contact radius
//! and largest pressure from the nodal pressures, against a = (3FR/(4E*))^(1/3) and p₀ = 3F/(2πa²)
//! for the force found.

#[path = "../tests/support/block.rs"]
mod block;
#[path = "../tests/support/hertz.rs"]
mod hertz;

use std::time::Instant;

use fem::Order;

fn main() {
    let asked: Vec<usize> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .filter_map(|a| a.parse().ok())
        .collect();
    let across = if asked.is_empty() { vec![4, 6, 8] } else { asked };
    println!("order      over a    tets   a (mm)  off (%)  p0 (MPa)  off (%)   F (N)  seconds");
    for order in [Order::Linear, Order::Quadratic] {
        for &n in &across {
            let begin = Instant::now();
            let found = hertz::hertz(n, order);
            println!(
                "{:9} {n:7} {:7} {:8.4} {:8.2} {:9.3} {:8.2} {:7.2} {:8.1}",
                format!("{order:?}"),
                found.tets,
                found.radius_mm,
                100.0 * (found.radius_mm / found.exact_radius_mm - 1.0),
                found.pressure_mpa,
                100.0 * (found.pressure_mpa / found.exact_pressure_mpa - 1.0),
                found.force_n,
                begin.elapsed().as_secs_f64(),
            );
        }
    }
}
