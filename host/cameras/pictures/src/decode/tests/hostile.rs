//! Tests of the decoding of pictures that are damaged, too large, or made to do harm.

use super::*;

#[test]
fn damaged_netpbm_pictures_are_refused() {
    for bytes in [
        &b"P5 1 1 0 a"[..],
        b"P5 1 1 65536 aa",
        b"P5 1 1 100 e",
        b"P5 -1 1 255 a",
        b"P5 1 1 255",
        b"P5 0 1 255 a",
        b"P2 1 1 255 300",
        b"P2 1 1 255 x",
        b"P2 2 1 255 1",
        b"P5 99999999999999999999 1 255 a",
        b"P5 1 1 255# comment",
        b"P4 1 1 a",
        b"P7 1 1 255 a",
        b"P5",
    ] {
        assert_eq!(colour(bytes), Err(DecodeError::Damaged), "{}", bytes.escape_ascii());
    }
}

/// One file of each format.
fn formats() -> [Vec<u8>; 6] {
    [
        plain_png(Png::Rgb, BitDepth::Eight, &samples(rgb)),
        plain_png(Png::Grayscale, BitDepth::Sixteen, &[7; 2 * WIDTH * HEIGHT]),
        interlaced(Png::Rgb, 3, &samples(rgb)),
        jpeg_file(|_| ()),
        jpeg_file(|encoder| encoder.set_progressive(true)),
        [b"P6 21 13 255 ", &samples(rgb)[..]].concat(),
    ]
}

#[test]
fn the_size_is_read_from_the_header() {
    for bytes in formats() {
        assert_eq!(size(&bytes), Some(ImageSize { width: WIDTH, height: HEIGHT }));
        // Wherever the header is cut there is no size, and no panic.
        let header = (0..bytes.len()).find(|&length| size(&bytes[..length]).is_some()).unwrap();
        assert!((13..bytes.len()).contains(&header), "{header}");
    }
    for other in
        [&b""[..], b"\xff\xd8", b"\xff\xd8\xff\xda\0\x02", b"\x89PNG\r\n\x1a\n", b"GIF89a  "]
    {
        assert_eq!(size(other), None, "{other:?}");
    }
}

#[test]
fn a_truncated_picture_is_refused_wherever_it_ends() {
    for bytes in formats() {
        assert!(colour(&bytes).is_ok());
        for length in 0..bytes.len() {
            let error = colour(&bytes[..length]).unwrap_err();
            assert!(
                matches!(error, DecodeError::Damaged | DecodeError::Truncated),
                "{length} of {}: {error}",
                bytes.len()
            );
        }
    }
}

#[test]
fn a_jpeg_without_its_end_is_refused() {
    let jpeg = jpeg_file(|_| ());
    let padded = [&jpeg[..], &[0; 9]].concat();
    assert!([&jpeg, &padded].into_iter().all(|bytes| colour(bytes).is_ok()));
    // The end of a small picture in a segment before the frame header is another one.
    let segment = b"\xff\xd8\xff\xe1\x00\x04\xff\xd9";
    let nested = [&segment[..], &jpeg[2..]].concat();
    assert!(colour(&nested).is_ok());
    for bytes in [&jpeg[..jpeg.len() - 2], &nested[..nested.len() - 2]] {
        assert_eq!(colour(bytes), Err(DecodeError::Truncated));
    }
}

#[test]
fn a_jpeg_with_impossible_codes_is_refused() {
    for progressive in [false, true] {
        let mut jpeg = jpeg_file(|encoder| encoder.set_progressive(progressive));
        // Sixteen bits of 1 are no Huffman code.
        let middle = jpeg.len() - 60;
        jpeg[middle..middle + 40].copy_from_slice(&[0xff, 0].repeat(20));
        assert_eq!(colour(&jpeg), Err(DecodeError::Damaged), "progressive: {progressive}");
    }
}

