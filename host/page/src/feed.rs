//! Memory between a run and its page. It is bounded: the newest replaces the oldest.

mod aim;
mod gestures;
mod jogs;
mod ring;
mod sources;
mod views;

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use nalgebra::Point3;
use plumb_frame::frame::RgbdFrame;
use plumb_runtime::observer::{EventRecord, FrameRecord, RunEvent, Tone};
use plumb_runtime::operator::{CommandOutcome, Continuity, OperatorCommand, OperatorSender};
use plumb_runtime::record::{Record, telemetry};
use plumb_runtime::run::Summary;

use crate::assets::{Asset, RUN_ASSETS};
use crate::files::{RunFile, RunFiles};
use crate::message::{
    Action, Ended, Event, FrameView, FromPage, Gesture, Goal, Hello, RigView, Sample, ToPage,
    Update, VERSION,
};
use crate::shared::Shared;
use crate::signal::Signal;
use crate::subject::{ClientId, Cursor, Picture, Received, Subject, not_understood};
use aim::Aim;
use gestures::Gestures;
use jogs::{JogLimits, Jogs};
use ring::Numbered;
use sources::Sources;
use views::{frame_view, milliseconds, sample, stop_view};

/// Number of samples in memory: 2 minutes at 30 frames/s.
pub(crate) const SAMPLES: usize = 3600;

/// Number of events in memory.
pub(crate) const EVENTS: usize = 100;

/// Answer to a command where there is no operator.
const SHOWS_ONLY: &str = "this page only shows the run";

/// What the run hands to the page's thread.
pub(crate) struct Feed {
    shared: Shared<News>,
    /// First message to every page.
    hello: String,
    /// Limits of a jog.
    jog_limits: JogLimits,
    /// Points of the rig in the camera's picture.
    aim: Aim,
    /// `None` for a page that only shows.
    operator: Option<OperatorSender>,
}

/// What the page knows of the run.
#[derive(Default)]
struct News {
    samples: Numbered<Sample>,
    events: Numbered<Event>,
    frame: Option<FrameView>,
    image: Option<Arc<RgbdFrame>>,
    telemetry: Option<Record>,
    goal: Option<Goal>,
    ended: Option<Ended>,
    files: RunFiles,
    /// Pages that need no file any more.
    served: BTreeSet<ClientId>,
    jogs: Jogs,
    gestures: Gestures,
    sources: Sources,
}

impl Feed {
    /// Makes the memory of a run of `rig`.
    ///
    /// # Errors
    /// Where the description of the rig cannot be written as JSON.
    pub(crate) fn new(
        signal: Signal,
        rig: RigView,
        operator: Option<OperatorSender>,
    ) -> serde_json::Result<Self> {
        let (jog_limits, aim) = (JogLimits::of(&rig), Aim::of(&rig));
        let hello = Hello { version: VERSION, subject: "run", commands: operator.is_some(), rig };
        let hello = serde_json::to_string(&ToPage::Hello(&hello))?;
        Ok(Self { shared: Shared::new(signal), hello, jog_limits, aim, operator })
    }

    /// Takes a frame of the run.
    pub(crate) fn frame(&self, record: &FrameRecord) {
        let image = record.frame.clone().filter(|_| self.shared.signal().is_watched());
        let mut news = self.shared.lock();
        news.samples.push(sample(record), SAMPLES);
        news.frame = Some(frame_view(record, self.aim.sight()));
        news.telemetry = record.board.map(|_| telemetry(record));
        // The old frame is freed after the lock.
        let old = std::mem::replace(&mut news.image, image);
        self.shared.publish(news);
        drop(old);
    }

