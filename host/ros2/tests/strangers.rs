//! What strangers send to the ports of ROS 2 takes no memory and no time, on this computer only.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

#[path = "../src/gate/tests/forged.rs"]
#[allow(dead_code, reason = "the tests of the gate use the rest")]
mod forged;

use std::fs;
use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use forged::{Fragment, PARTICIPANT_READER, WRITER};
use nalgebra::Isometry3;
use plumb_ros2::{Namespace, Network, Ros2Output, Ros2Settings};
use plumb_runtime::operator::{OperatorReceiver, operator};

/// Domain of these tests only.
const DOMAIN: u16 = 118;

/// Time for the node to take what was sent.
const TAKE: Duration = Duration::from_secs(2);

/// Largest growth of the program's memory, bytes. One forged sample claims more.
const MAX_GROWTH: u64 = 200 << 20;

/// The memory is that of all tests of this program.
static TURN: Mutex<()> = Mutex::new(());

/// Joins ROS 2 with a run's node.
fn join() -> (Ros2Output, OperatorReceiver) {
    let (sender, receiver) = operator();
    let network = Network { domain: DOMAIN, interface: Some(IpAddr::V4(Ipv4Addr::LOCALHOST)) };
    let namespace = Namespace::default();
    let settings = Ros2Settings { namespace, network, camera: Isometry3::identity() };
    (Ros2Output::start(&settings, sender).unwrap(), receiver)
}

/// Sends packets to the ports of the first participants of the domain, without haste: what does not
/// fit into a socket's memory harms nobody.
fn send(packets: impl IntoIterator<Item = Vec<u8>>) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    for (k, packet) in packets.into_iter().enumerate() {
        for port in [10, 12] {
            let _ = socket.send_to(&packet, ("127.0.0.1", 7400 + 250 * DOMAIN + port));
        }
        if k % 16 == 15 {
            thread::sleep(Duration::from_millis(2));
        }
    }
}

/// Returns the most memory that this program has had, bytes.
fn peak() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() << 10
}

/// Sends packets. Checks that they have taken little memory.
fn takes_little(name: &str, packets: impl IntoIterator<Item = Vec<u8>>) {
    let before = peak();
    send(packets);
    thread::sleep(TAKE);
    let growth = peak() - before;
    println!("{name}: {} MiB", growth >> 20);
    assert!(growth < MAX_GROWTH, "{name}: {} MiB", growth >> 20);
}

/// A sample that claims so many bytes.
fn claim(number: u32, sample: u32) -> Fragment {
    Fragment { reader: PARTICIPANT_READER, writer: WRITER, number, first: 1, size: 1024, sample }
}

#[test]
fn what_packets_claim_takes_no_memory() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let (_output, _operator) = join();
    let gigabyte = || [forged::fragment(1, claim(1, 1 << 30))];
    takes_little("a gigabyte of nobody", gigabyte());
    takes_little("a participant", [forged::announcement(1, 1, 100)]);
    takes_little("a gigabyte", gigabyte());
    for reader in [forged::EVERY_READER, forged::PUBLISHER_READER, [0, 0, 1, 4]] {
        for writer in [forged::PUBLISHERS, WRITER] {
            let claim = |k| Fragment { reader, writer, ..claim(k, 1 << 20) };
            takes_little("megabytes", (1..1000).map(|k| forged::fragment(1, claim(k))));
        }
    }
    // The DDS library lists the samples of a range.
    for kind in [7, 8] {
        takes_little(
            "a range",
            [forged::range(1, kind, [1, 1 << 31]), forged::range(1, kind, [9, 1 << 40])],
        );
    }
}

/// Someone sends before the node has joined, and does not stop.
#[test]
fn packets_that_come_while_it_joins_take_no_memory() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let (stop, stopped) = channel::<()>();
    let sender = thread::spawn(move || {
        while stopped.try_recv() == Err(std::sync::mpsc::TryRecvError::Empty) {
            send([forged::fragment(1, claim(1, 1 << 30))]);
        }
    });
    let before = peak();
    for _ in 0..10 {
        drop(join());
    }
    let growth = peak() - before;
    drop(stop);
    sender.join().unwrap();
    assert!(growth < MAX_GROWTH, "{} MiB", growth >> 20);
}

/// Each of them makes the DDS library's leaving longer.
#[test]
fn many_participants_keep_nobody_from_leaving() {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let (output, operator) = join();
    send((0..3000).map(|k| forged::announcement(k, k, 100)));
    thread::sleep(TAKE);
    let (done, left) = channel();
    thread::spawn(move || {
        drop((output, operator));
        let _ = done.send(());
    });
    left.recv_timeout(Duration::from_secs(20)).unwrap();
}
