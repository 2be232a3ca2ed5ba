//! Topics of a camera: messages in the order of their kinds.

use std::io;
use std::time::Duration;

use plumb_cameras::ros2::Ros2CameraSettings;
use plumb_cameras::stream::MAX_PIXELS;
use ros2_client::QosProfile;
use rustdds::mio1::{Events, Poll, Token};
use serde::de::DeserializeOwned;

use super::error::Ros2CameraError;
use super::pairs::Stamped;
use super::picture::{self, Picture};
use crate::message::TypedMessage;
use crate::message::sensor::{CameraInfo, CompressedImage, Image};
use crate::namespace::Namespace;
use crate::network::{Member, Network};
use crate::peers::Peers;
use crate::qos;
use crate::senders::Sending;
use crate::topic::{MessageOrigin, Topic};

/// Most bytes of a message: a picture of [`MAX_PIXELS`] with four bytes each, and what is beside
/// them.
const MAX_MESSAGE: u32 = 4 * (MAX_PIXELS as u32) + (1 << 16);

/// Subscribes to a topic with this `qos`, whose messages wake `poll` with `token`.
fn subscribe<M: TypedMessage + DeserializeOwned + 'static>(
    member: &mut Member,
    name: &str,
    qos: &QosProfile,
    poll: &Poll,
    token: usize,
) -> Result<Topic<M>, Ros2CameraError> {
    let mut topic = Topic::new(member, name, qos)?;
    topic.register(poll.registry(), Token(token)).map_err(Ros2CameraError::Wait)?;
    Ok(topic)
}

/// Topic of pictures of either type.
enum PictureTopic {
    Raw(Topic<Image>),
    Compressed(Topic<CompressedImage>),
}

impl PictureTopic {
    /// Subscribes to a topic, of the type that its name says, as [`subscribe`].
    fn subscribe(
        member: &mut Member,
        name: &str,
        poll: &Poll,
        token: usize,
    ) -> Result<Self, Ros2CameraError> {
        Ok(if picture::is_compressed(name) {
            Self::Compressed(subscribe(member, name, &qos::PICTURES, poll, token)?)
        } else {
            Self::Raw(subscribe(member, name, &qos::PICTURES, poll, token)?)
        })
    }

    fn peers(&self) -> &Peers {
        match self {
            Self::Raw(topic) => &topic.peers,
            Self::Compressed(topic) => &topic.peers,
        }
    }

    /// Hands the pictures that have come to `take`.
    fn receive(&mut self, mut take: impl FnMut(Stamped<Picture>)) {
        let mut take = |picture: Picture, MessageOrigin { arrival, .. }| {
            take(Stamped { stamp: picture.header().seconds(), arrival, picture });
        };
        match self {
            Self::Raw(topic) => topic.receive(|image, origin| take(Picture::Raw(image), origin)),
            Self::Compressed(topic) => {
                topic.receive(|file, origin| take(Picture::Compressed(file), origin));
            }
        }
    }
}

/// Message of a camera.
pub(crate) enum Received {
    /// Colour picture.
    Colour(Stamped<Picture>),
    /// Depth picture.
    Depth(Stamped<Picture>),
    /// Description of the camera.
    Info(Description),
}

/// Description of a camera.
#[derive(Debug, Clone)]
pub(crate) struct Description {
    /// The message.
    pub(crate) info: Box<CameraInfo>,
    /// Whether the publisher keeps it for readers that come later, and may send it only once.
    pub(crate) is_kept: bool,
}

/// Topics of a camera.
pub(crate) struct Reception {
    poll: Poll,
    events: Events,
    colour: PictureTopic,
    depth: Option<PictureTopic>,
    info: Topic<CameraInfo>,
    /// The same topic, of the publishers that keep their message for readers that come later. DDS
    /// connects no others to a reader that asks for it.
    kept_info: Topic<CameraInfo>,
    member: Member,
}

impl Reception {
    /// Joins ROS 2 and subscribes to the topics.
    ///
    /// # Errors
    /// Where ROS 2 cannot be joined, or the name of a topic breaks its rules.
    pub(crate) fn start(
        settings: &Ros2CameraSettings,
        network: &Network,
    ) -> Result<Self, Ros2CameraError> {
        let mut member = network.join(&Namespace::default(), "plumb_camera", MAX_MESSAGE)?;
        let poll = Poll::new().map_err(Ros2CameraError::Wait)?;
        let colour = PictureTopic::subscribe(&mut member, &settings.colour, &poll, 0)?;
        let depth = settings.depth_topic();
        let depth = depth.map(|name| PictureTopic::subscribe(&mut member, name, &poll, 1));
        let depth = depth.transpose()?;
        let info = subscribe(&mut member, &settings.info, &qos::PICTURES, &poll, 2)?;
        let kept_info = subscribe(&mut member, &settings.info, &qos::LATCHED, &poll, 3)?;
        let events = Events::with_capacity(16);
        Ok(Self { poll, events, colour, depth, info, kept_info, member })
    }

