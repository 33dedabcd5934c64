//! Functions of position and time.

use std::fmt;
use std::sync::Arc;

/// Function of reference position (mm) and time (s).
pub(crate) struct Function<T>(Arc<dyn Fn([f64; 3], f64) -> T + Send + Sync>);

impl<T> Function<T> {
    pub(crate) fn new(f: impl Fn([f64; 3], f64) -> T + Send + Sync + 'static) -> Self {
        Self(Arc::new(f))
    }

    pub(crate) fn at(&self, position: [f64; 3], time_s: f64) -> T {
        (self.0)(position, time_s)
    }
}

impl<T> Clone for Function<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> fmt::Debug for Function<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("function of position and time")
    }
}
