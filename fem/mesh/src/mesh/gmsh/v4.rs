//! Reader of the sections of MSH 4.1. Physical groups belong to entities, and each block of elements belongs to one
//! entity.

use super::elements::{Contents, Header, shape};
use super::source::{Fault, Source};

pub(super) fn entities(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.size("a number of entities")?;
    }
    for (dimension, &count) in (0..).zip(&counts) {
        for _ in 0..count {
            let entity = source.int("an entity's tag")?;
            // skip the coordinates of a point, or the bounding box (two points) of any other entity
            source.point()?;
            if dimension > 0 {
                source.point()?;
            }
            let groups = source.size("an entity's number of physical groups")?;
            let groups = (0..groups)
                // the sign of a group number, which gives the orientation of the entity, is not used
                .map(|_| Ok(source.int("a physical group")?.saturating_abs()))
                .collect::<Result<Vec<i32>, Fault>>()?;
            let groups = contents.group_set(groups);
            contents.groups.insert((dimension, entity), groups);
            if dimension > 0 {
                for _ in 0..source.size("an entity's number of bounding entities")? {
                    source.int("a bounding entity")?;
                }
            }
        }
    }
    Ok(())
}

pub(super) fn nodes(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    let blocks = source.size("the number of node blocks")?;
    for what in ["the number of nodes", "the smallest node tag", "the largest node tag"] {
        source.size(what)?;
    }
    for _ in 0..blocks {
        let dimension = source.int("an entity's dimension")?;
        source.int("an entity's tag")?;
        let parametric = source.int("the parametric flag (0 or 1)")?;
        let count = source.size("a block's number of nodes")?;
        let tags =
            (0..count).map(|_| source.size("a node's tag")).collect::<Result<Vec<u64>, Fault>>()?;
        for tag in tags {
            let point = source.point()?;
            if parametric != 0 {
                for _ in 0..dimension {
                    source.real("a parametric coordinate")?;
                }
            }
            contents.node(source, tag, point)?;
        }
    }
    Ok(())
}

pub(super) fn elements(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    let blocks = source.size("the number of element blocks")?;
    for what in ["the number of elements", "the smallest element tag", "the largest element tag"] {
        source.size(what)?;
    }
    for _ in 0..blocks {
        source.int("an entity's dimension")?;
        let entity = source.int("an entity's tag")?;
        let kind = source.int("an element type")?;
        let count = source.size("a block's number of elements")?;
        let groups = shape(kind)
            .and_then(|(dimension, _)| contents.groups.get(&(dimension, entity)))
            .copied()
            .unwrap_or_default();
        for _ in 0..count {
            let tag = source.size("an element's tag")?;
            let header = Header { kind, tag, entity, groups };
            contents.element(source, header, |source| source.size("a node's tag"))?;
        }
    }
    Ok(())
}
