//! The real firmware in the emulated chip: how USB and picotool name the board, and picotool's
//! reset interface.

#![allow(clippy::expect_used, clippy::panic, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use plumb_image::Image;
use plumb_image::chip::RP2040;
use plumb_protocol::message::{Command, Hello, Jog, StartCause, State};
use plumb_protocol::units::{Acceleration, Milliseconds, Rate, Steps16};
use plumb_protocol::wiring::StepDir;
use plumb_tests::chip::{CYCLES_PER_US, Chip, fast_config, firmware_image};
use serde_json::{Value, json};

/// First address of the flash.
const FLASH: u32 = 0x1000_0000;
/// Types of control transfers: a descriptor from the device; a request to a class's interface.
const DESCRIPTOR: u8 = 0x80;
const TO_INTERFACE: u8 = 0x21;
const GET_DESCRIPTOR: u8 = 6;
/// Requests of the reset interface (pico_usb_reset_interface.h).
const BOOTSEL: u8 = 1;
const RESTART: u8 = 2;

/// Makes a control transfer that receives up to `length` bytes.
fn control(chip: &mut Chip, transfer: [u16; 5]) -> Vec<u8> {
    chip.execute(json!({ "control": transfer }));
    let reply = chip.run_us(3000);
    let hex = reply["control"][0][1].as_str().unwrap_or_else(|| panic!("{transfer:?}: {reply}"));
    let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
    (0..hex.len()).step_by(2).map(byte).collect()
}

/// Returns a descriptor of the device.
fn descriptor(chip: &mut Chip, kind: u16, index: u16, language: u16) -> Vec<u8> {
    let request = [DESCRIPTOR, GET_DESCRIPTOR].map(u16::from);
    control(chip, [request[0], request[1], kind << 8 | index, language, 255])
}

/// Returns the text of a string descriptor.
fn string(chip: &mut Chip, index: u8) -> String {
    let bytes = descriptor(chip, 3, u16::from(index), 0x409);
    let units: Vec<u16> = bytes[2..].chunks(2).map(|c| u16::from_le_bytes([c[0], c[1]])).collect();
    String::from_utf16(&units).expect("UTF-16")
}

#[test]
fn usb_names_the_version_and_the_number_of_the_flash() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let device = descriptor(&mut chip, 1, 0, 0);
    assert_eq!(device[8..12], [0x8a, 0x2e, 0x0a, 0x00], "vendor and product");
    let digits: Vec<u16> = env!("CARGO_PKG_VERSION")
        .split('.')
        .map(|part| u16::from_str_radix(part, 16).expect("a number"))
        .collect();
    let release = digits[0] << 8 | digits[1] << 4 | digits[2];
    assert_eq!(device[12..14], release.to_le_bytes());
    assert_eq!(string(&mut chip, device[14]), "Plumb");
    assert_eq!(string(&mut chip, device[15]), "Plumb board");
    // tests/chip/src/flash.mjs.
    assert_eq!(string(&mut chip, device[16]), "E66118604B7F5A21");
}

/// Returns the number of the reset interface, as picotool looks for it.
fn reset_interface(chip: &mut Chip) -> u16 {
    let all = descriptor(chip, 2, 0, 0);
    let mut rest = &all[..];
    while let [length, kind, number, ..] = *rest {
        if kind == 4 && rest[5..8] == [0xff, 0x00, 0x01] {
            return u16::from(number);
        }
        rest = &rest[usize::from(length)..];
    }
    panic!("no reset interface: {all:02x?}")
}

/// Sends a request to an interface, and runs the chip until it restarts. Checks that the request
/// was accepted before. Returns the reply with the restart.
fn request_reset(chip: &mut Chip, request: u8, interface: u16) -> Value {
    chip.execute(json!({ "control": [TO_INTERFACE, request, 0, interface, 0] }));
    let accepted = |reply: &Value| !reply["control"].is_null() && reply["states"].is_null();
    let restarted = |reply: &Value| !reply["resets"].is_null();
    let mut replies = (0..2000).map(|_| chip.run_us(1000));
    assert!(replies.by_ref().take(5).any(|reply| accepted(&reply)), "an answer");
    replies.find(restarted).expect("a restart")
}

#[test]
fn picotool_restarts_the_board_into_its_bootloader_and_into_its_program() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let interface = reset_interface(&mut chip);

    let reply = request_reset(&mut chip, RESTART, interface);
    assert_eq!(reply["resets"][0][1], "forced", "{reply}");
    chip.wait_for_usb();
    chip.received.clear();
    chip.request(Command::Hello(Hello::OURS));
    let started = plumb_protocol::message::FromBoard::Started(StartCause::Requested);
    assert!(chip.received.contains(&started), "{:?}", chip.received);
    assert_eq!(chip.state(), State::Unconfigured);

    let reply = request_reset(&mut chip, BOOTSEL, interface);
    assert_eq!(reply["resets"][0][1], "bootloader", "{reply}");
}

