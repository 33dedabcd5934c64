//! Errors against manufactured solutions on a series of meshes.
//!
//! `cargo bench -p fem --bench manufactured [-- CELLS…]` solves on n³ cells of six
//! tetrahedra (default 2 4 8 12) for finite-strain elasticity and for elasticity with damage, with both
//! elements, and prints L² and H¹ errors with the order between neighbouring lines.

#[path = "../tests/support/block.rs"]
mod block;
#[path = "../tests/support/manufactured.rs"]
mod manufactured;

use fem::Order;
use manufactured::{errors, order};

fn main() {
    let asked: Vec<usize> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .filter_map(|a| a.parse().ok())
        .collect();
    let cells = if asked.is_empty() { vec![2, 4, 8, 12] } else { asked };
    for damaged in [false, true] {
        for element in [Order::Linear, Order::Quadratic] {
            let what = if damaged { "with damage" } else { "elastic" };
            println!(
                "{element:?}, {what}: cells, then error (order) of u in L2, H1, of phi in L2, H1"
            );
            let mut before: Option<(usize, [f64; 4])> = None;
            for &n in &cells {
                let found = errors(n, element, damaged);
                let [a, b] = found.displacement;
                let [c, d] = found.damage;
                let now = [a, b, c, d];
                let columns: Vec<String> = (0..if damaged { 4 } else { 2 })
                    .map(|k| match before {
                        Some((m, old)) => {
                            let p = order(old[k], now[k], n as f64 / m as f64);
                            format!("{:.3e} ({p:4.2})", now[k])
                        }
                        None => format!("{:.3e}       ", now[k]),
                    })
                    .collect();
                println!("{n:4}  {}", columns.join("  "));
                before = Some((n, now));
            }
        }
    }
}
