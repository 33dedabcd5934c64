//! Equation numbers of the nodal values that are unknowns.

/// Equation number of a nodal value that is prescribed or absent.
pub const NONE: u32 = u32::MAX;

/// Equation numbers of the nodal values u_x, u_y, u_z, φ.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// Equation number of each nodal value, by node; [`NONE`] if the value is not an unknown.
    pub equation: Vec<[u32; 4]>,
    /// Number of unknowns.
    pub count: usize,
}

impl Unknowns {
    /// Numbers the free values node by node, in the given order of the nodes.
    ///
    /// `damaged[n]` is true if the damage of node n is an unknown; `constrained` lists prescribed displacements as
    /// (node, axis).
    pub fn new(
        order: &[u32],
        damaged: &[bool],
        constrained: impl Iterator<Item = (u32, usize)>,
    ) -> Self {
        let mut free: Vec<[bool; 4]> = damaged.iter().map(|&d| [true, true, true, d]).collect();
        for (node, axis) in constrained {
            free[node as usize][axis] = false;
        }
        let mut equation = vec![[NONE; 4]; damaged.len()];
        let mut count = 0;
        for &node in order {
            for k in 0..4 {
                if free[node as usize][k] {
                    equation[node as usize][k] = count as u32;
                    count += 1;
                }
            }
        }
        Self { equation, count }
    }
}
