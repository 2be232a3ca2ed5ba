//! Cameras in the network: servers on this computer that send what cameras send, and what they
//! should not.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

use plumb_config::error_chain::ErrorChain;
use plumb_frame::image::Bgr;
use plumb_pictures::jpeg;

use super::limits::PATIENCE;
use super::*;
use crate::camera_file;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };
const INTRINSICS: Intrinsics =
    Intrinsics { fx: 60.0, fy: 60.0, cx: 31.5, cy: 23.5, depth_scale: 1000.0, distortion: None };

/// Time between two pictures: both are seen.
const PERIOD: Duration = Duration::from_millis(60);

/// Longest wait for what must come.
const LONG: Duration = Duration::from_secs(20);

const HEAD: &str = "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=ball\r\n";

/// Starts a server. `send` gets the number of each connection, from 0, after its request, and the
/// connection.
fn serve(send: impl Fn(usize, &mut TcpStream) -> std::io::Result<()> + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || accept(&listener, send));
    port
}

fn accept(listener: &TcpListener, send: impl Fn(usize, &mut TcpStream) -> std::io::Result<()>) {
    for (number, stream) in listener.incoming().enumerate() {
        let mut stream = stream.unwrap();
        let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
        let request = lines.next().unwrap().unwrap();
        assert_eq!(request, "GET /video HTTP/1.1");
        while lines.next().is_some_and(|line| !line.unwrap().is_empty()) {}
        // The other side may end the connection.
        let _ended = send(number, &mut stream);
    }
}

fn settings(port: u16) -> HttpSettings {
    let url = Some(format!("http://127.0.0.1:{port}/video").parse().unwrap());
    HttpSettings { url, latency: None }
}

fn open(port: u16) -> Result<HttpSource, String> {
    HttpSource::open(&settings(port), INTRINSICS).map_err(|error| ErrorChain(&*error).to_string())
}

/// Returns a picture of some kB whose upper left corner has this level of grey.
fn picture(level: u8) -> Vec<u8> {
    let mut image = Image::filled(SIZE.width, SIZE.height, [level; 3]);
    let noise = (0..SIZE.width * SIZE.height).map(|k| ((k * k * 7919) >> 5) as u8);
    for (pixel, noise) in image.pixels_mut().iter_mut().zip(noise).skip(16 * SIZE.width) {
        *pixel = [noise; 3];
    }
    jpeg::encode(&image, 95).unwrap()
}

/// Returns a part with its length, and the boundary before it.
fn part(picture: &[u8]) -> Vec<u8> {
    let length = picture.len();
    let head = format!("--ball\r\nContent-Type: image/jpeg\r\nContent-Length: {length}\r\n\r\n");
    [head.as_bytes(), picture, b"\r\n"].concat()
}

/// Sends the head of a reply and pictures of these levels, with time between them.
fn send(stream: &mut TcpStream, levels: &[u8]) -> std::io::Result<()> {
    stream.write_all(format!("{HEAD}\r\n").as_bytes())?;
    for level in levels {
        stream.write_all(&part(&picture(*level)))?;
        thread::sleep(PERIOD);
    }
    Ok(())
}

/// Leaves a connection open until the other side ends it.
fn hang(stream: &mut TcpStream) -> std::io::Result<()> {
    std::io::copy(stream, &mut std::io::sink()).map(drop)
}

/// Returns the level of grey of the next frame, or the reason why there is none.
fn next(source: &mut HttpSource) -> Result<u8, SourceError> {
    let frame = source.next_frame()?.unwrap();
    assert_eq!(frame.intrinsics(), &Intrinsics { depth_scale: 0.0, ..INTRINSICS });
    let corner: Bgr = frame.colour().get(4, 4).unwrap();
    Ok(corner[0])
}

/// Returns the level of the next frame, within the rounding of JPEG, after any losses.
fn level(source: &mut HttpSource) -> u8 {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        if let Ok(level) = next(source) {
            return level.saturating_add(5) / 10 * 10;
        }
    }
    panic!("no picture comes");
}

/// Returns whether only no picture has come.
fn is_silence(error: &SourceError) -> bool {
    let cause = error.source().and_then(|cause| cause.downcast_ref());
    matches!(cause, Some(HttpError::Silent(_)))
}

/// Returns the next loss that is no silence.
fn loss(source: &mut HttpSource) -> String {
    let begin = Instant::now();
    while begin.elapsed() < LONG {
        match next(source) {
            Err(error) if !is_silence(&error) => return ErrorChain(&error).to_string(),
            _ => {}
        }
    }
    panic!("nothing is lost");
}

