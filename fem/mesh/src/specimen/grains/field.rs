//! Interface through which a mesher queries grains from any source.

/// Grains in a cylinder, numbered from 1; number 0 is the matrix.
///
/// Points are in the specimen's coordinates (mm): the cylinder stands on z = 0 with its axis on z.
pub trait GrainField: Sync {
    /// Returns the number of grains; grains are numbered from 1 to this number.
    fn grains(&self) -> usize;

    /// Returns the names of the grains' phases. Each phase becomes a region of the mesh, after the matrix. Grains of
    /// the phase [`VOID`](fem_image::VOID) are voids; their tetrahedra are removed from the mesh.
    fn phases(&self) -> Vec<String> {
        vec!["grain".into()]
    }

    /// Returns the phase of a grain, an index into [`phases`](Self::phases).
    fn phase_of(&self, _grain: u32) -> usize {
        0
    }

    /// Returns the number of the grain that contains a point, or 0 in the matrix.
    fn grain_at(&self, x: [f64; 3]) -> u32;

    /// Returns the signed distance to a grain's surface (mm), negative inside. The distance is exact in some
    /// implementations. In all other implementations, the distance is smooth near the surface; farther away, the sign
    /// is correct, but the magnitude may be too large.
    fn distance(&self, grain: u32, x: [f64; 3]) -> f64;

    /// Returns the volume of a grain inside the cylinder (mm³), which a mesh should reproduce.
    fn volume_mm3(&self, grain: u32) -> f64;

    /// Appends, in increasing order, all grains that may be closer than `reach` mm to a point.
    fn near(&self, x: [f64; 3], reach: f64, grains: &mut Vec<u32>);

    /// Returns whether a grain may be closer than `reach` mm to a point. `false` excludes the grain for all points of
    /// the ball with the radius `reach` around the point. Fields without exact distances always return `true`.
    fn reaches(&self, _grain: u32, _x: [f64; 3], _reach: f64) -> bool {
        true
    }

    /// Returns the resolution of the geometry (mm). Surfaces count as touching if their distance is smaller than the
    /// resolution.
    fn resolution_mm(&self) -> f64;

    /// Returns the signed distance to a grain's surface (mm) if the distance is less than `limit`, otherwise `None`.
    /// This function may be faster than [`distance`](Self::distance).
    fn distance_below(&self, grain: u32, x: [f64; 3], limit: f64) -> Option<f64> {
        Some(self.distance(grain, x)).filter(|&distance| distance < limit)
    }

    /// Returns the signed distance to a grain's surface (mm) and its gradient. The default implementation computes the
    /// gradient by central differences over `step` mm to both sides.
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
