//! Convergence of Hertzian contact: a rigid ball is pressed onto an elastic block.
//!
//! ```text
//! cargo bench -p fem --bench contact [-- ELEMENTS…]
//! ```
//!
//! `ELEMENTS` are the numbers of elements across the contact radius (default 4 6 8). For each number and each element
//! order, a line shows the contact radius and the largest pressure, computed from the nodal pressures, and their
//! differences in % from Hertz's theory: a = (3FR/(4E*))^(1/3) and p₀ = 3F/(2πa²) with the computed force F.

#[path = "../tests/support/block.rs"]
mod block;
#[path = "../tests/support/hertz.rs"]
mod hertz;

use std::time::Instant;

use fem::Order;

fn main() {
    let requested: Vec<usize> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .filter_map(|a| a.parse().ok())
        .collect();
    let across = if requested.is_empty() { vec![4, 6, 8] } else { requested };
    println!("order      over a    tets   a (mm)  off (%)  p0 (MPa)  off (%)   F (N)  seconds");
    for order in [Order::Linear, Order::Quadratic] {
        for &n in &across {
            let begin = Instant::now();
            let result = hertz::hertz(n, order);
            println!(
                "{:9} {n:7} {:7} {:8.4} {:8.2} {:9.3} {:8.2} {:7.2} {:8.1}",
                format!("{order:?}"),
                result.tets,
                result.radius_mm,
                100.0 * (result.radius_mm / result.exact_radius_mm - 1.0),
                result.pressure_mpa,
                100.0 * (result.pressure_mpa / result.exact_pressure_mpa - 1.0),
                result.force_n,
                begin.elapsed().as_secs_f64(),
            );
        }
    }
}
