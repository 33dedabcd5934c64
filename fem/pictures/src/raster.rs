//! Raster images and their PNG encoding.

use std::io;

/// Red, green and blue components.
pub(crate) type Colour = [u8; 3];

/// A raster image: pixels row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Raster {
    /// Creates an image of one colour.
    pub fn new(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Creates an image from rows of pixels, all of the same length.
    pub fn from_rows(width: usize, rows: Vec<Vec<Colour>>) -> Self {
        let height = rows.len();
        Self { width, height, pixels: rows.concat() }
    }

    /// Creates an image from bytes: red, green and blue of each pixel, row by row.
    pub fn from_bytes(width: usize, bytes: &[u8]) -> Self {
        let pixels: Vec<Colour> = bytes.as_chunks().0.to_vec();
        Self { width, height: pixels.len() / width.max(1), pixels }
    }

    /// Enlarges the image: each pixel becomes a square of `times` × `times` pixels.
    fn zoomed(&self, times: usize) -> Self {
        let pixel = |x: usize, y: usize| self.pixels[y / times * self.width + x / times];
        let rows = 0..times * self.height;
        let rows = rows.map(|y| (0..times * self.width).map(|x| pixel(x, y)).collect());
        Self::from_rows(times * self.width, rows.collect())
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Colour of the pixel in column x and row y.
    #[cfg(test)]
    pub fn at(&self, x: usize, y: usize) -> Colour {
        self.pixels[y * self.width + x]
    }

    /// Sets the colour of the pixel in column x and row y.
    pub fn set(&mut self, x: usize, y: usize, colour: Colour) {
        self.pixels[y * self.width + x] = colour;
    }

    /// Copies another image into this image, with the top left corner at column x and row y. The other image must fit
    /// into this image.
    pub fn paste(&mut self, other: &Raster, x: usize, y: usize) {
        for (row, pixels) in other.pixels.chunks(other.width).enumerate() {
            let start = (y + row) * self.width + x;
            self.pixels[start..start + other.width].copy_from_slice(pixels);
        }
    }

    /// Returns the image at half the size. Each pixel is the mean of four pixels of this image; an odd last column or
    /// row is dropped.
    pub fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |x: usize, y: usize| -> Colour {
            let at = |dx, dy| self.pixels[(2 * y + dy) * self.width + 2 * x + dx];
            let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
            std::array::from_fn(|k| (four.iter().map(|c| u16::from(c[k])).sum::<u16>() / 4) as u8)
        };
        let rows = (0..height).map(|y| (0..width).map(|x| mean(x, y)).collect()).collect();
        Self::from_rows(width, rows)
    }

    /// Encodes the image as the bytes of a PNG file.
    ///
    /// # Errors
    /// An error if the image has no pixels.
    pub fn to_png(&self) -> io::Result<Vec<u8>> {
        let side = |n: usize| u32::try_from(n).map_err(io::Error::other);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// Number of pixels between two pictures of a row.
const GAP: usize = 12;
/// Pictures in a row are enlarged to at least this width in pixels, but by at most the factor [`MOST`].
const WIDTH: usize = 300;
/// Largest factor by which pictures in a row are enlarged.
const MOST: usize = 6;

/// Places pictures in a row on white, and enlarges small pictures.
pub fn side_by_side(pictures: &[Raster]) -> Raster {
    let narrowest = pictures.iter().map(Raster::width).min().unwrap_or(1).max(1);
    let times = WIDTH.div_ceil(narrowest).clamp(1, MOST);
    let pictures: Vec<Raster> = pictures.iter().map(|picture| picture.zoomed(times)).collect();
    let gaps = GAP * pictures.len().saturating_sub(1);
    let width = pictures.iter().map(Raster::width).sum::<usize>() + gaps;
    let height = pictures.iter().map(Raster::height).max().unwrap_or(0);
    let mut row = Raster::new(width, height, [255; 3]);
    let mut x = 0;
    for picture in &pictures {
        row.paste(picture, x, 0);
        x += picture.width() + GAP;
    }
    row
}

/// Returns the colour of a grain. The six colours are used cyclically, in the order of the grain numbers.
pub(crate) fn grain_colour(grain: u32) -> [f64; 3] {
    const GRAINS: [[f64; 3]; 6] = [
        [230.0, 159.0, 60.0],
        [86.0, 160.0, 211.0],
        [90.0, 170.0, 120.0],
        [204.0, 121.0, 167.0],
        [214.0, 110.0, 80.0],
        [140.0, 130.0, 200.0],
    ];
    GRAINS[grain as usize % GRAINS.len()]
}

/// Multiplies a colour by a brightness from 0 to 1.
pub(crate) fn lit(colour: [f64; 3], light: f64) -> Colour {
    colour.map(|c| (c * light.clamp(0.0, 1.0)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_contains_the_pixels() {
        let mut picture = Raster::new(3, 2, [1, 2, 3]);
        picture.set(2, 1, [200, 100, 0]);
        picture.paste(&Raster::new(2, 1, [9, 9, 9]), 0, 0);
        let bytes = picture.to_png().unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (3, 2));
        let expected = [9, 9, 9, 9, 9, 9, 1, 2, 3, 1, 2, 3, 1, 2, 3, 200, 100, 0];
        assert_eq!(pixels[..expected.len()], expected);
        assert!(Raster::new(0, 2, [0; 3]).to_png().is_err());
    }

    #[test]
    fn small_pictures_in_a_row_are_enlarged() {
        let one = Raster::from_bytes(2, &[1, 1, 1, 2, 2, 2]);
        let row = side_by_side(&[one.clone(), one]);
        assert_eq!((row.width(), row.height()), (2 * 2 * MOST + GAP, MOST));
        assert_eq!(row.pixels[MOST - 1..=MOST], [[1; 3], [2; 3]]);
        assert_eq!(row.pixels[2 * MOST..2 * MOST + GAP], [[255; 3]; GAP]);
    }

    #[test]
    fn a_pixel_of_the_halved_picture_is_the_mean_of_four() {
        let mut picture = Raster::new(4, 2, [0; 3]);
        picture.set(0, 0, [40, 80, 120]);
        let half = picture.halved();
        assert_eq!((half.width(), half.height()), (2, 1));
        assert_eq!(half.pixels, [[10, 20, 30], [0, 0, 0]]);
    }
}
