//! What a mesher needs to know of grains, wherever they come from.

/// Grains in a cylinder, numbered from 1; the matrix is 0.
///
/// Points are in the specimen's coordinates (mm): the cylinder stands on z = 0 with its axis on z.
pub trait GrainField: Sync {
    /// How many grains there are; they are numbered from 1 to this.
    fn grains(&self) -> usize;

    /// Names of the phases that grains are of; each becomes a region of the mesh, after the matrix. Grains of the phase
    /// [`VOID`](fem_image::VOID) are voids: their tetrahedra are no part of the body.
    fn phases(&self) -> Vec<String> {
        vec!["grain".into()]
    }

    /// The phase of a grain, an index into [`phases`](Self::phases).
    fn phase_of(&self, _grain: u32) -> usize {
        0
    }

    /// The grain that a point lies in, or 0.
    fn grain_at(&self, x: [f64; 3]) -> u32;

    /// Signed distance to a grain's surface (mm), negative inside; exact, or smooth near the
    /// surface and a bound with the right sign farther away.
    fn distance(&self, grain: u32, x: [f64; 3]) -> f64;

    /// Volume of a grain inside the cylinder (mm³), which a mesh has to keep.
    fn volume_mm3(&self, grain: u32) -> f64;

    /// Appends, in increasing order, the grains that may come nearer to a point than `reach` mm.
    fn near(&self, x: [f64; 3], reach: f64, found: &mut Vec<u32>);

    /// Details smaller than this (mm) are not known: surfaces nearer to each other touch.
    fn resolution_mm(&self) -> f64;

    /// The signed distance, or nothing where it cannot be less than `limit`, which may cost less.
    fn distance_below(&self, grain: u32, x: [f64; 3], limit: f64) -> Option<f64> {
        Some(self.distance(grain, x)).filter(|&distance| distance < limit)
    }

    /// The signed distance and its gradient; unless it is known better, by central differences over
    /// `step` mm to both sides.
    fn distance_and_gradient(&self, grain: u32, x: [f64; 3], step: f64) -> (f64, [f64; 3]) {
        let gradient = std::array::from_fn(|k| {
            let (mut plus, mut minus) = (x, x);
            plus[k] += step;
            minus[k] -= step;
            (self.distance(grain, plus) - self.distance(grain, minus)) / (2.0 * step)
        });
        (self.distance(grain, x), gradient)
    }
}
