//! Load program and conditions of a case in words, as `breccia check` prints them.

use crate::case::{
    ConditionsCase, LineCase, MeasureCase, PressureKind, ProgramPointCase, TimeTable,
};

/// Largest number of points of a load program or a table that are printed.
const MOST_POINTS: usize = 8;

/// Describes a load program by its first points. `steps` is the number of load steps of a segment that states none.
pub(crate) fn program_in_words(program: &[ProgramPointCase], steps: Option<u32>) -> String {
    let text = |point: &ProgramPointCase| {
        let load = match (point.force_n, point.displacement_mm) {
            (Some(force_n), _) => format!("{force_n} N"),
            (None, Some(displacement_mm)) => format!("{displacement_mm} mm"),
            (None, None) => "neither displacement_mm nor force_n".to_owned(),
        };
        let steps = point.steps.or(steps).map(|steps| format!(" in {steps} steps"));
        format!("{load} at {} s{}", point.time_s, steps.unwrap_or_default())
    };
    format!("load program: {}", first_of(program, text))
}

/// Describes the first elements of a list, and the number of the remaining elements.
fn first_of<T>(all: &[T], text: impl Fn(&T) -> String) -> String {
    let first: Vec<String> = all.iter().take(MOST_POINTS).map(text).collect();
    let rest = match all.len().saturating_sub(MOST_POINTS) {
        0 => String::new(),
        more => format!(", and {more} points more"),
    };
    format!("{}{rest}", first.join(", "))
}

/// Describes each condition in one line: surface, value at the end of the test, and the dependence on time.
pub(crate) fn conditions_in_words(conditions: &ConditionsCase, duration_s: f64) -> Vec<String> {
    let ConditionsCase { prescribe, symmetry, traction, pressure, table, .. } = conditions;
    let growth =
        |own: &Option<TimeTable>| growth_in_words(own.as_ref().or(table.as_ref()), duration_s);
    let mut lines = Vec::new();
    for (name, LineCase { from_mm, to_mm }) in &conditions.lines {
        lines.push(format!("{name}: line from {from_mm:?} to {to_mm:?} mm"));
    }
    for entry in prescribe {
        let components = ["x", "y", "z"].into_iter().zip([entry.x_mm, entry.y_mm, entry.z_mm]);
        let given: Vec<(&str, f64)> =
            components.filter_map(|(axis, value)| Some((axis, value?))).collect();
        let moves = given.iter().any(|(_, value)| *value != 0.0);
        let mut parts: Vec<String> =
            given.iter().map(|(axis, value)| format!("u{axis} = {value} mm")).collect();
        parts.extend(entry.damage.map(|damage| format!("damage {damage}")));
        let time = if moves { growth(&entry.table) } else { String::new() };
        lines.push(format!("{}: {}{time}", entry.surface, parts.join(", ")));
    }
    if !symmetry.is_empty() {
        lines.push(format!("{}: nodes stay in their plane (symmetry)", symmetry.join(", ")));
    }
    for entry in traction {
        let [x, y, z] = entry.vector_mpa;
        let time = growth(&entry.table);
        lines.push(format!("{}: dead load ({x}, {y}, {z}) MPa{time}", entry.surface));
    }
    for entry in pressure {
        let kind = match entry.kind {
            PressureKind::Follower => "normal to the deformed surface",
            PressureKind::Dead => "dead",
        };
        let (value, time) = (entry.pressure_mpa, growth(&entry.table));
        lines.push(format!("{}: pressure {value} MPa, {kind}{time}", entry.surface));
    }
    if let Some([x, y, z]) = conditions.body_force_n_per_mm3 {
        lines.push(format!("body force ({x}, {y}, {z}) N/mm³{}", growth(&None)));
    }
    if conditions.remove_rigid_motions {
        lines.push("single nodes are fixed against rigid motions".to_owned());
    }
    let MeasureCase { surface, direction: [x, y, z] } = &conditions.measure;
    let displacement = match &conditions.extensometer {
        Some(gauge) => {
            format!("displacement of {:?} mm relative to {:?} mm", gauge.to_mm, gauge.from_mm)
        }
        None => "its mean displacement".to_owned(),
    };
    lines.push(format!("measured: force on {surface} and {displacement}, along ({x}, {y}, {z})"));
    lines
}

/// Describes the factor of a displacement or load as a function of time.
fn growth_in_words(table: Option<&TimeTable>, duration_s: f64) -> String {
    match table {
        None => format!(", in proportion to the time up to {duration_s} s"),
        Some(TimeTable::Points(points)) => {
            let factors = first_of(points, |[time_s, factor]| format!("{factor} at {time_s} s"));
            format!(", times {factors}")
        }
        Some(TimeTable::File(file)) => format!(", times the factors in {}", file.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_described_by_its_points() {
        let text = r#"program = [
            { time_s = 0.1, displacement_mm = 0.08, steps = 20 },
            { time_s = 1.0, force_n = 10.0 },
            { time_s = 2.0 },
        ]"#;
        let mut table: toml::Table = text.parse().unwrap();
        let program: Vec<ProgramPointCase> = table.remove("program").unwrap().try_into().unwrap();
        assert_eq!(
            program_in_words(&program, Some(5)),
            "load program: 0.08 mm at 0.1 s in 20 steps, 10 N at 1 s in 5 steps, neither displacement_mm nor force_n \
             at 2 s in 5 steps"
        );
    }

    #[test]
    fn each_condition_is_one_line() {
        let text = r#"
            remove_rigid_motions = true
            symmetry = ["back"]
            pressure = [{ surface = "side", pressure_mpa = 5.0, table = [[1.0, 1.0]] }]
            prescribe = [{ surface = "bottom", z_mm = 0.0 }, { surface = "top", x_mm = 0.1, z_mm = -0.3 }]
            traction = [{ surface = "front", vector_mpa = [0.0, 1.0, 0.0] }]
            measure = { surface = "top", direction = [0.0, 0.0, -1.0] }
            extensometer = { from_mm = [0.0, 0.0, 1.0], to_mm = [0.0, 0.0, 3.0] }
        "#;
        let conditions: ConditionsCase = toml::from_str(text).unwrap();
        assert_eq!(
            conditions_in_words(&conditions, 10.0),
            [
                "bottom: uz = 0 mm",
                "top: ux = 0.1 mm, uz = -0.3 mm, in proportion to the time up to 10 s",
                "back: nodes stay in their plane (symmetry)",
                "front: dead load (0, 1, 0) MPa, in proportion to the time up to 10 s",
                "side: pressure 5 MPa, normal to the deformed surface, times 1 at 1 s",
                "single nodes are fixed against rigid motions",
                "measured: force on top and displacement of [0.0, 0.0, 3.0] mm relative to [0.0, 0.0, 1.0] mm, along \
                 (0, 0, -1)",
            ]
        );
    }
}
