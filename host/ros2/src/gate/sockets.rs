//! Sockets of the DDS library, found as it opens them, and the gate's own.

use std::collections::HashSet;
use std::fs;
use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::os::unix::net::UnixDatagram;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use nix::ifaddrs::getifaddrs;
use nix::sys::socket::{
    AddressFamily, ControlMessage, MsgFlags, SockFlag, SockType, SockaddrIn, bind, getsockopt,
    recv, sendmsg, setsockopt, socket, sockopt,
};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};

/// Requested bytes of packets that wait at a port, as the DDS library requests them.
const WAITING: usize = 8 << 20;

/// One participant is opened at a time, so that its sockets are known.
static TURN: Mutex<()> = Mutex::new(());

/// Sockets from which those of the library receive. It looks whether a packet comes from this
/// computer, and sends to the loopback addresses of such participants only.
pub(super) struct Outlets {
    /// For packets of loopback addresses.
    near: UdpSocket,
    /// For other packets; `None` where this computer has no other address.
    far: Option<UdpSocket>,
}

impl Outlets {
    /// Opens the outlets for packets of `interface`, or of all.
    pub(super) fn open(interface: Option<IpAddr>) -> io::Result<Self> {
        let is_asked = |it: &Ipv4Addr| interface.is_none_or(|asked| asked == *it);
        let mut far = addresses()?.filter(|it| is_asked(it) && !it.is_loopback());
        // An interface that is down has an address without use.
        let far = far.find_map(|it| UdpSocket::bind((it, 0)).ok());
        Ok(Self { near: UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?, far })
    }

    /// Sends a packet that came from `from` to the library.
    pub(super) fn send(&self, packet: &[u8], from: SocketAddr) {
        // The address of the outlet may be gone.
        let is_sent = !from.ip().is_loopback() && self.far().send(packet).is_ok();
        if !is_sent {
            // It is lost like any other packet of UDP.
            let _lost = self.near.send(packet);
        }
    }

    fn far(&self) -> &UdpSocket {
        self.far.as_ref().unwrap_or(&self.near)
    }

    /// Connects an outlet with a socket of the library that it has been connected to.
    fn reach(&self, listener: &Listener) -> io::Result<()> {
        match listener.role {
            Role::Discovery => self.near.connect(listener.socket.local_addr()?),
            Role::User if self.far.is_some() => self.far().connect(listener.socket.local_addr()?),
            Role::User | Role::Multicast => Ok(()),
        }
    }
}

/// Returns the IPv4 addresses of this computer.
fn addresses() -> io::Result<impl Iterator<Item = Ipv4Addr>> {
    Ok(getifaddrs()?.filter_map(|it| Some(it.address?.as_sockaddr_in()?.ip())))
}

/// What a socket of the library is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Multicast,
    Discovery,
    User,
}

impl Role {
    /// Returns the role of the port in a domain (RTPS 2.5, 9.6.1.1). Where its port of user traffic
    /// is taken, the library takes any other.
    fn of(port: u16, domain: u16) -> Self {
        match port.checked_sub(7400 + 250 * domain) {
            Some(0 | 1) => Self::Multicast,
            Some(offset @ 10..=248) if offset % 2 == 0 => Self::Discovery,
            _ => Self::User,
        }
    }
}

/// Socket on which the library listens.
struct Listener {
    socket: UdpSocket,
    port: u16,
    role: Role,
}

/// Thread that connects the sockets of the library as it opens them, before it reads them.
pub(super) struct Fence {
    is_built: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<(Vec<Listener>, Outlets)>>,
    _turn: MutexGuard<'static, ()>,
}

impl Fence {
    /// Begins to look for the sockets of a participant in `domain`.
    pub(super) fn begin(domain: u16, outlets: Outlets) -> io::Result<Self> {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let carrier = UnixDatagram::pair()?;
        let known = open_sockets()?.map(|(_, inode)| inode).collect();
        let mut search = Search { domain, outlets, known, carrier, found: Vec::new() };
        let is_built = Arc::new(AtomicBool::new(false));
        let is_last = Arc::clone(&is_built);
        let thread = thread::Builder::new().name("ros2 fence".to_owned()).spawn(move || {
            loop {
                let is_last = is_last.load(Ordering::Acquire);
                search.step()?;
                if is_last {
                    return Ok((search.found, search.outlets));
                }
                thread::yield_now();
            }
        })?;
        Ok(Self { is_built, thread, _turn: turn })
    }

