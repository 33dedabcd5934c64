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
    /// A hold of the displacement in the load program.
    Hold,
    /// A hold of the force in the load program.
    ForceHold,
    /// The first unloading of the load program, and the curve before it.
    Unloading,
}
