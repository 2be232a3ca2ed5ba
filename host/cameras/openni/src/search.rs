//! Names under which the library is searched.

/// Environment variable with the path of the library, for one that is not where the system keeps
/// its libraries.
pub const LIBRARY_VARIABLE: &str = "PLUMB_OPENNI2";

/// File names of the library, the most usual first.
pub(crate) const NAMES: [&str; 3] = ["libOpenNI2.so.0", "libOpenNI2.so", "libOpenNI2.dylib"];
