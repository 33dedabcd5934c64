//! Part of a curve from which a quantity of interest is computed.

/// Part of a curve from which a quantity is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// The curve up to and around its peak.
    ToPeak,
    /// The curve up to this multiple of the displacement at peak.
    Fraction(f64),
    /// The curve up to this displacement in mm.
    Displacement(f64),
    /// The curve up to this time in s.
    Time(f64),
    /// Holds of the displacement in the load program, at least this many.
    Hold(u32),
    /// A hold of the force in the load program.
    ForceHold,
    /// The unloading of the load program with this number, from 1, and the curve before it.
    Unloading(u32),
}
