//! Conversions of values: from data to the value types of distributions, and from values to plain numbers for
//! records.

/// A value on which a statement `place ~ D` can condition, convertible to the value type of `D`.
///
/// Implemented for data (`f64`, counts, flags), unknowns, and arrays, slices and vectors of data or
/// unknowns.
///
/// A datum of a scalar type is also a linear form: its value, with its derivatives with respect to the scalars on which
/// it depends. Formulas, linear predictors and intercepts of regressions are such data.
#[diagnostic::on_unimplemented(
    message = "`{Self}` fits neither the values nor the parameters of this distribution",
    label = "expected a value that can be converted to `{V}`",
    note = "numbers are `f64` (write `1.0`, not `1`), counts are `u64` (`1u64`, or `k as u64` of a number), \
            flags are `bool` (`x != 0.0`); arrays, slices and vectors of these are allowed too",
    note = "a univariate distribution does not accept arrays: write a loop over the entries, or \
            `.array::<N>()` for independent values of the same distribution"
)]
// The hidden items are in this trait and not in a supertrait: for data of a wrong type, the compiler would report the
// supertrait, and the messages above would not appear.
pub trait Datum<V> {
    /// Whether the value does not depend on unknowns.
    #[doc(hidden)]
    const CONSTANT: bool = false;

    /// Whether the value is the same in every iteration of the surrounding plate (a `for` loop of the model).
    #[doc(hidden)]
    const SHARED: bool = false;

    /// Largest number of scalars on which the value depends; `usize::MAX` if the type does not determine the number.
    #[doc(hidden)]
    const NUMBERS: usize = usize::MAX;

    /// Converts the datum to the value at which the density is evaluated.
    fn lift(&self) -> V;

    /// Calls `f(scalar, weight · ∂value/∂scalar)` for each scalar on which the value depends. `f` is not called for a
    /// constant.
    #[doc(hidden)]
    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(V, f64)) {
        f(self.lift(), weight);
    }

    /// Version of [`spread`](Datum::spread) for final weights, which no further factor multiplies. An implementation
    /// that stores the sum of its adjoint can add the weights to this sum instead of calling `f`.
    #[doc(hidden)]
    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(V, f64)) {
        self.spread(weight, f);
    }
}

macro_rules! impl_count_datum {
    ($($Count:ty),*) => {$(
        impl Datum<u64> for $Count {
            #[inline(always)]
            fn lift(&self) -> u64 {
                u64::from(*self)
            }
        }
    )*};
}
impl_count_datum!(u8, u16, u32, u64);

impl Datum<u64> for usize {
    #[inline(always)]
    fn lift(&self) -> u64 {
        *self as u64
    }
}

impl Datum<bool> for bool {
    #[inline(always)]
    fn lift(&self) -> bool {
        *self
    }
}

impl<V, T: Datum<V> + ?Sized> Datum<V> for &T {
    const CONSTANT: bool = T::CONSTANT;
    const SHARED: bool = T::SHARED;
    const NUMBERS: usize = T::NUMBERS;

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(V, f64)) {
        (**self).spread(weight, f);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(V, f64)) {
        (**self).settle(weight, f);
    }

    #[inline(always)]
    fn lift(&self) -> V {
        (**self).lift()
    }
}

impl<V, T: Datum<V>, const N: usize> Datum<[V; N]> for [T; N] {
    #[inline(always)]
    fn lift(&self) -> [V; N] {
        std::array::from_fn(|i| self[i].lift())
    }
}

impl<V, T: Datum<V>> Datum<Vec<V>> for [T] {
    fn lift(&self) -> Vec<V> {
        self.iter().map(Datum::lift).collect()
    }
}

impl<V, T: Datum<V>> Datum<Vec<V>> for Vec<T> {
    fn lift(&self) -> Vec<V> {
        self.as_slice().lift()
    }
}

/// A datum that can be missing, for statements `place.impute() ~ D`. A missing datum becomes an unknown.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is never missing, or does not fit the values of this distribution",
    label = "expected an `Option` of a value that can be converted to `{V}`",
    note = "observe complete data without `.impute()`"
)]
pub trait Incomplete<V> {
    /// The datum, converted to the value at which the density is evaluated; `None` if it is missing.
    fn observed_value(&self) -> Option<V>;
}

impl<V, T: Datum<V>> Incomplete<V> for Option<T> {
    #[inline]
    fn observed_value(&self) -> Option<V> {
        self.as_ref().map(Datum::lift)
    }
}

impl<V, T: Incomplete<V> + ?Sized> Incomplete<V> for &T {
    #[inline]
    fn observed_value(&self) -> Option<V> {
        (**self).observed_value()
    }
}

/// A value with a shape that can be recorded as plain numbers.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be recorded",
    note = "numbers, arrays, vectors and Cholesky factors can be recorded"
)]
pub trait Recordable {
    /// Dimensions of the value; empty for a scalar.
    fn shape(&self) -> Vec<usize>;

    /// Appends the elements in row-major order.
    fn flatten(&self, out: &mut Vec<f64>);

    /// Overwrites the elements with the given numbers, one per element. Returns false if this type cannot be
    /// overwritten.
    #[doc(hidden)]
    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        let _ = elements;
        false
    }
}

/// Implements [`Recordable`] for scalar types: `impl_number_record! { [generics] Type: self => value as f64; }`.
macro_rules! impl_number_record {
    ($([$($generics:tt)*] $Number:ty: $self:ident => $value:expr;)*) => {$(
        impl<$($generics)*> $crate::quantity::datum::Recordable for $Number {
            fn shape(&self) -> Vec<usize> {
                Vec::new()
            }
            fn flatten(&$self, out: &mut Vec<f64>) {
                out.push($value);
            }
        }
    )*};
}
pub(crate) use impl_number_record;

impl_number_record! {
    [] f64: self => *self;
    [] u64: self => *self as f64;
    [] bool: self => f64::from(u8::from(*self));
}

impl<T: Recordable + ?Sized> Recordable for &T {
    fn shape(&self) -> Vec<usize> {
        (**self).shape()
    }
    fn flatten(&self, out: &mut Vec<f64>) {
        (**self).flatten(out);
    }
}

/// Returns the shape of an array of `len` values, each of which has the given shape.
fn stacked(len: usize, mut shape: Vec<usize>) -> Vec<usize> {
    shape.insert(0, len);
    shape
}

impl<T: Recordable> Recordable for [T] {
    fn shape(&self) -> Vec<usize> {
        stacked(self.len(), self.first().map_or_else(Vec::new, Recordable::shape))
    }
    fn flatten(&self, out: &mut Vec<f64>) {
        for x in self {
            x.flatten(out);
        }
    }
    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        self.iter_mut().all(|x| x.overwrite(elements))
    }
}

impl<T: Recordable, const N: usize> Recordable for [T; N] {
    fn shape(&self) -> Vec<usize> {
        self.as_slice().shape()
    }
    fn flatten(&self, out: &mut Vec<f64>) {
        self.as_slice().flatten(out);
    }
    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        self.as_mut_slice().overwrite(elements)
    }
}

impl<T: Recordable> Recordable for Vec<T> {
    fn shape(&self) -> Vec<usize> {
        self.as_slice().shape()
    }
    fn flatten(&self, out: &mut Vec<f64>) {
        self.as_slice().flatten(out);
    }
    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        self.as_mut_slice().overwrite(elements)
    }
}
