//! Storage of user-defined objects, such as laws, whose methods are generic over the number type. An object is
//! stored as several trait objects: one for each number type with which the crate computes.

use std::any::Any;
use std::fmt::{Debug, Formatter, Result};
use std::sync::Arc;

use faer::traits::pulp;
use num_dual::{Dual64, HyperDual64};

use super::recording::Term;
use super::scalar::Scalar;
use super::simd::SimdF64;

/// A kind of user-defined objects, such as elastic laws. `Over<T>` is the object-safe trait of this kind for the
/// number type `T`.
pub(crate) trait Family: 'static {
    type Over<T: Scalar>: ?Sized + Debug + Send + Sync + 'static;
}

/// An object of a family. It can be converted to a trait object for every number type.
pub(crate) trait MemberOf<F: Family>: Send + Sync + 'static {
    fn over<T: Scalar>(self: Arc<Self>) -> Arc<F::Over<T>>;
}

/// A user-defined object, stored as one trait object for each number type with which the crate
/// computes.
///
/// Clones share the object. Two values are equal if they share the object. [`Debug`] formats the object.
pub(crate) struct OverScalars<F: Family> {
    single: Arc<F::Over<f64>>,
    dual: Arc<F::Over<Dual64>>,
    hyper_dual: Arc<F::Over<HyperDual64>>,
    recorded: Arc<F::Over<Term>>,
    narrow: Arc<F::Over<SimdF64<pulp::Scalar>>>,
    #[cfg(target_arch = "x86_64")]
    wide: Arc<F::Over<SimdF64<pulp::x86::V3>>>,
    #[cfg(target_arch = "aarch64")]
    wide: Arc<F::Over<SimdF64<pulp::aarch64::Neon>>>,
}

impl<F: Family> OverScalars<F> {
    pub(crate) fn new(object: impl MemberOf<F>) -> Self {
        let object = Arc::new(object);
        Self {
            single: Arc::clone(&object).over(),
            dual: Arc::clone(&object).over(),
            hyper_dual: Arc::clone(&object).over(),
            recorded: Arc::clone(&object).over(),
            narrow: Arc::clone(&object).over(),
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            wide: object.over(),
        }
    }

    /// Returns the object for the number type `f64`.
    pub(crate) fn single(&self) -> &F::Over<f64> {
        &self.single
    }

    /// Returns the object for the number type `T`.
    ///
    /// # Panics
    /// If the crate does not compute with this number type. The supported SIMD types are the types that
    /// [`dispatch`](super::dispatch) selects.
    #[inline(always)]
    pub(crate) fn over<T: Scalar>(&self) -> &F::Over<T> {
        let all: [&dyn Any; _] = [
            &self.single,
            &self.dual,
            &self.hyper_dual,
            &self.recorded,
            &self.narrow,
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            &self.wide,
        ];
        for view in all {
            if let Some(view) = view.downcast_ref::<Arc<F::Over<T>>>() {
                return view;
            }
        }
        unreachable!("the crate does not compute with {}", std::any::type_name::<T>())
    }
}

impl<F: Family> Clone for OverScalars<F> {
    fn clone(&self) -> Self {
        Self {
            single: Arc::clone(&self.single),
            dual: Arc::clone(&self.dual),
            hyper_dual: Arc::clone(&self.hyper_dual),
            recorded: Arc::clone(&self.recorded),
            narrow: Arc::clone(&self.narrow),
            #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
            wide: Arc::clone(&self.wide),
        }
    }
}

impl<F: Family> PartialEq for OverScalars<F> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(Arc::as_ptr(&self.single), Arc::as_ptr(&other.single))
    }
}

impl<F: Family> Debug for OverScalars<F> {
    fn fmt(&self, f: &mut Formatter) -> Result {
        self.single.fmt(f)
    }
}