#[test]
fn boundaries_of_every_camera_are_read() {
    // The type, what stands before each picture, and what stands after it; `#` is its length.
    let cases = [
        ("multipart/x-mixed-replace; boundary=ball", "--ball\r\nContent-Length: #\r\n\r\n", "\r\n"),
        // The next boundary ends a picture without a length.
        ("multipart/x-mixed-replace;boundary=ball", "--ball\r\nContent-Type: a\r\n\r\n", "\r\n"),
        ("multipart/x-mixed-replace;boundary=ball", "--ball\n\n", "\n"),
        ("multipart/x-mixed-replace;boundary=ball", "--ball\r\n\r\n", ""),
        // mjpg-streamer, ESP32-CAM, IP Webcam.
        ("multipart/x-mixed-replace;boundary=--ball", "--ball\r\ncontent-length:  #\r\n\r\n", ""),
        ("multipart/x-mixed-replace;boundary=--ball", "----ball\r\nContent-length: #\r\n\r\n", ""),
        ("multipart/x-mixed-replace; Boundary=\"ball\"", "\r\n--ball\r\nX: #\r\n\r\n", "\r\n\r\n"),
        ("multipart/mixed; a=b; boundary=ball ", "ball\r\nContent-Length: #\r\n\r\n", "\r\n"),
    ];
    for (kind, before, after) in cases {
        let port = serve(move |_, stream| {
            write!(stream, "HTTP/1.0 200 OK\r\nContent-Type: {kind}\r\n\r\nwelcome\r\n")?;
            for level in [40, 80, 120, 160] {
                let picture = picture(level);
                let head = before.replace('#', &picture.len().to_string());
                stream.write_all(&[head.as_bytes(), &picture, after.as_bytes()].concat())?;
                thread::sleep(PERIOD);
            }
            hang(stream)
        });
        // The first one was taken by `open`.
        let mut source = open(port).unwrap_or_else(|error| panic!("{before:?}: {error}"));
        let levels = [(); 2].map(|()| level(&mut source));
        assert_eq!(levels, [80, 120], "{kind} {before:?} {after:?}");
    }
}

#[test]
fn a_reply_in_chunks_is_read() {
    let port = serve(|_, stream| {
        write!(stream, "{HEAD}Transfer-Encoding: chunked\r\n\r\n")?;
        for level in [40, 80, 120] {
            for chunk in part(&picture(level)).chunks(997) {
                write!(stream, "{:x};name=value\r\n", chunk.len())?;
                stream.write_all(chunk)?;
                stream.write_all(b"\r\n")?;
            }
            thread::sleep(PERIOD);
        }
        stream.write_all(b"0\r\n\r\n")?;
        hang(stream)
    });
    let mut source = open(port).unwrap();
    assert_eq!([level(&mut source), level(&mut source)], [80, 120]);
    let text = loss(&mut source);
    assert!(text.contains("has ended the connection"), "{text}");
}

#[test]
fn a_damaged_picture_is_lost_alone() {
    let port = serve(|_, stream| {
        send(stream, &[40])?;
        let whole = picture(80);
        for damaged in [&whole[..whole.len() / 2], b"", b"no picture"] {
            stream.write_all(&part(damaged))?;
            thread::sleep(PERIOD);
        }
        let large = Image::filled(640, 480, [90; 3]);
        stream.write_all(&part(&jpeg::encode(&large, 95).unwrap()))?;
        thread::sleep(PERIOD);
        // A length that is too small: the next boundary is found all the same.
        let wrong = "--ball\r\nContent-Length: 100\r\n\r\n";
        stream.write_all(&[wrong.as_bytes(), &whole, b"\r\n"].concat())?;
        thread::sleep(PERIOD);
        stream.write_all(&part(&picture(120)))?;
        hang(stream)
    });
    let mut source = open(port).unwrap();
    for expected in ["no end", "not a picture", "not a picture", "640x480"] {
        let text = loss(&mut source);
        assert!(text.contains("decoded") && text.contains(expected), "{expected}: {text}");
    }
    assert_eq!(level(&mut source), 120);
}

#[test]
fn a_picture_that_is_too_large_ends_the_connection_before_it_fills_the_memory() {
    let port = serve(|number, stream| {
        send(stream, &[[40, 80, 120][number.min(2)]])?;
        match number {
            0 => write!(stream, "--ball\r\nContent-Length: 4000000000\r\n\r\n")?,
            1 => stream.write_all(b"--ball\r\n\r\n")?,
            _ => return hang(stream),
        }
        let line = [vec![b'a'; 65_535], vec![b'\n']].concat();
        loop {
            stream.write_all(&line)?;
        }
    });
    let mut source = open(port).unwrap();
    for expected in [80, 120] {
        let text = loss(&mut source);
        assert!(text.contains("more than 16 MiB"), "{text}");
        assert_eq!(level(&mut source), expected);
    }
}

