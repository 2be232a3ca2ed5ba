//! Tests of TUM RGB-D folders.

use plumb_config::error_chain::ErrorChain;
use plumb_frame::image::Image;
use plumb_pictures::png::encode_depth;
use tempfile::TempDir;

use super::*;
use crate::playback::Playback;
use crate::png;

const INTRINSICS: Intrinsics =
    Intrinsics { fx: 500.0, fy: 500.0, cx: 15.5, cy: 11.5, depth_scale: 5000.0, distortion: None };

fn save_colour(folder: &TempDir, name: &str, width: usize, value: u8) {
    png::save(&folder.path().join(name), &Image::filled(width, 24, [value; 3])).unwrap();
}

fn save_depth(folder: &TempDir, name: &str, width: usize, value: u16) {
    let bytes = encode_depth(&Image::filled(width, 24, value)).unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
}

fn recording(colours: &str, depths: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rgb.txt"), colours).unwrap();
    std::fs::write(folder.path().join("depth.txt"), depths).unwrap();
    for i in 0..4 {
        save_colour(&folder, &format!("c{i}.png"), 32, i);
        save_depth(&folder, &format!("d{i}.png"), 32, 1000 + u16::from(i));
    }
    folder
}

/// (time, blue of the first pixel, depth units of the first pixel) or the error's text, to the
/// end.
fn read_all(folder: &TempDir) -> Vec<Result<(f64, u8, u16), String>> {
    let mut source = TumFolder::open(folder.path(), INTRINSICS).unwrap();
    let mut all = Vec::new();
    loop {
        match source.next_frame() {
            Ok(None) => return all,
            Ok(Some(f)) => {
                let blue = f.colour().get(0, 0).unwrap()[0];
                all.push(Ok((f.time(), blue, f.depth().get(0, 0).unwrap())));
            }
            Err(e) => all.push(Err(ErrorChain(&e).to_string())),
        }
    }
}

/// As converters write it where a camera sees nothing.
#[test]
fn the_largest_number_is_an_unknown_depth() {
    let folder = recording("1.0 c0.png\n2.0 c1.png\n", "1.0 d0.png\n2.0 d1.png\n");
    save_depth(&folder, "d0.png", 32, u16::MAX);
    save_depth(&folder, "d1.png", 32, u16::MAX - 1);
    assert_eq!(read_all(&folder), [Ok((1.0, 0, 0)), Ok((2.0, 1, u16::MAX - 1))]);
}

#[test]
fn colour_and_depth_are_paired_by_nearest_time() {
    let rgb = "# timestamp path\n10.000 c0.png\n10.033 c1.png\n10.066 c2.png\n10.100 c3.png\n";
    // Not in order, one dropped, one 15 ms late, one 21 ms late.
    let depth = "10.048 d1.png\n\n10.002 d0.png\n10.121000 d3.png\n";
    let frames = read_all(&recording(rgb, depth));
    let expected = [(10.0, 0, 1000), (10.033, 1, 1001), (10.066, 2, 1001), (10.1, 3, 0)];
    assert_eq!(frames, expected.map(Ok));
}

#[test]
fn pictures_come_in_the_order_of_their_times() {
    let rgb = "0.0 c0.png\n0.2 c2.png\nx\n0.1 c1.png\n0.3 c3.png\n";
    let depth = "0.3 d3.png\n0.0 d0.png\n0.1 d1.png\n0.2 d2.png\n";
    let all = read_all(&recording(rgb, depth));
    assert!(all[3].as_ref().is_err_and(|error| error.contains("rgb.txt:3: ")), "{all:?}");
    let frames: Vec<_> = all.into_iter().filter_map(Result::ok).collect();
    assert_eq!(frames, [(0.0, 0, 1000), (0.1, 1, 1001), (0.2, 2, 1002), (0.3, 3, 1003)]);
}

#[test]
fn lists_of_tum_s_own_tools_and_other_names_are_read() {
    let folder = recording("", "");
    let path = |name| folder.path().join(name);
    std::fs::remove_file(path("rgb.txt")).unwrap();
    std::fs::remove_file(path("depth.txt")).unwrap();
    std::fs::rename(path("c3.png"), path("c 3.png")).unwrap();
    let colour = "0.0,c0.png\n0.1, c1.png, 7\n0.2\tc2.png 0.2 d2.png\n0.3 c 3.png\n";
    std::fs::write(path("color.txt"), colour).unwrap();
    std::fs::write(path("aligned_depth.txt"), "0.0,d0.png\n0.1 d1.png extra\n").unwrap();
    let expected = [(0.0, 0, 1000), (0.1, 1, 1001), (0.2, 2, 0), (0.3, 3, 0)];
    assert_eq!(read_all(&folder), expected.map(Ok));
}

