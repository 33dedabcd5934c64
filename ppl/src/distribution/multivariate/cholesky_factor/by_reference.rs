//! Distributions with factors behind references.

/// A distribution over arrays or factors, for a factor that is seen behind a reference, as data
/// of a model are: `by_reference!(Name<parameters before the factor>(their fields), its field)`.
macro_rules! by_reference {
    ($Name:ident<$($P:ident),*>($($field:tt),*), $factor:tt) => {
        impl<$($P: Clone,)* T: Copy, const K: usize>
            $Name<$($P,)* &$crate::distribution::multivariate::CholeskyFactor<T, K>>
        {
            #[inline]
            fn owned(&self) -> $Name<$($P,)* $crate::distribution::multivariate::CholeskyFactor<T, K>> {
                $Name($(self.$field.clone(),)* *self.$factor)
            }
        }

        impl<R, $($P,)* T, const K: usize> $crate::distribution::Distribution<R>
            for $Name<$($P,)* &$crate::distribution::multivariate::CholeskyFactor<T, K>>
        where
            R: $crate::Scalar,
            T: Copy,
            $($P: Clone,)*
            Self: $crate::distribution::Family,
            $Name<$($P,)* $crate::distribution::multivariate::CholeskyFactor<T, K>>:
                $crate::distribution::Distribution<R>,
        {
            type Value = <$Name<$($P,)* $crate::distribution::multivariate::CholeskyFactor<T, K>> as
                $crate::distribution::Distribution<R>>::Value;

            #[inline]
            fn ln_density(&self, x: &Self::Value) -> R {
                self.owned().ln_density(x)
            }

            #[inline]
            fn add_terms(&self, x: &Self::Value, terms: &mut impl $crate::terms::Terms<R>) {
                self.owned().add_terms(x, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::distribution::Distribution::<R>::validate(&self.owned())
            }

            fn draw<G: rand::Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
                self.owned().draw(rng)
            }
        }

        impl<R, $($P,)* T, const K: usize> $crate::distribution::Unknown<R>
            for $Name<$($P,)* &$crate::distribution::multivariate::CholeskyFactor<T, K>>
        where
            R: $crate::Scalar,
            T: Copy,
            $($P: Clone,)*
            Self: $crate::distribution::Family,
            $Name<$($P,)* $crate::distribution::multivariate::CholeskyFactor<T, K>>:
                $crate::distribution::Unknown<R>,
        {
            fn dim(&self) -> usize {
                $crate::distribution::Unknown::<R>::dim(&self.owned())
            }

            #[inline]
            fn constrain(
                &self,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::terms::Terms<R>,
            ) -> Self::Value {
                self.owned().constrain(next, jacobian, terms)
            }

            fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
                self.owned().unconstrain(x, out);
            }
        }
    };
}
pub(crate) use by_reference;
