//! Ticks of axes at round numbers, with the number of digits that their step needs.

use std::sync::Arc;

use kuva::prelude::*;
use kuva::render::layout::ComputedLayout;

/// Labels have an exponent if the largest value is at least `LARGE` or the step is below `SMALL`.
const LARGE: f64 = 1e6;
const SMALL: f64 = 1e-4;

/// Sets ticks of a layout at multiples of 1, 2 or 5 times a power of ten on each linear axis.
pub(super) fn with_round_ticks(layout: Layout) -> Layout {
    let computed = ComputedLayout::from_layout(&layout);
    let mut layout = layout;
    if !layout.log_x
        && layout.x_categories.is_none()
        && let Some(axis) = Axis::over(computed.x_range, computed.x_ticks)
    {
        layout = layout.with_x_tick_step(axis.step).with_x_tick_format(axis.format());
    }
    if !layout.log_y
        && layout.y_categories.is_none()
        && let Some(axis) = Axis::over(computed.y_range, computed.y_ticks)
    {
        layout = layout.with_y_tick_step(axis.step).with_y_tick_format(axis.format());
    }
    layout
}

/// The ticks of one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    step: f64,
    /// Largest absolute value on the axis.
    largest: f64,
}

impl Axis {
    /// Approximately `count` ticks over a range; `None` if the range is empty.
    fn over((low, high): (f64, f64), count: usize) -> Option<Self> {
        let rough = (high - low) / count.max(1) as f64;
        if !(rough.is_finite() && rough > 0.0) {
            return None;
        }
        let power = 10_f64.powi(rough.log10().floor() as i32);
        let step = match rough / power {
            // the limits between two step sizes are their geometric means
            part if part < 2.0_f64.sqrt() => power,
            part if part < 10.0_f64.sqrt() => 2.0 * power,
            part if part < 50.0_f64.sqrt() => 5.0 * power,
            _ => 10.0 * power,
        };
        Some(Self { step, largest: low.abs().max(high.abs()) })
    }

    fn format(self) -> TickFormat {
        TickFormat::Custom(Arc::new(move |value| self.label(value)))
    }

    fn label(&self, value: f64) -> String {
        let power = |x: f64| (x.log10() + 1e-9).floor() as i32;
        let exponent = match self.largest >= LARGE || self.step < SMALL {
            true => power(self.largest),
            false => 0,
        };
        let decimals = usize::try_from(exponent - power(self.step)).unwrap_or(0);
        let value = value / 10_f64.powi(exponent);
        // prevents the label -0
        let value = if value.abs() < 0.5 * 10_f64.powi(-(decimals as i32)) { 0.0 } else { value };
        match exponent {
            0 => format!("{value:.decimals$}"),
            _ if value == 0.0 => "0".to_owned(),
            _ => format!("{value:.decimals$}e{exponent}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For all ranges, the numbers in the labels are equally spaced, as the ticks are, and no two
    /// labels are equal.
    #[test]
    fn equal_steps_read_as_equal_steps() {
        for (low, high) in [
            (0.0, 1.0),
            (0.0831, 0.1612),
            (941.0, 2080.0),
            (-0.02, 0.013),
            (1e-6, 5e-6),
            (2.71e7, 3.14e7),
            (0.999, 1.0004),
            (-3.0, 250.0),
        ] {
            for count in [3, 4, 5, 8] {
                let axis = Axis::over((low, high), count).unwrap();
                let ticks = (high - low) / axis.step;
                assert!(ticks > 0.6 * count as f64 - 1.0 && ticks < 1.5 * count as f64 + 1.0);
                let first = (low / axis.step).ceil() as i64;
                let last = (high / axis.step).floor() as i64;
                for k in first..=last {
                    let label = axis.label(k as f64 * axis.step);
                    let read: f64 = label.parse().unwrap();
                    let error = (read - k as f64 * axis.step).abs();
                    assert!(error < 1e-6 * axis.step, "{label} at {k} × {}", axis.step);
                    assert!(!label.starts_with("-0") || read != 0.0, "{label}");
                }
            }
        }
        assert!(Axis::over((1.0, 1.0), 4).is_none());
    }
}
