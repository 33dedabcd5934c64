//! Encoding of grain numbers in the elementary tags of volumes.
//!
//! In a mesh of R regions, the tetrahedra of grain g (0 for the matrix) in region r (1 … R, the number of the physical
//! group) form one volume with the elementary tag g R + r. In a mesh without grains, this tag is r.

use std::collections::BTreeSet;

use crate::mesh::TetMesh;

/// Returns the elementary tag of each tetrahedron. If a tag exceeds the range of the format, the error is the number of
/// the first tetrahedron with such a tag.
pub(super) fn tags(mesh: &TetMesh) -> Result<Vec<i32>, usize> {
    let regions = mesh.regions.len() as u64;
    let tag = |(tet, &region): (usize, &u16)| {
        let grain = mesh.grain_of.as_ref().map_or(0, |grain_of| u64::from(grain_of[tet]));
        i32::try_from(grain * regions + u64::from(region) + 1).map_err(|_| tet)
    };
    mesh.region_of.iter().enumerate().map(tag).collect()
}

/// Decodes the grain number of each tetrahedron from its elementary tag and physical groups. Returns `None` if a tag
/// does not follow the scheme of [`tags`], as in files of other programs, or if all grain numbers are equal. `volumes`
/// yields the elementary tag and the physical groups of each tetrahedron; `announced` is the number of region names in
/// the file.
pub(super) fn grain_numbers<'a>(
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
    let grain_numbers = volumes.map(number).collect::<Option<Vec<u32>>>()?;
    grain_numbers.iter().any(|number| *number != grain_numbers[0]).then_some(grain_numbers)
}