#[test]
fn a_jpeg_whose_products_overflow_stops_nothing() {
    // Two blocks of grey, each brighter than the one before by 32767, in units of 65535.
    let mut jpeg = b"\xff\xd8\xff\xdb\x00\x83\x10".to_vec();
    jpeg.extend([0xff; 128]);
    jpeg.extend(b"\xff\xc0\x00\x0b\x08\x00\x08\x00\x10\x01\x01\x11\x00");
    // Huffman tables of one code each, the bit 0: 15 more bits, and the end of the block.
    for (table, symbol) in [(0x00, 15), (0x10, 0)] {
        jpeg.extend([0xff, 0xc4, 0, 20, table, 1]);
        jpeg.extend([0; 15]);
        jpeg.push(symbol);
    }
    jpeg.extend(b"\xff\xda\x00\x08\x01\x01\x00\x00\x3f\x00");
    jpeg.extend(b"\x7f\xff\x00\x3f\xff\x00\xbf\xff\xd9");
    assert_eq!(colour(&jpeg).map(|image| image.size()), Ok(ImageSize { width: 16, height: 8 }));
}

#[test]
fn a_picture_that_is_too_large_is_refused_before_it_is_decoded() {
    let [mut png, _, _, mut jpeg, ..] = formats();
    png[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let frame = jpeg.windows(2).position(|bytes| bytes == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xff; 4]);
    for bytes in [png, jpeg, b"P6 65535 65535 255 ".to_vec(), b"P2 65535 65535 1 ".to_vec()] {
        let error = colour(&bytes).unwrap_err().to_string();
        assert_eq!(error, "65535x65535 pixels; at most 50000000 are decoded");
    }
    let endless = b"P5 18446744073709551615 18446744073709551615 255 ";
    assert!(matches!(colour(endless), Err(DecodeError::TooManyPixels { .. })));
}

#[test]
fn a_header_that_promises_more_than_the_file_has_takes_no_memory() {
    // 150 MB of pixels. The netpbm picture is refused by the length of the file.
    let start = [b"P6 7000 7000 255 ", &[0; 1000][..]].concat();
    assert_eq!(colour(&start), Err(DecodeError::Damaged));
    assert_eq!(colour(b"P3 7000 7000 255 1 2 3"), Err(DecodeError::Damaged));
}

#[test]
fn what_is_no_pixel_of_a_png_is_not_unpacked() {
    let whole = plain_png(Png::Rgb, BitDepth::Eight, &samples(rgb));
    // A profile and a text of a name and zlib data, which is damaged, after the header.
    for (name, start) in [(*b"iCCP", &b"name\0\0"[..]), (*b"zTXt", b"name\0\0")] {
        let mut info = Vec::new();
        let mut writer = ::png::Encoder::new(&mut info, 1, 1).write_header().unwrap();
        writer
            .write_chunk(::png::chunk::ChunkType(name), &[start, b"no zlib data"].concat())
            .unwrap();
        drop(writer);
        let chunk = &info[33..info.len() - 12];
        let bytes = [&whole[..33], chunk, &whole[33..]].concat();
        assert_eq!(colour(&bytes), Ok(picture(rgb)), "{}", name.escape_ascii());
    }
}

#[test]
fn endless_scans_are_refused() {
    let jpeg = jpeg_file(|encoder| encoder.set_progressive(true));
    let last = jpeg.windows(2).rposition(|bytes| bytes == [0xff, 0xda]).unwrap();
    let end = jpeg.len() - 2;
    let with_scans = |count: usize| {
        let scans = jpeg[last..end].repeat(count);
        [&jpeg[..last], &scans, &jpeg[end..]].concat()
    };
    assert!(colour(&with_scans(10)).is_ok());
    assert_eq!(colour(&with_scans(200)), Err(DecodeError::Damaged));
}

#[test]
fn a_damaged_png_is_refused() {
    let whole = plain_png(Png::Rgb, BitDepth::Eight, &samples(rgb));
    for at in [50, whole.len() / 2, whole.len() - 30] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x40;
        assert_eq!(colour(&bytes), Err(DecodeError::Damaged), "byte {at}");
    }
}
