//! Diagnostics of draws, against other programs, against closed forms and on artificial draws.

mod chains;
mod golden;
mod identifiability;
mod loo;
mod modes;
mod sensitivity;

/// Borrows every chain of an owned set.
fn borrow(chains: &[Vec<f64>]) -> Vec<&[f64]> {
    chains.iter().map(Vec::as_slice).collect()
}
