//! The marker of distributions.

/// A distribution, for which the variations of [`Variations`](crate::Variations) are available, such as
/// `.truncate(a..b)` and `.iid(n)`.
///
/// The macros [`univariate!`](crate::univariate!) and [`density!`](crate::density!) implement this trait for a
/// user-defined distribution.
pub trait Family: Sized + Clone {}
