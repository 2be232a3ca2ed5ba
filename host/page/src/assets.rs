//! The files of the page, which are part of the program.

/// A file of the page.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asset {
    path: &'static str,
    pub(crate) content_type: &'static str,
    pub(crate) body: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

macro_rules! asset {
    ($path:literal, $content_type:expr, $file:literal) => {
        Asset {
            path: $path,
            content_type: $content_type,
            body: include_bytes!(concat!("../web/", $file)),
        }
    };
}

/// Files of the page of a run.
pub(crate) const RUN_ASSETS: &[Asset] = &[
    asset!("/", HTML, "index.html"),
    asset!("/theme.css", CSS, "theme.css"),
    asset!("/page.css", CSS, "page.css"),
    asset!("/canvas.js", SCRIPT, "canvas.js"),
    asset!("/page.js", SCRIPT, "page.js"),
    asset!("/picture.js", SCRIPT, "picture.js"),
    asset!("/aim.js", SCRIPT, "aim.js"),
    asset!("/files.js", SCRIPT, "files.js"),
    asset!("/zoom.js", SCRIPT, "zoom.js"),
    asset!("/connection.js", SCRIPT, "connection.js"),
    asset!("/history.js", SCRIPT, "history.js"),
    asset!("/curves.js", SCRIPT, "curves.js"),
    asset!("/space.js", SCRIPT, "space.js"),
    asset!("/pen.js", SCRIPT, "pen.js"),
    asset!("/controls.js", SCRIPT, "controls.js"),
    asset!("/icon.svg", SVG, "icon.svg"),
];

/// Files of the page of a calibration.
pub(crate) const CALIBRATION_ASSETS: &[Asset] = &[
    asset!("/", HTML, "calibrate.html"),
    asset!("/theme.css", CSS, "theme.css"),
    asset!("/page.css", CSS, "page.css"),
    asset!("/calibrate.css", CSS, "calibrate.css"),
    asset!("/calibrate.js", SCRIPT, "calibrate.js"),
    asset!("/picker.js", SCRIPT, "picker.js"),
    asset!("/connection.js", SCRIPT, "connection.js"),
    asset!("/icon.svg", SVG, "icon.svg"),
];

/// Returns the file of `assets` at a path of the page's address.
pub(crate) fn find(assets: &'static [Asset], path: &str) -> Option<&'static Asset> {
    assets.iter().find(|asset| asset.path == path)
}
