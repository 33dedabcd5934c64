//! Drawing of triangles in space as pixels. Nearer triangles hide triangles behind them.

use crate::raster::{Colour, Raster};

const PAPER: Colour = [255; 3];
/// Half width in pixels of the line that is drawn along an edge of a triangle.
const EDGE: f64 = 0.8;
/// Smallest height in pixels of a triangle whose edges are drawn. The edges would cover the whole area of a smaller
/// triangle.
const LEAST_HEIGHT: f64 = 7.0;

/// A picture with a depth buffer, so that only the nearest of several surfaces is visible at each pixel.
pub(crate) struct Canvas {
    picture: Raster,
    depth: Vec<f64>,
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let depth = vec![f64::NEG_INFINITY; width * height];
        Self { picture: Raster::new(width, height, PAPER), depth }
    }

    /// Draws a triangle. Each corner is given by its column and row in pixels, and its depth.
    ///
    /// `colour` gets the barycentric coordinates of a pixel, and whether the pixel is on an edge of the triangle that
    /// is drawn. The triangle is transparent at pixels where `colour` returns `None`.
    pub(crate) fn fill(
        &mut self,
        corners: [[f64; 3]; 3],
        colour: impl Fn([f64; 3], bool) -> Option<Colour>,
    ) {
        let [a, b, c] = corners;
        let twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if twice_area.abs() < 1e-9 {
            return;
        }
        // heights of the triangle: the barycentric coordinate of a corner times the height of this corner is the
        // distance from the opposite edge
        let length = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]).hypot(q[1] - p[1]);
        let heights = [length(b, c), length(c, a), length(a, b)].map(|l| twice_area.abs() / l);
        let has_edges = heights.iter().all(|&h| h >= LEAST_HEIGHT);
        let bounds = |k: usize, most: usize| {
            let values = corners.map(|p| p[k]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min).floor().max(0.0);
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max).ceil().max(0.0);
            low as usize..(high as usize).min(most)
        };
        for y in bounds(1, self.picture.height()) {
            for x in bounds(0, self.picture.width()) {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let weight = |u: [f64; 3], v: [f64; 3]| {
                    ((v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])) / twice_area
                };
                let weights = [weight(b, c), weight(c, a), weight(a, b)];
                if weights.iter().any(|&w| w < 0.0) {
                    continue;
                }
                let depth = (0..3).map(|k| weights[k] * corners[k][2]).sum::<f64>();
                let pixel = y * self.picture.width() + x;
                if depth <= self.depth[pixel] {
                    continue;
                }
                let near = has_edges && (0..3).any(|k| weights[k] * heights[k] < EDGE);
                if let Some(colour) = colour(weights, near) {
                    self.depth[pixel] = depth;
                    self.picture.set(x, y, colour);
                }
            }
        }
    }

    /// Returns the final picture, in which each pixel is the mean of four drawn pixels.
    pub(crate) fn picture(&self) -> Raster {
        self.picture.halved()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(depth: f64) -> [[f64; 3]; 3] {
        [[0.0, 0.0, depth], [40.0, 0.0, depth], [0.0, 40.0, depth]]
    }

    #[test]
    fn the_nearer_of_two_triangles_is_visible_in_any_order() {
        let (near, far) = ([200, 0, 0], [0, 200, 0]);
        for order in [[(2.0, near), (1.0, far)], [(1.0, far), (2.0, near)]] {
            let mut canvas = Canvas::new(40, 40);
            for (depth, colour) in order {
                canvas.fill(triangle(depth), |_, _| Some(colour));
            }
            let mut expected = Canvas::new(40, 40);
            expected.fill(triangle(2.0), |_, _| Some(near));
            assert_eq!(canvas.picture, expected.picture);
        }
    }

    #[test]
    fn a_triangle_without_colour_is_transparent() {
        let mut canvas = Canvas::new(40, 40);
        canvas.fill(triangle(2.0), |weights, _| (weights[0] > 0.5).then_some([200, 0, 0]));
        canvas.fill(triangle(1.0), |_, _| Some([0, 200, 0]));
        let mut expected = Canvas::new(40, 40);
        expected.fill(triangle(1.0), |weights, _| {
            Some(if weights[0] > 0.5 { [200, 0, 0] } else { [0, 200, 0] })
        });
        assert_eq!(canvas.picture, expected.picture);
    }
}
