//! Independent values of one distribution.

use super::array::Array;
use super::iid::Iid;
use crate::distribution::family::Family;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Recordable;

/// Independent values of one distribution, `.array::<N>()` or `.iid(n)`, to which [`ordered`](crate::Variations::ordered) applies.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not consist of independent values",
    label = "write `.array::<N>()` or `.iid(n)` first: `Normal(0.0, 1.0).array::<3>().ordered()`"
)]
pub trait Repeated<R: Scalar>: Family {
    /// Distribution of one value.
    type Element;

    /// Type of all values: an array or a `Vec`.
    type Values: Clone + Recordable + AsRef<[R]> + AsMut<[R]>;

    /// Distribution of one value.
    fn element(&self) -> &Self::Element;

    /// Number of values.
    fn size(&self) -> usize;

    /// Creates an array or a `Vec` of zeros with this number of values.
    fn zeros(&self) -> Self::Values;
}

impl<R: Scalar, D: Family, const N: usize> Repeated<R> for Array<D, N> {
    type Element = D;
    type Values = [R; N];

    fn element(&self) -> &D {
        &self.inner
    }

    fn size(&self) -> usize {
        N
    }

    fn zeros(&self) -> [R; N] {
        [R::from(0.0); N]
    }
}

impl<R: Scalar, D: Family> Repeated<R> for Iid<D> {
    type Element = D;
    type Values = Vec<R>;

    fn element(&self) -> &D {
        &self.inner
    }

    fn size(&self) -> usize {
        self.n
    }

    fn zeros(&self) -> Vec<R> {
        vec![R::from(0.0); self.n]
    }
}