    /// Takes over the ports of the library, which has opened its sockets.
    pub(super) fn end(self) -> io::Result<(Vec<UdpSocket>, Outlets)> {
        self.is_built.store(true, Ordering::Release);
        let missing = || io::Error::other("the sockets of ROS 2 are not found");
        let (listeners, outlets) = self.thread.join().map_err(|_| missing())??;
        if ![Role::Discovery, Role::User].iter().all(|it| listeners.iter().any(|l| l.role == *it)) {
            return Err(missing());
        }
        let mut inlets = Vec::new();
        for listener in &listeners {
            outlets.reach(listener)?;
            inlets.push(inlet(listener)?);
        }
        Ok((inlets, outlets))
    }
}

/// Search for the sockets of the library.
struct Search {
    domain: u16,
    outlets: Outlets,
    /// Sockets that were looked at.
    known: HashSet<String>,
    carrier: (UnixDatagram, UnixDatagram),
    found: Vec<Listener>,
}

impl Search {
    /// Looks at the new sockets of this program.
    fn step(&mut self) -> io::Result<()> {
        for (fd, inode) in open_sockets()? {
            if self.known.contains(&inode) {
                continue;
            }
            // It may be closed already.
            let Ok(socket) = duplicate(fd, &self.carrier).map(UdpSocket::from) else { continue };
            match socket.local_addr().map(|it| it.port()) {
                // The library binds it next.
                Ok(0) => continue,
                // The library asks for the interface of packets on those that it listens on only.
                Ok(port) if getsockopt(&socket, sockopt::Ipv4PacketInfo).unwrap_or_default() => {
                    let role = Role::of(port, self.domain);
                    let listener = Listener { socket, port, role };
                    self.fence(&listener)?;
                    self.found.push(listener);
                }
                // Of another kind.
                _ => {}
            }
            self.known.insert(inode);
        }
        Ok(())
    }

    /// Connects a socket to an outlet, and drops the packets that have come.
    fn fence(&self, listener: &Listener) -> io::Result<()> {
        let Listener { socket, role, .. } = listener;
        let outlet = if *role == Role::User { self.outlets.far() } else { &self.outlets.near };
        // The interface of the outlet would count as that of the packet.
        setsockopt(socket, sockopt::Ipv4PacketInfo, &false)?;
        socket.connect(outlet.local_addr()?)?;
        let mut byte = [0];
        while recv(socket.as_raw_fd(), &mut byte, MsgFlags::MSG_DONTWAIT).is_ok() {}
        Ok(())
    }
}

/// Returns the sockets of this program, each with a name that no other one gets.
fn open_sockets() -> io::Result<impl Iterator<Item = (RawFd, String)>> {
    let entries = fs::read_dir("/proc/self/fd")?.flatten();
    Ok(entries.filter_map(|entry| {
        let inode = fs::read_link(entry.path()).ok()?.into_os_string().into_string().ok()?;
        let fd = entry.file_name().to_str()?.parse().ok()?;
        inode.starts_with("socket:").then_some((fd, inode))
    }))
}

/// Duplicates a descriptor by sending it to ourselves (`SCM_RIGHTS`), the way without `unsafe`.
fn duplicate(fd: RawFd, carrier: &(UnixDatagram, UnixDatagram)) -> io::Result<OwnedFd> {
    let (rights, byte) = ([ControlMessage::ScmRights(&[fd])], [IoSlice::new(&[0])]);
    sendmsg::<()>(carrier.0.as_raw_fd(), &byte, &rights, MsgFlags::empty(), None)?;
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    let mut byte = [IoSliceMut::new(&mut byte)];
    recvmsg(&carrier.1, &mut byte, &mut control, RecvFlags::CMSG_CLOEXEC)?;
    let mut received = control.drain().filter_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut fds) => fds.next(),
        _ => None,
    });
    received.next().ok_or_else(|| io::Error::other("no descriptor"))
}

/// Opens the gate's socket on the port of a socket of the library.
fn inlet(Listener { socket: theirs, port, role }: &Listener) -> io::Result<UdpSocket> {
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    let ours = socket(AddressFamily::Inet, SockType::Datagram, flags, None)?;
    // The operating system may grant less.
    let _less = setsockopt(&ours, sockopt::RcvBuf, &WAITING);
    setsockopt(&ours, sockopt::ReuseAddr, &true)?;
    setsockopt(theirs, sockopt::ReuseAddr, &true)?;
    if *role == Role::Multicast {
        setsockopt(&ours, sockopt::ReusePort, &true)?;
    }
    let address = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, *port);
    bind(ours.as_raw_fd(), &SockaddrIn::from(address))?;
    if *role != Role::Multicast {
        // Nobody else may take the port.
        setsockopt(&ours, sockopt::ReuseAddr, &false)?;
        setsockopt(theirs, sockopt::ReuseAddr, &false)?;
    }
    Ok(UdpSocket::from(ours))
}
