//! `plumb calibrate --import`: a lens or a pose that another program calibrated: the options.

#[cfg_attr(feature = "import", path = "import/present.rs")]
#[cfg_attr(not(feature = "import"), path = "import/absent.rs")]
mod work;

use std::path::PathBuf;

use clap::Args;
use plumb_vision::image::ImageSize;

use crate::cli::numbers;

pub(super) use work::prepare;

/// Calibration of another program.
#[derive(Args)]
#[command(next_help_heading = "With --import")]
pub(super) struct ImportOptions {
    /// Take the lens or the pose from a calibration file of another program: ROS
    /// (camera_calibration, a printed CameraInfo), kalibr, OpenCV (YAML), easy_handeye
    #[arg(long, value_name = "FILE", value_parser = work::file)]
    pub(super) import: Option<PathBuf>,
    /// Camera in a file of kalibr with several, such as cam1
    #[arg(long, value_name = "NAME", requires = "import")]
    import_camera: Option<String>,
    /// Model of the lens, where a file of OpenCV has four coefficients: plumb_bob or fisheye
    #[arg(long, value_name = "MODEL", requires = "import")]
    import_model: Option<String>,
    /// Size of the pictures, such as 1280x720, where the file does not have it; each 1 to 65535
    /// pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, requires = "import")]
    import_size: Option<ImageSize>,
}

/// Parses the size of a picture, "WIDTHxHEIGHT".
fn size(text: &str) -> Result<ImageSize, String> {
    let side = |text: &str| numbers::parse_whole::<u16>(text, &numbers::PICTURE_SIDE);
    let sides = text.split_once('x');
    let (width, height) = sides.ok_or("width and height with an x between them, as in 1280x720")?;
    Ok(ImageSize { width: side(width)?.into(), height: side(height)?.into() })
}
