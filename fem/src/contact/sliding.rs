//! Frictionless rigid platens: u_z prescribed on both ends, in-plane motion free.
//!
//! What is left of the rigid motions (two translations and the spin about z) is removed at two
//! nodes of the lower end; without friction their reactions vanish.

use crate::error::FemError;

/// The nodes that the platens hold.
#[derive(Clone, Debug)]
pub(crate) struct SlidingPlatens {
    pub(crate) bottom: Vec<u32>,
    pub(crate) top: Vec<u32>,
    /// Held in x and y: the node of the lower end next to its centre.
    pub(crate) pivot: u32,
    /// Held in y: the node of the lower end that is furthest from the pivot along x.
    pub(crate) stop: u32,
}

impl SlidingPlatens {
    /// Chooses the two nodes that remove the rigid motions.
    ///
    /// # Errors
    /// When the lower end has no two nodes apart in x.
    pub(crate) fn new(
        nodes: &[[f64; 3]],
        bottom: Vec<u32>,
        top: Vec<u32>,
    ) -> Result<Self, FemError> {
        let at = |n: u32| nodes[n as usize];
        let count = bottom.len().max(1) as f64;
        let centre: [f64; 2] =
            std::array::from_fn(|k| bottom.iter().map(|&n| at(n)[k]).sum::<f64>() / count);
        let from_centre = |n: u32| (at(n)[0] - centre[0]).hypot(at(n)[1] - centre[1]);
        let reach = |pivot: u32, n: u32| (at(n)[0] - at(pivot)[0]).abs();
        let held =
            bottom.iter().copied().min_by(|&a, &b| from_centre(a).total_cmp(&from_centre(b)));
        let apart = held.and_then(|pivot| {
            let stop = bottom
                .iter()
                .copied()
                .max_by(|&a, &b| reach(pivot, a).total_cmp(&reach(pivot, b)))?;
            (reach(pivot, stop) > 0.0).then_some((pivot, stop))
        });
        let Some((pivot, stop)) = apart else {
            return Err(FemError::Platens("surface 'bottom' is a line, not an area"));
        };
        Ok(Self { bottom, top, pivot, stop })
    }

    /// The held components (node, axis).
    pub(crate) fn held(&self) -> impl Iterator<Item = (u32, usize)> + '_ {
        let ends = self.bottom.iter().chain(&self.top).map(|&n| (n, 2));
        ends.chain([(self.pivot, 0), (self.pivot, 1), (self.stop, 1)])
    }
}
