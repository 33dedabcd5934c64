//! Grain numbers as elementary tags of the volumes.
//!
//! In a mesh of R regions, what belongs to grain g (0: to none) and to region r (1 … R, its physical
//! group) is one volume with the tag g R + r: without grains the number of its region.

use std::collections::BTreeSet;

use crate::mesh::TetMesh;

/// The elementary tag of each tetrahedron; the first that is too large for the format, if one is.
pub(super) fn tags(mesh: &TetMesh) -> Result<Vec<i32>, usize> {
    let regions = mesh.regions.len() as u64;
    let tag = |(tet, &region): (usize, &u16)| {
        let grain = mesh.grain_of.as_ref().map_or(0, |grain_of| u64::from(grain_of[tet]));
        i32::try_from(grain * regions + u64::from(region) + 1).map_err(|_| tet)
    };
    mesh.region_of.iter().enumerate().map(tag).collect()
}

/// The grain number of each tetrahedron, from its tag and its physical groups, where all tags are of
/// that form and tell at least two numbers: those of other programs do not. The file announces so many
/// names of regions.
pub(super) fn numbers<'a>(
    volumes: impl Iterator<Item = (i32, &'a [i32])> + Clone,
    announced: usize,
) -> Option<Vec<u32>> {
    let groups: BTreeSet<i32> = volumes.clone().flat_map(|(_, groups)| groups).copied().collect();
    let regions = i32::try_from(groups.len().max(announced)).ok().filter(|&r| r > 0)?;
    let number = |(tag, groups): (i32, &[i32])| {
        let from_zero = tag.checked_sub(1).filter(|&tag| tag >= 0)?;
        let fits = groups == [from_zero % regions + 1];
        u32::try_from(from_zero / regions).ok().filter(|_| fits)
    };
    let numbers = volumes.map(number).collect::<Option<Vec<u32>>>()?;
    numbers.iter().any(|number| *number != numbers[0]).then_some(numbers)
}
