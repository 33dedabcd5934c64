//! Number type of a voxel, and conversion of bytes to numbers.

use std::fmt::{self, Display};

/// Whether the bits of a value represent an unsigned, a signed or a floating-point number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberKind {
    Unsigned,
    Signed,
    Float,
}

/// Number type of the values of a stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SampleType {
    pub(crate) kind: NumberKind,
    /// Bits of one value: 8, 16, 32 or 64.
    pub(crate) bits: u8,
}

impl SampleType {
    pub(crate) const fn unsigned(bits: u8) -> Self {
        Self { kind: NumberKind::Unsigned, bits }
    }

    /// Returns the size of one value (bytes).
    pub(crate) fn bytes(self) -> usize {
        usize::from(self.bits / 8)
    }
}

impl Display for SampleType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            NumberKind::Unsigned => "unsigned integers",
            NumberKind::Signed => "signed integers",
            NumberKind::Float => "floating-point numbers",
        };
        write!(f, "{}-bit {kind}", self.bits)
    }
}

/// Byte order of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

/// Converts bytes to numbers until `into` is full; further bytes are ignored.
pub(crate) fn decode(bytes: &[u8], sample: SampleType, order: ByteOrder, into: &mut [f64]) {
    fn each<const N: usize>(
        bytes: &[u8],
        order: ByteOrder,
        into: &mut [f64],
        number: impl Fn([u8; N]) -> f64,
    ) {
        for (value, bytes) in into.iter_mut().zip(bytes.chunks_exact(N)) {
            let mut ordered: [u8; N] = bytes.try_into().expect("chunks have N bytes");
            if order == ByteOrder::Big {
                ordered.reverse();
            }
            *value = number(ordered);
        }
    }
    use NumberKind::{Float, Signed, Unsigned};
    match (sample.kind, sample.bits) {
        (Unsigned, 8) => each(bytes, order, into, |b: [u8; 1]| f64::from(b[0])),
        (Unsigned, 16) => each(bytes, order, into, |b| f64::from(u16::from_le_bytes(b))),
        (Unsigned, 32) => each(bytes, order, into, |b| f64::from(u32::from_le_bytes(b))),
        (Unsigned, _) => each(bytes, order, into, |b| u64::from_le_bytes(b) as f64),
        (Signed, 8) => each(bytes, order, into, |b| f64::from(i8::from_le_bytes(b))),
        (Signed, 16) => each(bytes, order, into, |b| f64::from(i16::from_le_bytes(b))),
        (Signed, 32) => each(bytes, order, into, |b| f64::from(i32::from_le_bytes(b))),
        (Signed, _) => each(bytes, order, into, |b| i64::from_le_bytes(b) as f64),
        (Float, 32) => each(bytes, order, into, |b| f64::from(f32::from_le_bytes(b))),
        (Float, _) => each(bytes, order, into, f64::from_le_bytes),
    }
}
