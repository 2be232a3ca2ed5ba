//! The topics of a file that are a camera's.

use std::path::Path;
use std::sync::Arc;

use plumb_cameras::ros2::Ros2CameraSettings;

use super::decode::Kind;
use super::error::McapError;
use super::reader::Channel;
use crate::camera::intake::is_aligned;
use crate::camera::picture::DEPTH_SCALE;

/// Parts of the names of topics that are not colour.
const OTHERS: [&str; 3] = ["depth", "infra", "/ir/"];
/// Parts of the names of topics with colour, where there are several others.
const COLOURS: [&str; 3] = ["color", "colour", "rgb"];

/// Most topics that a message names.
const LISTED: usize = 20;

/// Topics of a camera.
#[derive(Debug)]
pub(super) struct Topics {
    /// Colour pictures.
    pub(super) colour: Arc<Channel>,
    /// Depth pictures that are aligned to colour; `None` for a camera without depth.
    pub(super) depth: Option<Arc<Channel>>,
    /// Descriptions of the camera; `None` where there are none.
    pub(super) info: Option<Arc<Channel>>,
    /// Names of all topics with pictures.
    pub(super) pictures: Vec<String>,
}

impl Topics {
    /// Chooses the topics of a camera among all of the file at `path`: those of `settings`, and by
    /// their names where the file does not have these.
    ///
    /// # Errors
    /// Where none or several may be meant.
    pub(super) fn choose(
        path: &Path,
        all: &[Arc<Channel>],
        settings: &Ros2CameraSettings,
        has_depth: bool,
    ) -> Result<Self, McapError> {
        let listed = || listed(all.iter().map(|it| format!("{} ({})", it.topic, it.schema)));
        let pictures: Vec<&Arc<Channel>> = all
            .iter()
            .filter(|it| matches!(it.kind(), Some(Kind::Raw | Kind::Compressed)))
            .collect();
        let is_other = |it: &&&Arc<Channel>| has_part(&it.topic, &OTHERS);
        let colours = pictures.iter().filter(|it| !is_other(it)).copied().collect();
        let depths = pictures.iter().filter(|it| is_aligned(&it.topic)).copied().collect();
        let colour = one(path, "colour", "colour", &settings.colour, colours)?
            .ok_or_else(|| McapError::NoColour { path: path.to_owned(), topics: listed() })?;
        let depth = match settings.depth_topic() {
            Some(name) if has_depth => {
                let depth = one(path, "depth", "depth", name, depths)?;
                let absent = || McapError::NoDepth { path: path.to_owned(), topics: listed() };
                Some(depth.ok_or_else(absent)?)
            }
            _ => None,
        };
        let infos = all.iter().filter(|it| it.kind() == Some(Kind::Info));
        let info = info_of(&colour.topic, &settings.info, infos.collect());
        let pictures = pictures.iter().map(|it| it.topic.clone()).collect();
        Ok(Self { colour, depth, info, pictures })
    }
}

impl Topics {
    /// Returns the units of depth in a metre; 0 for a camera without depth.
    pub(super) fn depth_scale(&self) -> f64 {
        if self.depth.is_some() { DEPTH_SCALE } else { 0.0 }
    }
}

/// Returns names as a list for a person: the first [`LISTED`], and how many follow.
fn listed(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(LISTED);
    let first = names.take(LISTED).collect::<Vec<_>>().join(", ");
    if more == 0 { first } else { format!("{first} and {more} more") }
}

fn has_part(topic: &str, parts: &[&str]) -> bool {
    parts.iter().any(|part| topic.contains(part))
}

/// Returns the topic of this name, or the only candidate: among several, the only one with colour
/// in its name, and raw pictures before their compressed ones. `None` where there is no candidate.
fn one(
    path: &Path,
    what: &'static str,
    key: &'static str,
    name: &str,
    mut candidates: Vec<&Arc<Channel>>,
) -> Result<Option<Arc<Channel>>, McapError> {
    if let Some(named) = candidates.iter().find(|it| it.topic == name) {
        return Ok(Some(Arc::clone(named)));
    }
    if candidates.iter().any(|it| has_part(&it.topic, &COLOURS)) {
        candidates.retain(|it| has_part(&it.topic, &COLOURS));
    }
    if candidates.iter().any(|it| it.kind() == Some(Kind::Raw)) {
        candidates.retain(|it| it.kind() == Some(Kind::Raw));
    }
    match candidates[..] {
        [] => Ok(None),
        [only] => Ok(Some(Arc::clone(only))),
        _ => {
            let topics = listed(candidates.iter().map(|it| it.topic.clone()));
            let path = path.to_owned();
            Err(McapError::Several { path, what, key, topics })
        }
    }
}

/// Returns the topic with the descriptions of the camera that publishes `colour`: that of this
/// name, the one beside it, or the only one.
fn info_of(colour: &str, name: &str, infos: Vec<&Arc<Channel>>) -> Option<Arc<Channel>> {
    let folder = |topic: &str| topic.rsplit_once('/').map(|(folder, _)| folder.to_owned());
    let colour = colour.strip_suffix("/compressed").unwrap_or(colour);
    let named = infos.iter().find(|it| it.topic == name);
    let beside = infos.iter().find(|it| folder(&it.topic) == folder(colour));
    let only = if infos.len() == 1 { infos.first() } else { None };
    named.or(beside).or(only).map(|it| Arc::clone(it))
}
