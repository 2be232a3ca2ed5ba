//! Topics that Plumb publishes.

use nalgebra::Isometry3;
use plumb_frame::observation::Gaussian3;
use plumb_runtime::wall_clock;
use ros2_client::Publisher;

use crate::error::Ros2Error;
use crate::feed::Sample;
use crate::message::diagnostic::{DiagnosticArray, DiagnosticStatus};
use crate::message::geometry::{
    PointStamped, PoseWithCovarianceStamped, TfMessage, Transform, TransformStamped,
};
use crate::message::{Header, Time};
use crate::namespace::Namespace;
use crate::network::Member;
use crate::qos;
use crate::status::Report;

/// Topics that Plumb publishes. A message that a slow reader has no room for is dropped.
pub(crate) struct Publishers {
    ball: Publisher<PointStamped>,
    pose: Publisher<PoseWithCovarianceStamped>,
    transforms: Publisher<TfMessage>,
    diagnostics: Publisher<DiagnosticArray>,
    stop: Publisher<DiagnosticStatus>,
    namespace: Namespace,
    /// Pose of the camera in the rig frame.
    camera: Isometry3<f64>,
}

impl Publishers {
    /// Creates the publishers.
    ///
    /// # Errors
    /// [`Ros2Error::Endpoint`] where one cannot be created.
    pub(crate) fn new(
        member: &mut Member,
        namespace: &Namespace,
        camera: Isometry3<f64>,
    ) -> Result<Self, Ros2Error> {
        Ok(Self {
            ball: member.publisher(&namespace.topic("ball"), &qos::NEWEST_MESSAGE)?,
            pose: member.publisher(&namespace.topic("ball_pose"), &qos::NEWEST_MESSAGE)?,
            transforms: member.publisher("/tf", &qos::EVERY_MESSAGE)?,
            diagnostics: member.publisher("/diagnostics", &qos::EVERY_MESSAGE)?,
            stop: member.publisher(&namespace.topic("stop_status"), &qos::LATCHED)?,
            namespace: namespace.clone(),
            camera,
        })
    }

    /// Publishes a sample: the ball where its position is known, and the transforms.
    pub(crate) fn publish_sample(&self, sample: &Sample) {
        let header = Header { stamp: sample.stamp, frame_id: self.namespace.frame("rig") };
        if let Some(position) = &sample.position {
            let (point, header) = (position.mean.into(), header.clone());
            let pose = PoseWithCovarianceStamped { header: header.clone(), pose: position.into() };
            let _dropped = self.ball.publish(PointStamped { header, point });
            let _dropped = self.pose.publish(pose);
        }
        let _dropped = self.transforms.publish(self.transforms(header, sample.position.as_ref()));
    }

    /// Returns the poses of the camera and the ball in the rig frame.
    fn transforms(&self, header: Header, ball: Option<&Gaussian3>) -> TfMessage {
        let child = |frame: &str, transform| TransformStamped {
            header: header.clone(),
            child_frame_id: self.namespace.frame(frame),
            transform,
        };
        let mut transforms = vec![child("camera", Transform::from(&self.camera))];
        transforms.extend(ball.map(|ball| child("ball", Transform::to_point(ball.mean))));
        TfMessage { transforms }
    }

    /// Publishes the diagnostics: a status for each name.
    pub(crate) fn publish_diagnostics<'a>(
        &self,
        reports: impl IntoIterator<Item = (&'a str, Report)>,
    ) {
        let stamp = Time::from_nanoseconds(wall_clock::now());
        let status = reports.into_iter().map(|(name, report)| self.status(name, report)).collect();
        let header = Header { stamp, frame_id: String::new() };
        let _dropped = self.diagnostics.publish(DiagnosticArray { header, status });
    }

    /// Publishes the report about the Stop in force. Readers that come later get it too.
    pub(crate) fn publish_stop(&self, report: Report) {
        let _dropped = self.stop.publish(self.status("stop", report));
    }

    /// Returns the status `name` of this rig.
    fn status(&self, name: &str, report: Report) -> DiagnosticStatus {
        let Report { level, message, values } = report;
        DiagnosticStatus {
            level,
            name: format!("{}: {name}", self.namespace),
            message,
            hardware_id: self.namespace.as_str().trim_start_matches('/').to_owned(),
            values,
        }
    }
}
