//! Errors against manufactured solutions on a series of meshes.
//!
//! ```text
//! cargo bench -p fem --bench manufactured [-- CELLS…]
//! ```
//!
//! Each mesh has n³ cells of six tetrahedra; `CELLS` are the numbers n (default 2 4 8 12). Finite-strain elasticity and
//! elasticity with damage are solved with linear and quadratic elements. Each line contains the L² and H¹ errors, and
//! the order of convergence from the previous line to this line.

#[path = "../tests/support/block.rs"]
mod block;
#[path = "../tests/support/manufactured.rs"]
mod manufactured;

use fem::Order;
use manufactured::{errors, order};

fn main() {
    let requested: Vec<usize> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .filter_map(|a| a.parse().ok())
        .collect();
    let cells = if requested.is_empty() { vec![2, 4, 8, 12] } else { requested };
    for damaged in [false, true] {
        for element in [Order::Linear, Order::Quadratic] {
            let what = if damaged { "with damage" } else { "elastic" };
            println!(
                "{element:?}, {what}: cells, then error (order) of u in L2, H1, of phi in L2, H1"
            );
            let mut before: Option<(usize, [f64; 4])> = None;
            for &n in &cells {
                let errors = errors(n, element, damaged);
                let [a, b] = errors.displacement;
                let [c, d] = errors.damage;
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