#[test]
fn a_recording_without_depth_is_that_of_a_camera_without_depth() {
    let folder = recording("0.0 c0.png\n", "");
    std::fs::remove_file(folder.path().join("depth.txt")).unwrap();
    let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err().to_string();
    assert!(error.contains("depth.txt or aligned_depth.txt"), "{error}");
    assert!(error.contains("depth_scale = \"none\""), "{error}");
    let flat = Intrinsics { depth_scale: 0.0, ..INTRINSICS };
    let mut source = TumFolder::open(folder.path(), flat).unwrap();
    assert_eq!(source.next_frame().unwrap().unwrap().time(), 0.0);
    std::fs::remove_file(folder.path().join("rgb.txt")).unwrap();
    let error = TumFolder::open(folder.path(), flat).unwrap_err().to_string();
    assert!(error.contains("has no rgb.txt or color.txt or colour.txt"), "{error}");
}

#[test]
fn broken_files_are_named_and_reading_goes_on() {
    let rgb = "0.0 c0.png\nx c1.png\n0.1 gone.png\n0.2\n0.3 torn.png\n0.4 grey.pgm\n0.5 wide.png\n\
               0.6 c2.png\n0.7 c3.png\n0.8 c1.png\n0.9 both.png\n1.0 c3.png\n";
    let depth = "0.0 d0.png\n0.1 d1.png\nnan d2.png\n0.3 d1.png\n0.4 d1.png\n0.5 d1.png\n\
                     0.6 d8.pgm\n0.7 dgone.png\n0.8 d1.png\n0.9 dboth.png\n1.0 d3.png\n";
    let folder = recording(rgb, depth);
    let good = std::fs::read(folder.path().join("c0.png")).unwrap();
    std::fs::write(folder.path().join("torn.png"), &good[..good.len() / 2]).unwrap();
    let grey = [b"P5 32 24 255 ", &[7; 32 * 24][..]].concat();
    for name in ["grey.pgm", "d8.pgm"] {
        std::fs::write(folder.path().join(name), &grey).unwrap();
    }
    save_colour(&folder, "wide.png", 40, 1);
    save_colour(&folder, "both.png", 40, 1);
    save_depth(&folder, "dboth.png", 40, 1);
    let all = read_all(&folder);
    let expected = [
        Err("depth.txt:3: "),
        Ok((0.0, 0, 1000)),
        Err("rgb.txt:2: "),
        Err("gone.png: cannot be read"),
        Err("rgb.txt:4: "),
        Err("torn.png: not a picture"),
        Ok((0.4, 7, 1001)),
        Err("d1.png: no frame can be made of the images: the colour picture is 40x24 but"),
        Err("d8.pgm: the depth picture must be 16-bit"),
        Err("dgone.png: cannot be read"),
        Ok((0.8, 1, 1001)),
        Err("both.png: 40x24, but the recording's first picture is 32x24"),
        Ok((1.0, 3, 1003)),
    ];
    assert_eq!(all.len(), expected.len(), "{all:#?}");
    for (got, want) in all.iter().zip(expected) {
        match (got, want) {
            (Err(got), Err(want)) => assert!(got.contains(want), "{want:?} in {got:?}"),
            (got, want) => assert_eq!(got.clone().ok(), want.ok(), "{got:?} {want:?}"),
        }
    }
}

#[test]
fn what_a_list_names_must_be_a_regular_file() {
    let rgb = "0.0 pipe.png\n0.1 /dev/zero\n0.2 .\n0.3 c3.png\n";
    let folder = recording(rgb, "0.3 d3.png\n");
    nix::unistd::mkfifo(&folder.path().join("pipe.png"), nix::sys::stat::Mode::S_IRWXU).unwrap();
    let all = read_all(&folder);
    for (got, named) in
        all.iter().zip(["pipe.png: is a named pipe", "/dev/zero: is a device", "is a folder"])
    {
        let error = got.as_ref().unwrap_err();
        assert!(
            error.contains(named) && error.contains("must be a regular file"),
            "{named:?} in {error:?}"
        );
    }
    assert_eq!(all[3..], [Ok((0.3, 3, 1003))]);
}

