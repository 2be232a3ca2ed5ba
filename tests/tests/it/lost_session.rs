//! What the link tells of a board that has lost the session with this host. In virtual time.

#![allow(clippy::expect_used, reason = "a test stops at the first surprise")]

use std::time::Duration;

use plumb_protocol::frame::encode;
use plumb_protocol::message::{Command, Hello, StartCause, ToBoard, VERSION};
use plumb_runtime::link::{Link, LinkError};
use plumb_runtime::rig::Rig;
use plumb_sim::memory::Memory;
use plumb_sim::simulated::VirtualBoard;

/// Returns a board and a link to it, which is configured by the paper's rig file or not at all.
fn connected(is_configured: bool) -> (VirtualBoard, Link<Memory>) {
    let board = VirtualBoard::paper().expect("the paper's rig");
    let mut link = Link::connect(board.transport()).expect("a board that answers");
    if is_configured {
        configure(&mut link).expect("a board that accepts it");
        // The board tells that it is configured.
        link.wait(Duration::from_millis(200)).expect("a board that answers");
    }
    (board, link)
}

fn configure(link: &mut Link<Memory>) -> Result<(), LinkError> {
    let rig = Rig::paper().expect("the paper's rig file");
    let (wiring, config) = (rig.wiring(), rig.config().expect("a valid rig file"));
    link.configure(wiring.expect("a valid rig file"), config)
}

/// Greets the board as a program of another version does.
fn greet_as_another_version(board: &VirtualBoard) {
    let hello = Hello { version: VERSION + 1, ..Hello::OURS };
    let greeting = ToBoard { id: 1, command: Command::Hello(hello) };
    board.board().borrow_mut().write(&encode(&greeting).expect("a frame"));
}

/// Nothing of this host's is on the board yet by which a restart could be told.
#[test]
fn a_session_lost_before_the_configuration_is_told_as_neither_restart_nor_another_program() {
    let (board, mut link) = connected(false);
    greet_as_another_version(&board);
    let told = configure(&mut link);
    assert!(matches!(told, Err(LinkError::SessionLost { .. })), "{told:?}");
    let (board, mut link) = connected(false);
    board.board().borrow_mut().restart(StartCause::PowerOn);
    let told = configure(&mut link);
    assert!(matches!(told, Err(LinkError::SessionLost { .. })), "{told:?}");
}

#[test]
fn a_session_lost_after_the_configuration_is_told_with_its_cause() {
    let (board, mut link) = connected(true);
    board.board().borrow_mut().restart(StartCause::PowerOn);
    let told = link.home();
    assert!(matches!(told, Err(LinkError::Restarted { .. })), "{told:?}");
    let (board, mut link) = connected(true);
    greet_as_another_version(&board);
    let told = link.home();
    assert!(matches!(told, Err(LinkError::OtherProgram { .. })), "{told:?}");
}
