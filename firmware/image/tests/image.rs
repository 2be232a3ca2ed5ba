//! Tests of the UF2 file and of the comparison with the record of sizes.

use plumb_image::chip::RP2040;
use plumb_image::{Image, ImageError, Sizes, Usage, recorded, uf2};

const START: u32 = 0x1000_0000;

fn word(file: &[u8], at: usize) -> u32 {
    (0..4).fold(0, |word, i| word | u32::from(file[at + i]) << (8 * i))
}

#[test]
fn every_byte_of_the_flash_is_in_its_block() {
    let flash: Vec<u8> = (0..1000u32).map(|i| (i * 7) as u8).collect();
    let file = uf2::file(&RP2040, &flash);
    assert_eq!(file.len(), 4 * uf2::BLOCK);
    let mut back = Vec::new();
    for (index, block) in file.chunks(uf2::BLOCK).enumerate() {
        assert_eq!(
            [word(block, 0), word(block, 4), word(block, 508)],
            [0x0a324655, 0x9e5d5157, 0x0ab16f30]
        );
        assert_eq!(word(block, 8), 0x2000, "the family is given");
        assert_eq!(word(block, 12), START + 256 * index as u32);
        assert_eq!([word(block, 16), word(block, 20), word(block, 24)], [256, index as u32, 4]);
        assert_eq!(word(block, 28), 0xe48bff56, "RP2040");
        back.extend_from_slice(&block[32..288]);
    }
    assert_eq!(&back[..1000], flash);
    assert!(back[1000..].iter().all(|&b| b == 0xff));
}

#[test]
fn files_other_than_firmware_are_refused() {
    assert!(matches!(
        Image::read(b"PK\x03\x04 a zip file, not an ELF", &RP2040),
        Err(ImageError::NotElf(_))
    ));
    assert!(matches!(Image::read(&[], &RP2040), Err(ImageError::NotElf(_))));
}

#[test]
fn growth_of_more_than_2_percent_fails() {
    let room = Sizes { flash: 2_000_000, ram: 200_000 };
    let record = recorded("# Sizes\nrp2350 7 8\nrp2040 1000 500\n", "rp2040");
    assert_eq!(record, Some(Sizes { flash: 1000, ram: 500 }));
    let has_grown = |flash, statics| {
        let image = Image { flash: vec![0; flash], statics, stack: 20, room };
        Usage::new(&image, record.unwrap()).has_grown()
    };
    assert!(!has_grown(1020, 510));
    assert!(!has_grown(1, 1));
    assert!(has_grown(1021, 500));
    assert!(has_grown(1000, 511));
}

#[test]
fn a_record_without_the_chip_or_a_size_is_none() {
    assert_eq!(recorded("rp2350 1 2\n", "rp2040"), None);
    assert_eq!(recorded("rp2040 1\n", "rp2040"), None);
    assert_eq!(recorded("rp2040 1 many\n", "rp2040"), None);
}