    /// Takes an event of the run.
    pub(crate) fn event(&self, record: &EventRecord) {
        let event = &record.event;
        let mut news = self.shared.lock();
        match event {
            RunEvent::TargetSet { target, .. } => {
                news.goal = Some(Goal { target_m: (*target).into(), reached: false, ending: None });
            }
            RunEvent::TargetEnded { reason, .. } => {
                if let Some(goal) = &mut news.goal {
                    goal.reached = reason.is_arrival();
                    goal.ending = Some(reason.to_string());
                }
            }
            RunEvent::Command { number, command, outcome } => {
                let is_accepted = *outcome == CommandOutcome::Accepted;
                news.jogs.settle(*number, is_accepted);
                if is_accepted && *command == OperatorCommand::Hold {
                    // The board holds the ball where it is, and no target of a person.
                    news.goal = None;
                }
            }
            _ => {}
        }
        news.add_event(event.tone(), with_advice(event));
        self.shared.publish(news);
    }

    /// Takes the end of the run.
    pub(crate) fn end(&self, summary: &Summary) {
        let ending = summary.ending.to_string();
        let mut news = self.shared.lock();
        news.add_event(Tone::Note, format!("the run has ended: {ending}"));
        news.ended = Some(Ended { ending, at_rest: summary.at_rest });
        self.shared.publish(news);
    }

    /// Offers the files of a run folder to the pages.
    pub(crate) fn offer(&self, folder: &Path) {
        let files = RunFiles::read(folder);
        let mut news = self.shared.lock();
        news.files = files;
        self.shared.publish(news);
    }

    /// Returns whether an open page has not taken the files.
    pub(crate) fn is_wanted(&self) -> bool {
        let news = self.shared.lock();
        !news.files.is_empty() && self.shared.signal().watchers() > news.served.len()
    }

    /// Returns the update number `number` for a client, and advances its cursor.
    fn next_update(&self, number: u64, cursor: &mut Cursor) -> Update {
        let news = self.shared.lock();
        let (next_sample, next_event) = cursor.next.unwrap_or_default();
        let (samples, missed) = news.samples.since(next_sample);
        let (events, _) = news.events.since(next_event);
        // What happened before a client came is not missed by it.
        let missed = cursor.next.map_or(0, |_| missed);
        *cursor = Cursor { next: Some((news.samples.next, news.events.next)) };
        Update {
            number,
            picture: None,
            samples,
            observation: news.frame.clone(),
            telemetry: news.telemetry.clone(),
            goal: news.goal.clone(),
            stop: self.operator.as_ref().and_then(OperatorSender::stop).map(stop_view),
            events,
            missed,
            ended: news.ended.clone(),
            files: news.files.list(),
        }
    }

    /// Returns the newest frame and its pictures; `None` before the first one.
    fn newest(&self) -> Option<(FrameView, Arc<RgbdFrame>)> {
        let news = self.shared.lock();
        news.frame.clone().zip(news.image.clone())
    }

    /// Hands a command of a page to the run.
    fn command(&self, command: OperatorCommand, client: ClientId) -> Result<(), String> {
        let Some(operator) = &self.operator else { return Err(SHOWS_ONLY.to_owned()) };
        if let OperatorCommand::Jog { distance, rate, .. } = command {
            self.jog_limits.check(distance, rate)?;
        }
        // The lock is kept until a jog is noted: its outcome comes later.
        let mut news = self.shared.lock();
        let sender = news.sources.of(client, operator);
        let number = sender.send(command).map_err(|error| error.to_string())?;
        match command {
            OperatorCommand::Jog { .. } => news.jogs.add(client, number),
            // All pages show it at once.
            OperatorCommand::Stop | OperatorCommand::Resume { .. } => self.shared.publish(news),
            _ => {}
        }
        Ok(())
    }

    /// Hands a place of the target that moves to the run.
    fn move_target(
        &self,
        place: Point3<f64>,
        gesture: Gesture,
        client: ClientId,
    ) -> Result<(), String> {
        let Some(operator) = &self.operator else { return Err(SHOWS_ONLY.to_owned()) };
        let mut news = self.shared.lock();
        let continuity = match gesture {
            Gesture::Begins => Continuity::Begins,
            Gesture::GoesOn => Continuity::MayGoOn,
        };
        let sender = news.sources.of(client, operator);
        sender.admit_target(continuity).map_err(|error| error.to_string())?;
        let targets = operator.targets();
        let motion = news.gestures.motion(gesture, client, || targets.begin())?;
        drop(news);
        targets.send(motion, Instant::now(), place, None);
        Ok(())
    }
}

