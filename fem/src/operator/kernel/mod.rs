//! Equations of one element, for any number type: single numbers, SIMD lanes of several elements, dual numbers, and
//! recorded terms.
//!
//! Residual and linearisation work in the element's barycentric coordinates. With U_k = ∂u/∂λ_k − ∂u/∂λ₀ (k = 1 … 3)
//! the displacement gradient is H = Σ_k U_k ⊗ ∇λ_k for linear and quadratic elements. The force that is conjugate to
//! U_k, called flux, is distributed to node a with the weight ∂U_k/∂u_a. In a curved element ∇λ_k varies between the
//! points. A region without damage has η = 1 and zero toughness. In a mixture only the matrix is damaged, so that the
//! energy is not linear in g.
//!
//! A new term of the energy must be added to `residual.rs` and `linearise.rs`. If it adds data of an elastic point, it
//! must also be added to `point_data.rs` and `contract.rs`.

mod blocks;
mod configurational;
mod contract;
mod linearise;
mod point_data;
mod residual;
mod state;
mod stresses;

pub(super) use blocks::diagonal;
pub use blocks::{Blocks, write_blocks};
pub(super) use configurational::configurational;
pub(super) use contract::{Contraction, Load, first_or_add};
pub use linearise::linearise;
pub use point_data::DataLayout;
pub use residual::{ElementResidual, residual};
pub use state::{Constants, ElementState, MOST_POINTS};
pub(super) use stresses::{STRESS_SUMS, stress_sums};
