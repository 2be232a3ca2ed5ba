//! Namespace of a rig, and the names that follow from it.

use std::fmt;
use std::str::FromStr;

use ros2_client::Name;

use crate::error::Ros2Error;

/// Namespace of a rig: `/plumb`, `/hall/left`. Rigs in different namespaces do not disturb each
/// other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Namespace(String);

impl Namespace {
    /// Returns the namespace, with the slash that it begins with.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the name of the coordinate frame `frame` of this rig, such as `plumb/rig`.
    pub fn frame(&self, frame: &str) -> String {
        format!("{}/{frame}", self.0.trim_start_matches('/'))
    }

    /// Returns the name of a topic or service of this rig, such as `/plumb/ball`.
    pub fn topic(&self, name: &str) -> String {
        format!("{}/{name}", self.0)
    }
}

impl Default for Namespace {
    /// Returns `/plumb`.
    fn default() -> Self {
        Self("/plumb".to_owned())
    }
}

impl fmt::Display for Namespace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Namespace {
    type Err = Ros2Error;

    /// Reads a namespace. The slash at its beginning may be left out.
    ///
    /// # Errors
    /// [`Ros2Error::Namespace`] where it is empty or breaks the rules of ROS 2.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let namespace = format!("/{}", text.strip_prefix('/').unwrap_or(text));
        let refused = || Ros2Error::Namespace(text.to_owned());
        // The crate checks the rules for the last part of a name only.
        for part in namespace.split('/').skip(1) {
            Name::new("/", part).map_err(|_| refused())?;
        }
        Ok(Self(namespace))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_below_the_namespace() {
        let left: Namespace = "hall/left".parse().unwrap();
        assert_eq!(left.to_string(), "/hall/left");
        assert_eq!(left, "/hall/left".parse().unwrap());
        assert_eq!(left.frame("rig"), "hall/left/rig");
        assert_eq!(left.topic("ball"), "/hall/left/ball");
    }

    #[test]
    fn names_that_ros_refuses_are_refused() {
        for text in ["", "/", "a/", "a//b", "2nd", "a/2nd", "a-b/c", "~", "a__b"] {
            let error = text.parse::<Namespace>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{text}`")), "{text}: {error}");
        }
    }
}
