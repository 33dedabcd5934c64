//! `$ElementData` sections: grain numbers and mixtures of the tetrahedra.

use std::collections::HashMap;
use std::fmt::{self, Write as _};

use super::source::{Fault, Source};
use crate::mesh::{Mixture, TetMesh};

/// Names of the supported data sections. `GRAIN` contains grain numbers that elementary tags cannot encode; the other
/// sections contain the fields of [`Mixture`].
const GRAIN: &str = "grain";
const FRACTION: &str = "grain_fraction";
const NORMAL: &str = "interface_normal";
/// Name of the data section with the physical group of the second phase.
const SECOND: &str = "second_phase";

/// Data of the elements, by element tag. Each element has up to three components.
#[derive(Default)]
pub(super) struct ElementData {
    grain: HashMap<u64, [f64; 3]>,
    fraction: HashMap<u64, [f64; 3]>,
    normal: HashMap<u64, [f64; 3]>,
    second: HashMap<u64, [f64; 3]>,
}

/// Reads a data section if its name is supported. Otherwise returns `false`, and the caller has to skip the rest of the
/// section.
pub(super) fn read(source: &mut Source, data: &mut ElementData) -> Result<bool, Fault> {
    let strings: usize = source.text("the number of string tags")?;
    source.line_end()?;
    let mut name = String::new();
    for k in 0..strings {
        let text = source.text_line()?;
        if k == 0 {
            name = text.trim_matches('"').into();
        }
    }
    let (values, expected) = match name.as_str() {
        GRAIN => (&mut data.grain, 1),
        FRACTION => (&mut data.fraction, 1),
        NORMAL => (&mut data.normal, 3),
        SECOND => (&mut data.second, 1),
        _ => return Ok(false),
    };
    let reals: usize = source.text("the number of real tags")?;
    for _ in 0..reals {
        source.text::<f64>("a real tag")?;
    }
    let integers: usize = source.text("the number of integer tags")?;
    let (mut components, mut count) = (0, 0);
    for k in 0..integers {
        let value: u64 = source.text("an integer tag")?;
        match k {
            1 => components = value,
            2 => count = value,
            _ => {}
        }
    }
    if components != expected {
        return Err(source.fault(format!(
            "data section `{name}` has {components} components instead of {expected}; save the mesh again"
        )));
    }
    if source.binary {
        source.line_end()?;
    }
    for _ in 0..count {
        let tag = source.int("an element's number")?;
        let mut entry = [0.0; 3];
        for value in &mut entry[..expected as usize] {
            *value = source.real("a number")?;
        }
        let tag = u64::try_from(tag).map_err(|_| {
            source.fault(format!("element number {tag} is negative; save the mesh again"))
        })?;
        values.insert(tag, entry);
    }
    Ok(true)
}

impl ElementData {
    /// Returns whether the file contains mixture data.
    pub(super) fn has_mixture(&self) -> bool {
        !self.fraction.is_empty()
    }

    /// Returns the grain numbers of the elements `tags`, or `None` if the file has no grain data.
    pub(super) fn grains(&self, tags: impl Iterator<Item = u64>) -> Option<Vec<u32>> {
        let number = |tag| self.grain.get(&tag).map_or(0, |&[number, ..]| number as u32);
        (!self.grain.is_empty()).then(|| tags.map(number).collect())
    }

    /// Returns the mixtures of the elements `tags`, or `None` if the file has no mixture data; `region` maps a
    /// physical group to the index of its region.
    pub(super) fn mixture(
        &self,
        tags: impl Iterator<Item = u64>,
        region: impl Fn(i32) -> Option<u16>,
    ) -> Option<Vec<Mixture>> {
        let default_region = Mixture::default().region;
        let group = |tag| match self.second.get(&tag) {
            Some(&[group, ..]) => group as i32,
            None => i32::from(default_region) + 1,
        };
        let mixture = |tag| Mixture {
            fraction: self.fraction.get(&tag).map_or(0.0, |&[fraction, ..]| fraction as f32),
            normal: self.normal.get(&tag).map_or([0.0; 3], |normal| normal.map(|x| x as f32)),
            region: region(group(tag)).unwrap_or(default_region),
        };
        self.has_mixture().then(|| tags.map(mixture).collect())
    }
}

/// Writes the element data of all elements in the order of the file, as meshio expects: first zeros for `triangles`
/// triangles, then the data of the tetrahedra, whose order in the file is `by_volume`.
pub(super) fn write(
    out: &mut String,
    mesh: &TetMesh,
    triangles: usize,
    by_volume: &[usize],
) -> fmt::Result {
    let order = Order { triangles, by_volume };
    // write the grain numbers if all are equal: the elementary tags alone could also belong to a mesh without grains
    if let Some(grains) = mesh.grain_of.as_ref().filter(|all| all.iter().all(|&g| g == all[0])) {
        section(out, GRAIN, &order, |tet| [f64::from(grains[tet])])?;
    }
    if let Some(mixture) = &mesh.mixture {
        section(out, FRACTION, &order, |tet| [f64::from(mixture[tet].fraction)])?;
        section(out, NORMAL, &order, |tet| mixture[tet].normal.map(f64::from))?;
        // write the second phases only if one of them is not the default region, i.e. not in a mesh with only matrix
        // and grain
        let default_region = Mixture::default().region;
        if mixture.iter().any(|m| m.region != default_region) {
            section(out, SECOND, &order, |tet| [f64::from(mixture[tet].region) + 1.0])?;
        }
    }
    Ok(())
}

/// Order of the elements in the file: first the triangles, given by their number, then the tetrahedra.
struct Order<'a> {
    triangles: usize,
    by_volume: &'a [usize],
}

fn section<const N: usize>(
    out: &mut String,
    name: &str,
    order: &Order<'_>,
    of_tet: impl Fn(usize) -> [f64; N],
) -> fmt::Result {
    let count = order.triangles + order.by_volume.len();
    // the header of the section: one string, one time, and three integers (time step, number of components, number of
    // elements)
    writeln!(out, "$ElementData\n1\n\"{name}\"\n1\n0.0\n3\n0\n{N}\n{count}")?;
    let triangles = (1..=order.triangles).map(|tag| (tag, [0.0; N]));
    let tets = order.by_volume.iter().map(|&tet| (order.triangles + tet + 1, of_tet(tet)));
    for (tag, values) in triangles.chain(tets) {
        write!(out, "{tag}")?;
        values.iter().try_for_each(|x| write!(out, " {x:?}"))?;
        out.push('\n');
    }
    out.push_str("$EndElementData\n");
    Ok(())
}
