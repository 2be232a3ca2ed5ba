//! The processes that emulate a chip.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

/// A process that runs `tests/chip/serve.mjs`.
struct Process {
    child: Child,
    commands: ChildStdin,
    replies: BufReader<ChildStdout>,
}

/// Processes without a chip. The next chip runs in one of them: it has the translated code of the
/// firmware, and starts a chip in a tenth of the time of a new process. They end with the tests.
static IDLE: Mutex<Vec<Process>> = Mutex::new(Vec::new());

/// The process of a chip.
pub(super) struct Emulator(Option<Process>);

impl Emulator {
    /// Starts a chip with an image, in an idle process if there is one.
    ///
    /// # Panics
    /// If Node or its packages are missing, or if the image cannot be read.
    pub(super) fn start(image: &Path) -> Self {
        let idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let Some(process) = idle else { return Self(Some(Process::spawn(image))) };
        let mut emulator = Self(Some(process));
        emulator.execute(&json!({ "image": image }));
        emulator
    }

    /// Executes a command and returns the reply.
    ///
    /// # Panics
    /// If the process has ended or reports an error.
    pub(super) fn execute(&mut self, command: &Value) -> Value {
        let process = self.0.as_mut().expect("the process of a chip in use");
        writeln!(process.commands, "{command}").expect("the chip takes commands");
        let mut line = String::new();
        process.replies.read_line(&mut line).expect("the chip replies");
        let reply: Value = serde_json::from_str(&line).expect("a reply is JSON");
        assert!(reply["error"].is_null(), "{command}: {reply}");
        reply
    }
}

impl Drop for Emulator {
    /// Keeps the process for the next chip, unless a test has failed, which may be in mid-command.
    fn drop(&mut self) {
        let Some(mut process) = self.0.take() else { return };
        if std::thread::panicking() {
            let _ = process.child.kill();
            let _ = process.child.wait();
        } else {
            IDLE.lock().unwrap_or_else(PoisonError::into_inner).push(process);
        }
    }
}

impl Process {
    fn spawn(image: &Path) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("chip/serve.mjs");
        let mut child = Command::new("node")
            .arg(script)
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Node runs the emulated chip (scripts/chip makes it ready)");
        let commands = child.stdin.take().expect("its standard input");
        let replies = BufReader::new(child.stdout.take().expect("its standard output"));
        Self { child, commands, replies }
    }
}
