//! Reader of the sections of MSH 2.2, in which every element lists its physical group.

use super::elements::{Contents, Header, shape};
use super::source::{Fault, Source};

/// Reads `$Nodes`.
pub(super) fn nodes(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    read_nodes(source, contents, |_| Ok(()))
}

/// Reads `$ParametricNodes`: nodes with their geometric entity and their parametric coordinates on this entity.
pub(super) fn parametric_nodes(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    read_nodes(source, contents, |source| {
        let dimension = source.int("an entity's dimension")?;
        source.int("an entity's tag")?;
        // a node on a curve has one parameter, a node on a surface has two parameters, and all other nodes have none
        for _ in 0..if dimension < 3 { dimension } else { 0 } {
            source.real("a parametric coordinate")?;
        }
        Ok(())
    })
}

fn read_nodes(
    source: &mut Source,
    contents: &mut Contents,
    skip_parameters: impl Fn(&mut Source) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let count: u64 = source.text("the number of nodes")?;
    if source.binary {
        source.line_end()?;
    }
    for _ in 0..count {
        let tag = tag(source, "a node's number")?;
        let point = source.point()?;
        skip_parameters(source)?;
        contents.node(source, tag, point)?;
    }
    Ok(())
}

pub(super) fn elements(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    let count: u64 = source.text("the number of elements")?;
    if source.binary {
        source.line_end()?;
    }
    let mut read = 0;
    while read < count {
        // in a binary file, each block of elements begins with the element type and the number of tags
        let header = if source.binary { Some(block_header(source)?) } else { None };
        let block = header.map_or(1, |(_, block, _)| block);
        for _ in 0..block {
            let number = source.int("an element's number")?;
            let (kind, tags) = match header {
                Some((kind, _, tags)) => (kind, tags),
                None => {
                    (source.int("an element type")?, source.int("an element's number of tags")?)
                }
            };
            let (mut groups, mut entity) = (Vec::new(), 0);
            for k in 0..tags {
                let value = source.int("an element's tag")?;
                // the first tag is the physical group (0 for no group), the second tag the elementary entity
                match k {
                    0 if value != 0 => groups.push(value),
                    1 => entity = value,
                    _ => {}
                }
            }
            let groups = contents.group_set(groups);
            let header = Header { kind, tag: u64::try_from(number).unwrap_or(0), entity, groups };
            contents.element(source, header, |source| tag(source, "a node's number"))?;
        }
        read += block as u64;
    }
    if read > count {
        return Err(source.fault(format!(
            "the section has {read} elements instead of the announced {count}; save the mesh again"
        )));
    }
    Ok(())
}

fn block_header(source: &mut Source) -> Result<(i32, i32, i32), Fault> {
    let kind = source.int("an element type")?;
    let block = source.int("a block's number of elements")?;
    let tags = source.int("a block's number of tags")?;
    if shape(kind).is_none() || block < 1 || tags < 0 {
        return Err(source.fault(format!(
            "a block of {block} elements of type {kind} with {tags} tags is invalid; save the mesh again"
        )));
    }
    Ok((kind, block, tags))
}

fn tag(source: &mut Source, what: &str) -> Result<u64, Fault> {
    let value = source.int(what)?;
    u64::try_from(value)
        .map_err(|_| source.fault(format!("{what} is negative: {value}; save the mesh again")))
}