#[test]
fn requests_to_other_interfaces_and_unknown_requests_change_nothing() {
    let Some(image) = firmware_image() else { return };
    let mut chip = Chip::start(&image);
    let interface = reset_interface(&mut chip);
    for (kind, request, to) in
        [(TO_INTERFACE, BOOTSEL, 1), (TO_INTERFACE, 3, interface), (0x41, BOOTSEL, interface)]
    {
        chip.execute(json!({ "control": [kind, request, 0, to, 0] }));
        let reply = chip.run_us(200_000);
        assert!(reply["resets"].is_null(), "{kind:#x} {request} {to}: {reply}");
        assert_eq!(reply["states"][0][1], "stalled", "{kind:#x} {request} {to}: {reply}");
    }
}

/// The drivers lose their current in the bootloader: a motor that turns must come to rest first.
#[test]
fn motors_ramp_down_before_a_reset_of_picotool() {
    let Some(image) = firmware_image() else { return };
    // Steps/s and steps/s²: a ramp of 0.25 s and 125 steps.
    let (rate, acceleration) = (1000.0, 4000.0);
    let mut config = fast_config(rate, StepDir::TMC2209);
    for motor in &mut config.motors {
        motor.max_acceleration = Acceleration::from_si(acceleration).expect("an acceleration");
    }
    config.deadlines.host = Milliseconds(5000);
    for (request, cause) in [(BOOTSEL, "bootloader"), (RESTART, "forced")] {
        let mut chip = Chip::start(&image);
        let interface = reset_interface(&mut chip);
        let mut chip = chip.configured(config);
        let rate = Rate::from_si(rate).expect("a rate");
        let jog = Jog { motor: 0, distance: Steps16(16 * 10_000), rate };
        assert_eq!(chip.request(Command::Jog(jog)), None);
        chip.run_us(600_000);
        let (begin, from) = (chip.cycle, chip.motors[0]);
        let reply = request_reset(&mut chip, request, interface);
        assert_eq!(reply["resets"][0][1], cause, "{reply}");
        let ms = (chip.cycle - begin) / CYCLES_PER_US / 1000;
        assert!((250..300).contains(&ms), "{cause}: after {ms} ms");
        let steps = chip.motors[0] - from;
        assert!((125.0..150.0).contains(&steps), "{cause}: after {steps} steps");
    }
}

/// Binary info of a firmware, read as picotool reads it (raspberrypi/picotool, `find_binary_info`).
#[derive(Debug, Default)]
struct BinaryInfo {
    /// Texts by their number.
    texts: BTreeMap<u32, String>,
    /// Names of pins by their number.
    pins: BTreeMap<u32, String>,
}

impl BinaryInfo {
    fn read(flash: &[u8]) -> Self {
        let word = |address: u32| {
            let at = (address - FLASH) as usize;
            let bytes = flash[at..at + 4].try_into().expect("four bytes");
            u32::from_le_bytes(bytes)
        };
        let text = |address: u32| {
            let bytes = &flash[(address - FLASH) as usize..];
            let end = bytes.iter().position(|&byte| byte == 0).expect("an end");
            String::from_utf8(bytes[..end].to_vec()).expect("UTF-8")
        };
        let mut starts = (FLASH + 0x100..FLASH + 0x200).step_by(4);
        let header = starts.find(|&address| word(address) == 0x7188_ebf2).expect("a header");
        assert!(header + 20 <= FLASH + 0x200 && word(header + 16) == 0xe71a_a390);
        let mut info = Self::default();
        for entry in (word(header + 4)..word(header + 8)).step_by(4).map(word) {
            let (kind, tag) = (word(entry) & 0xffff, word(entry) >> 16);
            assert_eq!(tag, u32::from(u16::from_le_bytes(*b"RP")));
            match kind {
                6 => drop(info.texts.insert(word(entry + 4), text(word(entry + 8)))),
                9 => {
                    let mask = word(entry + 4);
                    let names = text(word(entry + 8));
                    let names: Vec<&str> = names.split('|').collect();
                    assert_eq!(names.len(), mask.count_ones() as usize);
                    let pins = (0..32).filter(|pin| mask & 1 << pin != 0);
                    info.pins.extend(pins.zip(names.iter().map(|&name| name.to_owned())));
                }
                kind => panic!("an entry of the type {kind}"),
            }
        }
        info
    }
}

#[test]
fn picotool_finds_program_version_and_pins_in_the_image() {
    let Some(path) = firmware_image() else { return };
    let image = Image::read(&fs::read(path).expect("an image"), &RP2040).expect("a firmware");
    let info = BinaryInfo::read(&image.flash);
    // Numbers of the SDK's pico/binary_info/defs.h.
    assert_eq!(info.texts[&0x02031c86], "Plumb board");
    assert_eq!(info.texts[&0x11a9bc3a], env!("CARGO_PKG_VERSION"));
    assert_eq!(info.pins[&15], "EMERGENCY");
    assert_eq!(info.pins[&25], "LED");
    // The drawing of the page has every pin, with the same names.
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/use/board.md");
    let page = fs::read_to_string(page).expect("the page");
    for (pin, names) in info.pins.iter().filter(|&(&pin, _)| pin != 25) {
        let row =
            page.lines().find(|line| line.split(['|', ' ']).any(|word| word == format!("GP{pin}")));
        let row = row.unwrap_or_else(|| panic!("the drawing lacks GP{pin}"));
        for name in names.split(" or ") {
            let squeezed = row.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(squeezed.contains(name), "GP{pin} {name}: {squeezed}");
        }
    }
    assert_eq!(info.pins.len(), 19);
}
