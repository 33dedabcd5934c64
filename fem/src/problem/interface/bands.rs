//! Bands of a mesh around its interfaces, and their materials.

use std::sync::Arc;

use super::interface::Interface;
use super::toughness::Band;
use crate::error::{FemError, Unsupported};
use crate::material::{Material, PhaseField, PointMaterial};
use fem_mesh::{InterfaceSurface, TetMesh};

/// Share of a region's volume above which its band is reported as too wide: at most a quarter of the region then has the
/// toughness of the region.
const LARGE: f64 = 0.75;

/// Bands around the interfaces of a mesh. They do not depend on the toughnesses.
///
/// The materials of the bands are appended to the materials of the regions: for each interface, the material of the
/// band in its first and in its second region.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bands {
    /// For each interface, the band on either side; `None` on the side of a region that cannot
    /// break.
    sides: Vec<[Option<Side>; 2]>,
    /// Index of the band's material, and the share of the element that is in the band, for each element of the whole
    /// mesh. Empty without interfaces.
    of_element: Arc<[(u16, f64)]>,
}

/// Band on one side of an interface, in a region that can break.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Index of the region.
    region: usize,
    /// Half-width w of the band, mm.
    half_width_mm: f64,
    /// Thickness h of the row of elements at the interface, mm. A crack breaks this row, in meshes of linear and of
    /// quadratic elements.
    row_mm: f64,
    /// Whether the other region can break, too.
    two_sided: bool,
    /// Share of the region's volume that is in the band.
    share: f64,
}

impl Bands {
    /// Finds the bands of a mesh. `damaged` states which regions can break.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if a region does not exist, the regions do not touch, or no region can break;
    /// [`FemError::OutOfRange`] if half of the width of an interface is larger than the body.
    pub(crate) fn new(
        mesh: &TetMesh,
        interfaces: &[Interface],
        damaged: &[bool],
    ) -> Result<Self, FemError> {
        if interfaces.is_empty() {
            return Ok(Self::default());
        }
        let mut of_element = vec![(0, 0.0); mesh.tets.len()];
        let mut sides = Vec::new();
        for (number, interface) in interfaces.iter().enumerate() {
            let refused = |reason| Err(FemError::unsupported(interface.entity(), reason));
            let [a, b] = &interface.regions;
            let is_same = |other: &Interface| {
                other.regions == interface.regions || other.regions == [b.clone(), a.clone()]
            };
            if interfaces[..number].iter().any(is_same) {
                return refused(Unsupported::InterfaceTwice);
            }
            let mut regions = [0; 2];
            for (index, name) in regions.iter_mut().zip(&interface.regions) {
                let Some(region) = mesh.regions.iter().position(|region| region == name) else {
                    let regions = mesh.regions.join(", ");
                    return refused(Unsupported::NoSuchRegion { name: name.clone(), regions });
                };
                *index = region;
            }
            let surface = InterfaceSurface::new(mesh, regions.map(|region| region as u16));
            if surface.area_mm2() <= 0.0 {
                return refused(Unsupported::NoInterface);
            }
            let breaks = regions.map(|region| damaged[region]);
            if breaks == [false; 2] {
                return refused(Unsupported::InterfaceOfElasticRegions);
            }
            if 0.5 * interface.width_mm > mesh.largest_extent() {
                let requirement =
                    "at most twice the largest extent of the body; choose about four elements";
                let (entity, width_mm) = (interface.entity(), interface.width_mm);
                return Err(FemError::parameter(&entity, "width_mm", width_mm, requirement));
            }
            let rows = surface.row_mm();
            let side = |k: usize| {
                breaks[k].then(|| {
                    let (region, row_mm) = (regions[k], rows[k]);
                    // the band has at least two rows of elements: the row that a crack breaks, and one more
                    let half_width_mm = (0.5 * interface.width_mm).max(2.0 * row_mm);
                    let two_sided = breaks == [true; 2];
                    Side { region, half_width_mm, row_mm, two_sided, share: 0.0 }
                })
            };
            let mut both = [side(0), side(1)];
            let widths = both.map(|side| side.map_or(0.0, |side| side.half_width_mm));
            let first = mesh.regions.len() + 2 * number;
            let shares = surface.band(mesh, widths);
            let of_regions = shares_of_regions(mesh, &shares);
            both.iter_mut().flatten().for_each(|side| side.share = of_regions[side.region]);
            for (tet, share) in shares.into_iter().enumerate() {
                // an element in several bands belongs to the band with the largest share
                if share > of_element[tet].1 {
                    let is_second = usize::from(mesh.region_of[tet]) == regions[1];
                    of_element[tet] = ((first + usize::from(is_second)) as u16, share);
                }
            }
            sides.push(both);
        }
        Ok(Self { sides, of_element: of_element.into() })
    }