/// Checks that a camera is connected again that ends its first connection so, in a picture.
fn reconnects(told: &str, end: impl Fn(&mut TcpStream, &[u8]) + Send + 'static) {
    let port = serve(move |number, stream| {
        send(stream, &[[40, 80][number.min(1)]])?;
        if number > 0 {
            return hang(stream);
        }
        let (begin, rest) = (part(&picture(200)), part(&picture(200)).split_off(1000));
        stream.write_all(&begin[..1000])?;
        end(stream, &rest);
        Ok(())
    });
    let mut source = open(port).unwrap();
    let text = loss(&mut source);
    assert!(text.contains(told), "{text}");
    assert_eq!(level(&mut source), 80);
}

#[test]
fn a_server_that_ends_within_a_picture_is_connected_again() {
    reconnects("has ended the connection", |_, _| {});
}

#[test]
fn a_server_that_hangs_within_a_picture_is_connected_again() {
    reconnects("no whole picture for 3 s", |_, _| thread::sleep(PATIENCE * 4 / 3));
}

#[test]
fn a_server_that_trickles_is_connected_again() {
    reconnects("no whole picture for 3 s", |stream, rest| {
        for byte in rest {
            if stream.write_all(&[*byte]).is_err() {
                break;
            }
            thread::sleep(PATIENCE / 50);
        }
    });
}

#[test]
fn an_outage_is_told_once() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let server = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        send(&mut stream, &[40]).unwrap();
        drop((stream, listener));
        // Nobody listens: several attempts fail.
        thread::sleep(Duration::from_millis(1500));
        let listener = TcpListener::bind(address).unwrap();
        accept(&listener, |_, stream| {
            send(stream, &[80])?;
            hang(stream)
        });
    });
    let mut source = open(address.port()).unwrap();
    let mut losses = Vec::new();
    let seen = loop {
        match next(&mut source) {
            Ok(level) => break level,
            Err(error) if is_silence(&error) => {}
            Err(error) => losses.push(error),
        }
    };
    assert!(seen.abs_diff(80) < 5 && losses.len() == 1, "{seen} {losses:?}");
    assert!(!server.is_finished());
}

#[test]
fn stale_pictures_are_dropped() {
    let port = serve(|_, stream| {
        send(stream, &[10])?;
        // After a hitch of the network, pictures come at once.
        let levels = (2..=20).map(|k| part(&picture(10 * k)));
        stream.write_all(&levels.collect::<Vec<_>>().concat())?;
        hang(stream)
    });
    let mut source = open(port).unwrap();
    assert_eq!(level(&mut source), 200);
}

#[test]
fn a_server_without_pause_is_seen() {
    let port = serve(|_, stream| {
        send(stream, &[40])?;
        let parts = part(&picture(80)).repeat(100);
        loop {
            stream.write_all(&parts)?;
        }
    });
    let mut source = open(port).unwrap();
    assert_eq!([(); 3].map(|()| level(&mut source)), [80; 3]);
}

#[test]
fn the_time_of_a_picture_is_its_arrival_less_the_latency() {
    let port = serve(|_, stream| {
        send(stream, &[40; 40])?;
        hang(stream)
    });
    for latency in [0.0, 0.2] {
        let chosen = CameraTime::try_from(latency).ok();
        let settings = HttpSettings { latency: chosen, ..settings(port) };
        let mut source = HttpSource::open(&settings, INTRINSICS).unwrap();
        let frame = source.next_frame().unwrap().unwrap();
        let age = source.now() - frame.time();
        assert!((latency..latency + 0.1).contains(&age), "{age}");
    }
}

#[test]
fn what_sends_no_pictures_is_refused_with_a_hint() {
    let refusal = |reply: &'static str| {
        let port = serve(move |_, stream| stream.write_all(reply.as_bytes()));
        open(port).err().unwrap()
    };
    for (reply, hint) in [
        ("HTTP/1.1 404 Not Found\r\n\r\n", "the reply is 404 \"Not Found\""),
        ("HTTP/1.1 401 Unauthorized\r\n\r\n", "http://USER:PASSWORD@HOST"),
        ("HTTP/1.1 302 Found\r\nLocation: /a\r\n\r\n", "the pictures are at \"/a\""),
        ("HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n", "\"image/jpeg\", and no row"),
        ("HTTP/1.1 200 OK\r\nContent-Type: multipart/mixed\r\n\r\n", "with a boundary"),
        ("SSH-2.0-OpenSSH_9.2\r\n", "speaks no HTTP"),
        ("HTTP/1.1 200 OK\r\n", "has ended the connection"),
    ] {
        let text = refusal(reply);
        assert!(text.contains(hint), "{text}");
    }
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let text = open(port).err().unwrap();
    assert!(text.contains("cannot be reached"), "{text}");
    let camera = camera_file::paper().unwrap();
    let error = HttpSettings::default().open(&camera, None).err().unwrap().to_string();
    assert!(error.contains("url = \"http://HOST:PORT/PATH\""), "{error}");
    // Pictures of another size than those of the intrinsics.
    let port = serve(|_, stream| send(stream, &[40]));
    let error = settings(port).open(&camera, None).err().unwrap().to_string();
    assert!(error.contains("64x48"), "{error}");
}