#[test]
fn a_long_line_is_not_quoted_whole() {
    let all = read_all(&recording(&"x".repeat(100_000), ""));
    assert!(all[0].as_ref().is_err_and(|error| error.len() < 400), "{all:?}");
}

#[test]
fn time_stamps_that_are_no_seconds_are_refused() {
    let all = read_all(&recording(
        "1e19 c0.png\n1305031102175304000 c1.png\n1305031102.175304 c2.png\n",
        "",
    ));
    assert!(all[0].as_ref().is_err_and(|error| error.contains("rgb.txt:1: ")), "{all:?}");
    assert!(all[1].as_ref().is_err_and(|error| error.contains("rgb.txt:2: ")), "{all:?}");
    assert_eq!(all[2..], [Ok((1_305_031_102.175_304, 2, 0))]);
}

#[test]
fn a_list_that_is_too_long_is_refused() {
    let folder = recording("", "");
    std::fs::write(folder.path().join("rgb.txt"), "0 c0.png\n".repeat(MAX_LINES)).unwrap();
    assert_eq!(TumFolder::open(folder.path(), INTRINSICS).unwrap().pending.len(), MAX_LINES);
    std::fs::write(folder.path().join("rgb.txt"), "0 c0.png\n".repeat(MAX_LINES + 1)).unwrap();
    let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err().to_string();
    assert!(error.contains("rgb.txt: it has more than 1000000 lines"), "{error}");
    let large = std::fs::File::create(folder.path().join("rgb.txt")).unwrap();
    large.set_len(MAX_LIST_BYTES + 1).unwrap();
    let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err().to_string();
    assert!(error.contains("rgb.txt: is too large"), "{error}");
}

#[test]
fn a_folder_without_lists_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = TumFolder::open(folder.path(), INTRINSICS).unwrap_err();
    assert!(error.to_string().contains("has no rgb.txt"), "{error}");
}

#[test]
fn the_clock_stands_at_the_last_frame() {
    let folder = recording("10.0 c0.png\n10.5 gone.png\n", "");
    let mut source = TumFolder::open(folder.path(), INTRINSICS).unwrap();
    assert!(!source.is_live());
    assert_eq!(source.now(), 0.0);
    assert!(source.next_frame().is_ok());
    assert_eq!(source.now(), 10.0);
    let lost = source.next_frame().unwrap_err();
    assert_eq!((lost.stamp(), lost.is_over(), source.now()), (Some(10.5), false, 10.5));
    assert!(Playback::new(source).is_live());
}

/// Returns the colour and the depth of each frame of an association file in this order of fields.
fn associated(lines: &str) -> Vec<(f64, u8, u16)> {
    let folder = tempfile::tempdir().unwrap();
    for (name, value) in [("a.png", 10), ("b.png", 20)] {
        save_colour(&folder, name, 32, value);
        let depth = format!("depth_{name}");
        save_depth(&folder, &depth, 32, u16::from(value) * 100);
    }
    std::fs::write(folder.path().join("associations.txt"), lines).unwrap();
    let mut source = TumFolder::open(folder.path(), INTRINSICS).unwrap();
    let mut found = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        let colour = frame.colour().pixels()[0][0];
        found.push((frame.time(), colour, frame.depth().pixels()[0]));
    }
    found
}

#[test]
fn association_files_pair_the_pictures_in_both_orders() {
    // The pair counts, not the time: 0.5 s are between its pictures.
    let expected = [(1.0, 10, 1000), (2.0, 20, 2000)];
    assert_eq!(associated("2 b.png 2.5 depth_b.png\n# a\n1 a.png 1.5 depth_a.png\n"), expected);
    assert_eq!(associated("1.5 depth_a.png 1 a.png\n2.5 depth_b.png 2 b.png\n"), expected);
}

#[test]
fn a_line_of_an_association_file_that_is_something_else_is_an_error_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("associations.txt"), "1 a.png 1.5\n").unwrap();
    let mut source = TumFolder::open(folder.path(), INTRINSICS).unwrap();
    let error = ErrorChain(&source.next_frame().unwrap_err()).to_string();
    assert!(error.contains("associations.txt:1") && error.contains("path timestamp"), "{error}");
    assert!(source.next_frame().unwrap().is_none());
}