/// Returns the text of an event, with what to do after a fault.
fn with_advice(event: &RunEvent) -> String {
    let text = event.to_string();
    let Some(fault) = event.fault() else { return text };
    let end = if text.ends_with('?') { "" } else { "." };
    format!("{text}{end} {}", fault.advice())
}

/// Returns the answer to a question of a page.
fn answer(message: &ToPage<'_>) -> Result<Received, String> {
    let text = serde_json::to_string(message).map_err(|error| error.to_string())?;
    Ok(Received::Answered(text))
}

impl Subject for Feed {
    fn assets(&self) -> &'static [Asset] {
        RUN_ASSETS
    }

    fn file(&self, path: &str) -> Option<RunFile> {
        self.shared.lock().files.find(path)
    }

    fn hello(&self) -> &str {
        &self.hello
    }

    fn signal(&self) -> &Signal {
        self.shared.signal()
    }

    fn version(&self) -> u64 {
        self.shared.version()
    }

    fn update(
        &self,
        number: u64,
        picture: Option<FrameView>,
        cursor: &mut Cursor,
    ) -> serde_json::Result<String> {
        let update = Update { picture, ..self.next_update(number, cursor) };
        serde_json::to_string(&ToPage::Update(&update))
    }

    fn picture(&self) -> Option<(FrameView, Picture)> {
        let news = self.shared.lock();
        Some((news.frame.clone()?, Picture::Frame(Arc::clone(news.image.as_ref()?))))
    }

    fn take(&self, text: &str, client: ClientId) -> Result<Received, String> {
        let message: FromPage = serde_json::from_str(text).map_err(|e| not_understood(&e))?;
        match Action::from(message) {
            Action::Next(update) => Ok(Received::Seen(update)),
            Action::Command(command) => self.command(command, client).map(|()| Received::Command),
            Action::Move(place, gesture) => {
                self.move_target(place, gesture, client).map(|()| Received::Command)
            }
            Action::Taken => {
                self.shared.lock().served.insert(client);
                Ok(Received::Command)
            }
            Action::Pick(click) => answer(&ToPage::Picked(&self.aim.point(&self.newest(), &click))),
            Action::Project(point) => {
                answer(&ToPage::Projected(&self.aim.pixel(&self.newest(), &point)))
            }
        }
    }

    fn arrive(&self, client: ClientId, address: SocketAddr) {
        if let Some(operator) = &self.operator {
            self.shared.lock().sources.add(client, address, operator);
        }
    }

    /// Ramps the motors down if the page that began a jog is gone.
    fn release_absent(&self, is_present: &dyn Fn(ClientId) -> bool) {
        let mut news = self.shared.lock();
        news.sources.remove_absent(is_present);
        news.served.retain(|client| is_present(*client));
        // Their targets cease, and the ball comes to rest by itself.
        news.gestures.remove_absent(is_present);
        if !news.jogs.remove_absent(is_present) {
            return;
        }
        let text = "a page that had jogged a motor is gone: the motors stop".to_owned();
        news.add_event(Tone::Note, text);
        self.shared.publish(news);
        if let Some(operator) = &self.operator {
            // The end of the run and a Stop in force ramp the motors down too.
            let _not_needed = operator.send(OperatorCommand::RampDown);
        }
    }
}

impl News {
    fn add_event(&mut self, tone: Tone, text: String) {
        let (id, at_ms) = (self.events.next, milliseconds(SystemTime::now()));
        self.events.push(Event { id, at_ms, tone, text }, EVENTS);
    }
}

#[cfg(test)]
mod tests;
