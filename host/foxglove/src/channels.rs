//! Topics of a run.

use std::borrow::Cow;
use std::marker::PhantomData;
use std::sync::Arc;

use foxglove::messages::{CameraCalibration, CompressedImage, FrameTransform, SceneUpdate};
use foxglove::{Channel, Context, PartialMetadata, RawChannel, Schema};
use plumb_runtime::observer::{EventRecord, FrameRecord};
use plumb_runtime::record::{Record, observation};
use plumb_runtime::run::Summary;
use serde::Serialize;

use crate::FoxgloveError;
use crate::message::{schema, telemetry_message};

/// One channel for each topic.
pub(crate) struct Channels {
    pub(crate) image: Channel<CompressedImage>,
    pub(crate) calibration: Channel<CameraCalibration>,
    pub(crate) transform: Channel<FrameTransform>,
    pub(crate) scene: Channel<SceneUpdate>,
    pub(crate) observation: JsonChannel<Record>,
    pub(crate) telemetry: JsonChannel<Record>,
    pub(crate) event: JsonChannel<EventRecord>,
    pub(crate) summary: JsonChannel<Summary>,
}

impl Channels {
    /// Makes the channels of `context`.
    pub(crate) fn new(context: &Arc<Context>) -> Result<Self, FoxgloveError> {
        let unknown = FrameRecord::default();
        Ok(Self {
            image: context.channel_builder("/camera/image").build(),
            calibration: context.channel_builder("/camera/calibration").build(),
            transform: context.channel_builder("/tf").build(),
            scene: context.channel_builder("/scene").build(),
            observation: JsonChannel::new(
                context,
                "/ball/observation",
                "plumb.Observation",
                schema("plumb.Observation", &observation(&unknown)),
            )?,
            telemetry: JsonChannel::new(
                context,
                "/board/telemetry",
                "plumb.Telemetry",
                schema("plumb.Telemetry", &telemetry_message(&unknown)),
            )?,
            event: JsonChannel::new(
                context,
                "/run/events",
                "plumb.Event",
                include_bytes!("../schemas/event.json").as_slice(),
            )?,
            summary: JsonChannel::new(
                context,
                "/run/summary",
                "plumb.Summary",
                include_bytes!("../schemas/summary.json").as_slice(),
            )?,
        })
    }
}

/// Channel of JSON messages made from values of type `T`.
pub(crate) struct JsonChannel<T> {
    raw: Arc<RawChannel>,
    message: PhantomData<fn(&T)>,
}

impl<T: Serialize> JsonChannel<T> {
    /// Makes a channel whose messages have the JSON schema `schema` with this name.
    fn new(
        context: &Arc<Context>,
        topic: &'static str,
        name: &str,
        schema: impl Into<Cow<'static, [u8]>>,
    ) -> Result<Self, FoxgloveError> {
        let raw = context
            .channel_builder(topic)
            .message_encoding("json")
            .schema(Schema::new(name, "jsonschema", schema))
            .build_raw()
            .map_err(|source| FoxgloveError::Channel { topic, source })?;
        Ok(Self { raw, message: PhantomData })
    }

    /// Logs a message with the time `stamp`, nanoseconds since 1970.
    pub(crate) fn log(&self, message: &T, stamp: u64) {
        // The messages are structs of numbers and strings, which serde_json always writes.
        if let Ok(json) = serde_json::to_vec(message) {
            self.raw.log_with_meta(&json, PartialMetadata::with_log_time(stamp));
        }
    }
}