    /// Returns whether the subscriptions are still in ROS 2.
    pub(crate) fn is_alive(&self) -> bool {
        self.member.is_alive()
    }

    /// Returns the name of the colour topic.
    pub(crate) fn colour_name(&self) -> &str {
        self.colour.peers().topic()
    }

    /// Returns the name of the depth topic; `None` for a camera without depth.
    pub(crate) fn depth_name(&self) -> Option<&str> {
        self.depth.as_ref().map(|topic| topic.peers().topic())
    }

    /// Returns the name of the topic with the camera's description.
    pub(crate) fn info_name(&self) -> &str {
        self.info.peers.topic()
    }

    /// Waits for messages, for `limit` at most, and hands them to `take`.
    ///
    /// # Errors
    /// Where the operating system refuses.
    pub(crate) fn receive(
        &mut self,
        limit: Duration,
        mut take: impl FnMut(Received),
    ) -> Result<(), Ros2CameraError> {
        match self.poll.poll(&mut self.events, Some(limit)) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                return Err(Ros2CameraError::Wait(error));
            }
            _ => {}
        }
        let mut describe = |info, is_kept| {
            take(Received::Info(Description { info: Box::new(info), is_kept }));
        };
        self.kept_info.receive(|info, _| describe(info, true));
        self.info.receive(|info, _| describe(info, false));
        self.colour.receive(|picture| take(Received::Colour(picture)));
        if let Some(depth) = &mut self.depth {
            depth.receive(|picture| take(Received::Depth(picture)));
        }
        Ok(())
    }

    /// Returns the publishers on each topic.
    fn peers(&self) -> impl Iterator<Item = &Peers> {
        let depth = self.depth.as_ref().map(PictureTopic::peers);
        [self.colour.peers()].into_iter().chain(depth).chain([&self.info.peers])
    }

    /// Checks the types of the publishers.
    ///
    /// # Errors
    /// Where one has another type than its topic.
    pub(crate) fn check_types(&self) -> Result<(), Ros2CameraError> {
        for peers in self.peers() {
            if let Some(unusable) = peers.unusable().into_iter().next() {
                return Err(unusable.into());
            }
        }
        Ok(())
    }

    /// Checks that one node publishes each topic. Returns whether that is certain: a node that has
    /// vanished may have a successor.
    ///
    /// # Errors
    /// Where several publishers take turns.
    pub(crate) fn check_senders(&self) -> Result<bool, Ros2CameraError> {
        let mut is_certain = true;
        for peers in self.peers() {
            match peers.sending() {
                Sending::One => {}
                Sending::Unclear => is_certain = false,
                Sending::Many(count) => {
                    let topic = peers.topic().to_owned();
                    return Err(Ros2CameraError::ManyPublishers { topic, count });
                }
            }
        }
        Ok(is_certain)
    }

    /// Returns, for a person, what may be missing: topics that nobody publishes, and the image
    /// topics of the domain. `apart` is the difference of the stamps of colour and depth, seconds.
    pub(crate) fn missing(&self, apart: Option<f64>) -> String {
        let silent = self.peers().filter(|peers| peers.count() == 0).map(Peers::topic);
        let silent: Vec<&str> = silent.collect();
        if silent.is_empty() {
            return match apart {
                Some(apart) => format!(
                    "the stamps of colour and depth differ by {:.0} ms at least",
                    apart * 1e3
                ),
                None => {
                    "the topics have publishers, but not all of them send (is a simulator or a \
                         bag paused?)"
                        .to_owned()
                }
            };
        }
        let domain = self.member.participant.domain_id();
        let present = match self.image_topics() {
            topics if topics.is_empty() => "none".to_owned(),
            topics => topics.join(", "),
        };
        format!(
            "nobody publishes {} (image topics in the domain {domain}: {present})",
            silent.join(", ")
        )
    }

    /// Returns, for a person, what is missing where pictures come.
    pub(crate) fn missing_description(&self) -> String {
        if self.info.peers.count() == 0 {
            return self.missing(None);
        }
        format!(
            "pictures come, but nothing on {}: its node must publish the camera's description with \
             each picture, or keep it (durability transient local)",
            self.info_name()
        )
    }

    /// Returns the names of the topics that have images, in alphabetical order.
    pub(crate) fn image_topics(&self) -> Vec<String> {
        let kinds = [Image::type_name(), CompressedImage::type_name()].map(|it| it.dds_msg_type());
        let writers = self.member.participant.discovered_writers();
        let data = writers.iter().map(|writer| &writer.publication_topic_data);
        let images = data.filter(|data| kinds.contains(&data.type_name));
        let names = images.filter_map(|data| data.topic_name.strip_prefix("rt"));
        let mut names: Vec<String> = names.map(str::to_owned).collect();
        names.sort();
        names.dedup();
        names
    }
}
