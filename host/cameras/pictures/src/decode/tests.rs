//! Tests of the decoding: pictures that the tests write, of known pixels.

mod hostile;

use ::png::{BitDepth, ColorType as Png, Info};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use plumb_frame::image::Image;

use super::*;

const WIDTH: usize = 21;
const HEIGHT: usize = 13;

/// Red, green and blue of a pixel: a smooth picture, which a JPEG keeps.
fn rgb(column: usize, row: usize) -> [u8; 3] {
    [(20 + 9 * column) as u8, (30 + 11 * row) as u8, (200 - 3 * column - 5 * row) as u8]
}

/// Returns the picture of these pixels, red first.
fn picture(pixel: impl Fn(usize, usize) -> [u8; 3]) -> ColourImage {
    Image::from_fn(WIDTH, HEIGHT, |column, row| {
        let [r, g, b] = pixel(column, row);
        [b, g, r]
    })
}

/// Returns the samples of all pixels, row by row.
fn samples<const N: usize>(pixel: impl Fn(usize, usize) -> [u8; N]) -> Vec<u8> {
    Image::from_fn(WIDTH, HEIGHT, pixel).channels().to_vec()
}

/// Returns a PNG file of rows of bytes. `edit` sets its palette and transparency.
fn png_file(
    kind: Png,
    depth: BitDepth,
    rows: &[u8],
    edit: impl Fn(&mut ::png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    edit(&mut encoder);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(rows).unwrap();
    writer.finish().unwrap();
    bytes
}

fn plain_png(kind: Png, depth: BitDepth, rows: &[u8]) -> Vec<u8> {
    png_file(kind, depth, rows, |_| ())
}

#[test]
fn the_header_tells_grey_pictures() {
    let grey = samples(|column, row| [(column * row) as u8]);
    let both = samples(|column, row| [(column * row) as u8, 255]);
    let colour = samples(rgb);
    for (kind, rows, is_grey) in [
        (Png::Grayscale, &grey, true),
        (Png::GrayscaleAlpha, &both, true),
        (Png::Rgb, &colour, false),
    ] {
        assert_eq!(super::is_grey(&plain_png(kind, BitDepth::Eight, rows)), is_grey, "{kind:?}");
    }
    for (kind, rows, is_grey) in [(ColorType::Luma, &grey, true), (ColorType::Rgb, &colour, false)]
    {
        let mut bytes = Vec::new();
        let encoder = Encoder::new(&mut bytes, 90);
        encoder.encode(rows, WIDTH as u16, HEIGHT as u16, kind).unwrap();
        assert_eq!(super::is_grey(&bytes), is_grey);
    }
    assert!(super::is_grey(b"P5 1 1 255 \0") && !super::is_grey(b"P6 1 1 255 \0\0\0"));
    assert!(!super::is_grey(b"no picture"));
}

/// Returns rows of samples of `bits` bits, each row filled up to a byte.
fn packed(bits: usize, sample: impl Fn(usize, usize) -> u8) -> Vec<u8> {
    let row = |row: usize| {
        let mut bytes = vec![0; (WIDTH * bits).div_ceil(8)];
        for column in 0..WIDTH {
            let at = column * bits;
            bytes[at / 8] |= sample(column, row) << (8 - bits - at % 8);
        }
        bytes
    };
    (0..HEIGHT).flat_map(row).collect()
}

/// Returns a JPEG file of the smooth picture at the best quality.
fn jpeg_file(edit: impl Fn(&mut Encoder<&mut Vec<u8>>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 100);
    edit(&mut encoder);
    encoder.encode(&samples(rgb), WIDTH as u16, HEIGHT as u16, ColorType::Rgb).unwrap();
    bytes
}

/// Returns the largest difference between two pictures, of one channel of a pixel.
fn difference(a: &ColourImage, b: &ColourImage) -> u8 {
    assert_eq!(a.size(), b.size());
    let pairs = a.channels().iter().zip(b.channels());
    pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

fn grey(column: usize, row: usize) -> u8 {
    (7 * column + 3 * row) as u8
}

fn grey16(column: usize, row: usize) -> u16 {
    (2999 * column + 101 * row + 3) as u16
}

/// A 16-bit sample as a colour picture has it: of 8 bits, rounded.
fn eight(sample: u16) -> u8 {
    (f64::from(sample) / 257.0).round() as u8
}

#[test]
fn a_png_of_any_type_is_a_colour_picture() {
    let alpha = |column: usize| (column * 12) as u8;
    let eight_bits = [
        (Png::Rgb, samples(rgb), picture(rgb)),
        (
            Png::Rgba,
            samples(|c, r| {
                let [red, green, blue] = rgb(c, r);
                [red, green, blue, alpha(c)]
            }),
            picture(rgb),
        ),
        (Png::Grayscale, samples(|c, r| [grey(c, r)]), picture(|c, r| [grey(c, r); 3])),
        (
            Png::GrayscaleAlpha,
            samples(|c, r| [grey(c, r), alpha(c)]),
            picture(|c, r| [grey(c, r); 3]),
        ),
    ];
    for (kind, rows, expected) in eight_bits {
        let bytes = plain_png(kind, BitDepth::Eight, &rows);
        assert_eq!(colour(&bytes), Ok(expected), "{kind:?}");
    }
}

#[test]
fn a_colour_picture_of_16_bits_is_reduced_to_8() {
    let [red, green, blue] =
        [grey16, |c, r| grey16(r, c).wrapping_mul(3), |c, r| 65_535 - grey16(c, r)];
    let wide = |c, r| [red(c, r), green(c, r), blue(c, r)];
    let expected = picture(|c, r| wide(c, r).map(eight));
    let bytes = |c, r| <[u8; 6]>::try_from(wide(c, r).map(u16::to_be_bytes).as_flattened());
    let rows = samples(|c, r| bytes(c, r).unwrap());
    assert_eq!(colour(&plain_png(Png::Rgb, BitDepth::Sixteen, &rows)), Ok(expected.clone()));
    let with_alpha = samples(|c, r| {
        let [r0, r1, g0, g1, b0, b1] = bytes(c, r).unwrap();
        [r0, r1, g0, g1, b0, b1, 9, 9]
    });
    assert_eq!(colour(&plain_png(Png::Rgba, BitDepth::Sixteen, &with_alpha)), Ok(expected));
    let expected = picture(|c, r| [eight(grey16(c, r)); 3]);
    let rows = samples(|c, r| grey16(c, r).to_be_bytes());
    assert_eq!(colour(&plain_png(Png::Grayscale, BitDepth::Sixteen, &rows)), Ok(expected.clone()));
    let rows = samples(|c, r| {
        let [high, low] = grey16(c, r).to_be_bytes();
        [high, low, 200, 200]
    });
    assert_eq!(colour(&plain_png(Png::GrayscaleAlpha, BitDepth::Sixteen, &rows)), Ok(expected));
}

#[test]
fn few_bits_and_palettes_are_read() {
    for (bits, depth) in [(1, BitDepth::One), (2, BitDepth::Two), (4, BitDepth::Four)] {
        let largest = (1 << bits) - 1;
        let sample = |c: usize, r: usize| ((c + 3 * r) % (largest as usize + 1)) as u8;
        let rows = packed(bits, sample);
        let expected = picture(|c, r| [(255 * u16::from(sample(c, r)) / largest) as u8; 3]);
        assert_eq!(colour(&plain_png(Png::Grayscale, depth, &rows)), Ok(expected), "{bits} bits");
    }
    for (bits, depth) in
        [(1, BitDepth::One), (2, BitDepth::Two), (4, BitDepth::Four), (8, BitDepth::Eight)]
    {
        let colours: Vec<[u8; 3]> = (0..1 << bits).map(|i| rgb(i % WIDTH, i % HEIGHT)).collect();
        let index = |c: usize, r: usize| (c + 5 * r) % colours.len();
        let rows = packed(bits, |c, r| index(c, r) as u8);
        let expected = picture(|c, r| colours[index(c, r)]);
        for transparent in [None, Some(vec![0, 128])] {
            let bytes = png_file(Png::Indexed, depth, &rows, |encoder| {
                encoder.set_palette(colours.as_flattened().to_vec());
                if let Some(alphas) = &transparent {
                    encoder.set_trns(alphas.clone());
                }
            });
            assert_eq!(colour(&bytes), Ok(expected.clone()), "{bits} bits, {transparent:?}");
        }
    }
}

#[test]
fn a_transparent_colour_stays_what_it_is() {
    let key = [0, 20, 0, 30, 0, 200];
    let bytes = png_file(Png::Rgb, BitDepth::Eight, &samples(rgb), |encoder| {
        encoder.set_trns(key.to_vec());
    });
    assert_eq!(colour(&bytes), Ok(picture(rgb)));
}

#[test]
fn a_depth_picture_stays_16_bit() {
    let expected = Image::from_fn(WIDTH, HEIGHT, grey16);
    let rows = samples(|c, r| grey16(c, r).to_be_bytes());
    assert_eq!(depth(&plain_png(Png::Grayscale, BitDepth::Sixteen, &rows)), Ok(expected.clone()));
    // The largest value that a PGM file states scales nothing.
    let file = [b"P5\n21 13\n65000\n", &rows[..]].concat();
    assert_eq!(depth(&file), Ok(expected));
    for other in [
        plain_png(Png::Grayscale, BitDepth::Eight, &samples(|c, r| [grey(c, r)])),
        plain_png(Png::Rgb, BitDepth::Eight, &samples(rgb)),
        plain_png(Png::GrayscaleAlpha, BitDepth::Sixteen, &[0; 4 * WIDTH * HEIGHT]),
        jpeg_file(|_| ()),
        [b"P5 21 13 255 ", &samples(|c, r| [grey(c, r)])[..]].concat(),
        [b"P6 21 13 65535 ", &[0; 6 * WIDTH * HEIGHT][..]].concat(),
    ] {
        let error = depth(&other).unwrap_err().to_string();
        assert!(error.contains("16-bit with one channel"), "{error}");
    }
}

/// Returns zlib data that holds `bytes` uncompressed.
fn stored(bytes: &[u8]) -> Vec<u8> {
    let length = u16::try_from(bytes.len()).unwrap();
    let (mut a, mut b) = (1_u32, 0_u32);
    for &byte in bytes {
        a = (a + u32::from(byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    let mut data = vec![0x78, 0x01, 0x01];
    data.extend(length.to_le_bytes());
    data.extend((!length).to_le_bytes());
    data.extend(bytes);
    data.extend((b << 16 | a).to_be_bytes());
    data
}

/// Returns an interlaced PNG file with one byte in a sample.
fn interlaced(kind: Png, per_pixel: usize, rows: &[u8]) -> Vec<u8> {
    // First column and row of each pass, and their steps (RFC 2083, 2.6).
    let passes =
        [[0, 0, 8, 8], [4, 0, 8, 8], [0, 4, 4, 8], [2, 0, 4, 4], [0, 2, 2, 4], [1, 0, 2, 2]];
    let mut data = Vec::new();
    for [left, top, across, down] in passes.into_iter().chain([[0, 1, 1, 2]]) {
        for row in (top..HEIGHT).step_by(down) {
            data.push(0);
            for column in (left..WIDTH).step_by(across) {
                let at = (row * WIDTH + column) * per_pixel;
                data.extend(&rows[at..at + per_pixel]);
            }
        }
    }
    let mut info = Info::with_size(WIDTH as u32, HEIGHT as u32);
    (info.color_type, info.interlaced) = (kind, true);
    info.bit_depth = if kind == Png::Grayscale { BitDepth::Sixteen } else { BitDepth::Eight };
    let mut bytes = Vec::new();
    let mut writer = ::png::Encoder::with_info(&mut bytes, info).unwrap().write_header().unwrap();
    writer.write_chunk(::png::chunk::IDAT, &stored(&data)).unwrap();
    drop(writer);
    bytes
}

#[test]
fn an_interlaced_png_is_read() {
    assert_eq!(colour(&interlaced(Png::Rgb, 3, &samples(rgb))), Ok(picture(rgb)));
    let rows = samples(|c, r| grey16(c, r).to_be_bytes());
    let expected = Image::from_fn(WIDTH, HEIGHT, grey16);
    assert_eq!(depth(&interlaced(Png::Grayscale, 2, &rows)), Ok(expected));
}

#[test]
fn a_jpeg_of_any_sampling_is_read() {
    for sampling in [SamplingFactor::F_1_1, SamplingFactor::F_2_1, SamplingFactor::F_2_2] {
        for progressive in [false, true] {
            for restart in [0, 2] {
                let bytes = jpeg_file(|encoder| {
                    encoder.set_sampling_factor(sampling);
                    encoder.set_progressive(progressive);
                    encoder.set_restart_interval(restart);
                });
                let worst = difference(&colour(&bytes).unwrap(), &picture(rgb));
                assert!(worst <= 20, "{sampling:?} {progressive} {restart}: {worst}");
                if sampling == SamplingFactor::F_1_1 {
                    assert!(worst <= 2, "{progressive} {restart}: {worst}");
                }
            }
        }
    }
}

/// The brightness of a pixel, 0 to 255.
fn brightness(&[b, g, r]: &[u8; 3]) -> f64 {
    0.114 * f64::from(b) + 0.587 * f64::from(g) + 0.299 * f64::from(r)
}

#[test]
fn a_jpeg_has_the_pixels_that_libjpeg_gives() {
    // Files that libjpeg-turbo wrote, and their pixels as it decodes them, alone and in OpenCV:
    // `Image.open("420.jpg").save("420.ppm")` of Python's Pillow gives them.
    for (jpeg, ppm) in [
        (
            &include_bytes!("../../tests/pictures/420.jpg")[..],
            &include_bytes!("../../tests/pictures/420.ppm")[..],
        ),
        (
            include_bytes!("../../tests/pictures/422-progressive.jpg"),
            include_bytes!("../../tests/pictures/422-progressive.ppm"),
        ),
    ] {
        let (ours, theirs) = (colour(jpeg).unwrap(), colour(ppm).unwrap());
        let pairs = ours.pixels().iter().zip(theirs.pixels());
        let grey = pairs.map(|(a, b)| (brightness(a) - brightness(b)).abs()).fold(0.0, f64::max);
        assert!(grey <= 2.0, "{grey}");
        let worst = difference(&ours, &theirs);
        assert!(worst <= 4, "{worst}");
    }
}

#[test]
fn a_grey_jpeg_is_read() {
    let mut bytes = Vec::new();
    let (rows, size) = (samples(|c, r| [grey(c, r)]), (WIDTH as u16, HEIGHT as u16));
    Encoder::new(&mut bytes, 100).encode(&rows, size.0, size.1, ColorType::Luma).unwrap();
    let worst = difference(&colour(&bytes).unwrap(), &picture(|c, r| [grey(c, r); 3]));
    assert!(worst <= 1, "{worst}");
}

/// An EXIF segment with the orientation `turn` (TIFF tag 0x112), little-endian.
fn exif(turn: u8) -> Vec<u8> {
    let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, turn, 0, 0, 0];
    [b"Exif\0\0II*\0\x08\0\0\0\x01\0", &entry[..], &[0; 4]].concat()
}

#[test]
fn no_picture_is_turned() {
    let plain = colour(&jpeg_file(|_| ()));
    for turn in 1..=8 {
        let bytes = jpeg_file(|encoder| encoder.add_app_segment(1, exif(turn)).unwrap());
        assert_eq!(colour(&bytes), plain, "orientation {turn}");
    }
}

/// Returns a JPEG file without its segments with this marker.
fn without(marker: u8, bytes: &[u8]) -> Vec<u8> {
    let (mut kept, mut rest) = (bytes[..2].to_vec(), &bytes[2..]);
    while rest[1] != 0xda {
        let (segment, next) = rest.split_at(2 + usize::from(rest[2]) * 256 + usize::from(rest[3]));
        if segment[1] != marker {
            kept.extend(segment);
        }
        rest = next;
    }
    kept.extend(rest);
    kept
}

#[test]
fn a_picture_of_a_webcam_without_huffman_tables_has_the_standard_ones() {
    let whole = jpeg_file(|encoder| encoder.set_sampling_factor(SamplingFactor::F_2_1));
    let bare = without(0xc4, &whole);
    assert!(bare.len() + 400 < whole.len());
    assert_eq!(colour(&bare), colour(&whole));
}

#[test]
fn jpegs_of_other_kinds_are_refused_by_name() {
    let mut cmyk = Vec::new();
    let rows = samples(|c, r| [grey(c, r); 4]);
    Encoder::new(&mut cmyk, 90).encode(&rows, 21, 13, ColorType::Cmyk).unwrap();
    // The frame header: its marker, and the bits of a sample after marker and length.
    let edited = |at: usize, byte: u8| {
        let mut bytes = jpeg_file(|_| ());
        let frame = bytes.windows(2).position(|bytes| bytes == [0xff, 0xc0]).unwrap();
        bytes[frame + at] = byte;
        bytes
    };
    for (bytes, named) in [
        (cmyk, "4 colours (CMYK)"),
        (edited(4, 12), "12 bits"),
        (edited(1, 0xc3), "lossless"),
        (edited(1, 0xc9), "arithmetic"),
    ] {
        let error = colour(&bytes).unwrap_err().to_string();
        assert!(error.contains(named), "{named:?} in {error:?}");
    }
}

#[test]
fn netpbm_pictures_are_read() {
    let greys = picture(|c, r| [grey(c, r); 3]);
    let wide = samples(|c, r| grey16(c, r).to_be_bytes());
    let text = |values: Vec<u8>| {
        values.iter().map(|value| format!("{value}\n")).collect::<String>().into_bytes()
    };
    let cases: [(&[u8], Vec<u8>, ColourImage); 6] = [
        (b"P6\n# made by a test\n21 13 # columns and rows\n255\n", samples(rgb), picture(rgb)),
        (b"P5 21 13 255\n", samples(|c, r| [grey(c, r)]), greys.clone()),
        (b"P5\t21\r\n13 65535 ", wide, picture(|c, r| [eight(grey16(c, r)); 3])),
        (b"P6 21 13 1 ", vec![1; 3 * WIDTH * HEIGHT], picture(|_, _| [255; 3])),
        (b"P2 21 13 255\n", text(samples(|c, r| [grey(c, r)])), greys),
        (b"P3 21 13 255\n", text(samples(rgb)), picture(rgb)),
    ];
    for (header, pixels, expected) in cases {
        let bytes = [header, &pixels].concat();
        assert_eq!(colour(&bytes).as_ref(), Ok(&expected), "{}", header.escape_ascii());
        assert_eq!(size(&bytes), Some(expected.size()));
        // The last sample lacks a byte; of a text its end is missing too.
        let short = &bytes[..bytes.len() - if bytes[1] < b'4' { 5 } else { 1 }];
        assert_eq!(colour(short), Err(DecodeError::Damaged), "{}", header.escape_ascii());
    }
    // The first pixels look like spaces.
    let spaces = [b"P5 21 13 255\n", &[b' '; WIDTH * HEIGHT][..]].concat();
    assert_eq!(colour(&spaces), Ok(Image::filled(WIDTH, HEIGHT, [b' '; 3])));
}
