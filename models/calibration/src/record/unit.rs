//! Units of force, displacement, time, stress and strain.

/// Physical dimension of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    Length,
    Force,
    Time,
    Stress,
    Strain,
}

/// Units: names, physical dimension, and factor to mm, N, s, MPa or 1.
const UNITS: [(&[&str], Dimension, f64); 27] = [
    (&["mm", "millimeter", "millimetre"], Dimension::Length, 1.0),
    (&["µm", "μm", "um", "micron", "microns"], Dimension::Length, 1e-3),
    (&["cm"], Dimension::Length, 10.0),
    (&["m"], Dimension::Length, 1e3),
    (&["in", "inch", "inches", "\""], Dimension::Length, 25.4),
    (&["mil", "mils", "thou"], Dimension::Length, 0.0254),
    (&["N", "newton"], Dimension::Force, 1.0),
    (&["mN"], Dimension::Force, 1e-3),
    (&["daN"], Dimension::Force, 10.0),
    (&["kN"], Dimension::Force, 1e3),
    (&["MN"], Dimension::Force, 1e6),
    (&["kgf", "kp", "kg"], Dimension::Force, 9.806_65),
    (&["gf"], Dimension::Force, 9.806_65e-3),
    (&["lbf", "lb", "lbs"], Dimension::Force, 4.448_221_615_260_5),
    (&["kip", "klbf"], Dimension::Force, 4_448.221_615_260_5),
    (
        &["s", "sec", "secs", "second", "seconds", "sek", "sekunden", "secondes"],
        Dimension::Time,
        1.0,
    ),
    (&["ms"], Dimension::Time, 1e-3),
    (&["min", "minute", "minutes", "minuten"], Dimension::Time, 60.0),
    (&["h", "hr", "hour", "hours", "stunden"], Dimension::Time, 3600.0),
    (&["Pa"], Dimension::Stress, 1e-6),
    (&["kPa"], Dimension::Stress, 1e-3),
    (&["MPa", "N/mm²", "N/mm2", "N/mm^2"], Dimension::Stress, 1.0),
    (&["GPa", "kN/mm²", "kN/mm2"], Dimension::Stress, 1e3),
    (&["psi"], Dimension::Stress, 6.894_757_293_168e-3),
    (&["ksi"], Dimension::Stress, 6.894_757_293_168),
    (&["%", "percent"], Dimension::Strain, 0.01),
    (&["1", "-", "mm/mm", "in/in", "m/m"], Dimension::Strain, 1.0),
];

/// Unit of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unit {
    /// Name as written in the file.
    pub(super) name: String,
    pub(super) dimension: Dimension,
    /// Factor to mm, N, s, MPa or 1.
    pub(super) factor: f64,
}

impl Unit {
    /// Finds the unit with this name, with or without brackets. If no name matches exactly, the case of letters is
    /// ignored, provided that only one unit matches.
    pub(super) fn named(name: &str) -> Option<Self> {
        let bare = name.trim().trim_matches(['(', ')', '[', ']', '{', '}', '<', '>']).trim();
        let matching = |is_same: &dyn Fn(&str) -> bool| {
            let mut units = UNITS.iter().filter(|(names, ..)| names.iter().any(|n| is_same(n)));
            units.next().filter(|_| units.next().is_none())
        };
        let exact = matching(&|name| name == bare);
        let (_, dimension, factor) =
            exact.or_else(|| matching(&|name| name.eq_ignore_ascii_case(bare)))?;
        Some(Self { name: bare.to_owned(), dimension: *dimension, factor: *factor })
    }
}

impl Dimension {
    /// Lists one name of each unit of the dimension.
    pub(super) fn units(self) -> String {
        let of_dimension = UNITS.iter().filter(|(_, dimension, _)| *dimension == self);
        of_dimension.map(|(names, ..)| names[0]).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_with_brackets_and_in_either_case() {
        for (name, dimension, factor) in [
            ("(kN)", Dimension::Force, 1000.0),
            ("[KN]", Dimension::Force, 1000.0),
            ("mN", Dimension::Force, 0.001),
            ("MN", Dimension::Force, 1e6),
            (" lbf ", Dimension::Force, 4.448_221_615_260_5),
            ("MM", Dimension::Length, 1.0),
            ("µm", Dimension::Length, 0.001),
            ("(Sec)", Dimension::Time, 1.0),
            ("MPA", Dimension::Stress, 1.0),
            ("%", Dimension::Strain, 0.01),
        ] {
            let unit = Unit::named(name).unwrap();
            assert_eq!((unit.dimension, unit.factor), (dimension, factor), "{name}");
        }
        // ambiguous: millinewton or meganewton
        assert_eq!(Unit::named("Mn"), None);
        assert_eq!(Unit::named("furlong"), None);
        assert_eq!(Unit::named(""), None);
    }
}