    /// Returns, for each element of the whole mesh, the index of the material of its band, and the share of the element
    /// that is in the band; empty without interfaces.
    pub(crate) fn of_element(&self) -> &Arc<[(u16, f64)]> {
        &self.of_element
    }

    /// Returns the materials of the regions and of the bands, in the form used at quadrature points. `spacing_mm` is the
    /// mean distance of neighbouring nodes if a material has a strength.
    pub(crate) fn point_materials(
        &self,
        materials: &[Material],
        interfaces: &[Interface],
        field: Option<&PhaseField>,
        spacing_mm: f64,
    ) -> Arc<[PointMaterial]> {
        let of_region = |material: &Material| material.at_point_of(field, spacing_mm);
        let mut point_materials: Vec<PointMaterial> = materials.iter().map(of_region).collect();
        for (interface, sides) in interfaces.iter().zip(&self.sides) {
            for side in sides {
                // no element has the material of a band in a region that does not break
                let mut point = point_materials[side.map_or(0, |side| side.region)].clone();
                if let (Some(side), Some(field)) = (side, field)
                    && let Some(fracture) = materials[side.region].fracture
                    && let Some(damage) = &mut point.damage
                {
                    let bulk = fracture.toughness_n_per_mm;
                    let factor = side.toughness(interface, bulk, field) / bulk;
                    damage.local *= factor;
                    damage.gradient *= factor;
                }
                point_materials.push(point);
            }
        }
        point_materials.into()
    }

    /// Returns the interfaces whose bands were widened because the elements are too large: name, stated width and width
    /// of the band, mm.
    pub(crate) fn widened(&self, interfaces: &[Interface]) -> Vec<(String, f64, f64)> {
        let of_interface = |(interface, sides): (&Interface, &[Option<Side>; 2])| {
            let widest = sides.iter().flatten().map(|side| side.half_width_mm).fold(0.0, f64::max);
            let stated = interface.width_mm;
            (2.0 * widest > stated).then(|| (interface.regions.join("-"), stated, 2.0 * widest))
        };
        interfaces.iter().zip(&self.sides).filter_map(of_interface).collect()
    }

    /// Returns the bands that are a large part of their region: the interface, the index of the region, the share of its
    /// volume, and the width of the band in mm.
    pub(crate) fn large<'a>(
        &'a self,
        interfaces: &'a [Interface],
    ) -> impl Iterator<Item = (&'a Interface, usize, f64, f64)> {
        interfaces.iter().zip(&self.sides).flat_map(|(interface, sides)| {
            let large = sides.iter().flatten().filter(|side| side.share > LARGE);
            large.map(move |side| (interface, side.region, side.share, 2.0 * side.half_width_mm))
        })
    }
}

/// Returns the share of each region's volume that is in a band. `shares` contains the share of each element in the
/// band. Only the matrix of a mixture is included in the volumes.
fn shares_of_regions(mesh: &TetMesh, shares: &[f64]) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; mesh.regions.len()];
    for (tet, share) in shares.iter().enumerate() {
        let fraction = mesh.mixture.as_ref().map_or(0.0, |all| f64::from(all[tet].fraction));
        let volume = (1.0 - fraction) * mesh.tet_volume(tet);
        let [within, whole] = &mut sums[usize::from(mesh.region_of[tet])];
        *within += share * volume;
        *whole += volume;
    }
    sums.into_iter().map(|[within, whole]| if whole > 0.0 { within / whole } else { 0.0 }).collect()
}

impl Side {
    /// Returns the toughness G̃ of the band, N/mm, in a region of toughness `bulk`.
    fn toughness(&self, interface: &Interface, bulk: f64, field: &PhaseField) -> f64 {
        let length = field.length_mm;
        let band = Band {
            bulk,
            half_width: self.half_width_mm / length,
            row: self.row_mm / length,
            two_sided: self.two_sided,
        };
        band.toughness(field.model, interface.toughness_n_per_mm)
    }
}
