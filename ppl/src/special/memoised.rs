//! Memoisation of functions of one shape parameter.

/// Evaluates `$f($x)`, or returns the last result of this thread if `$x` is unchanged.
///
/// In a loop over observations, the distributions usually have the same shape parameter, and the compiler does not
/// move the evaluation of gamma functions out of the loop.
macro_rules! memoised {
    ($f:expr, $x:expr) => {{
        std::thread_local! {
            // NaN differs from every number, so that the first call evaluates the function
            static LAST: std::cell::Cell<(f64, [f64; 2])> = const {
                std::cell::Cell::new((f64::NAN, [0.0; 2]))
            };
        }
        let x: f64 = $x;
        let (last, value) = LAST.get();
        if last == x {
            value
        } else {
            let value = $f(x);
            LAST.set((x, value));
            value
        }
    }};
}
pub(crate) use memoised;

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_remembered_is_what_was_asked_for() {
        let mut calls = 0;
        let mut twice = |x: f64| {
            memoised!(
                |x: f64| {
                    calls += 1;
                    [2.0 * x, x]
                },
                x
            )[0]
        };
        assert_eq!([1.0, 1.0, 3.0, 1.0, 1.0].map(&mut twice), [2.0, 2.0, 6.0, 2.0, 2.0]);
        assert!(twice(f64::NAN).is_nan());
        assert_eq!(twice(1.0), 2.0);
        assert_eq!(calls, 5);
    }
}
