//! Replies of cameras in the network.

use plumb_cameras::fuzzing;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "http_reply",
    input: "a camera's reply: its head, and pictures with heads of their own",
    run,
    max_length: 2000,
    smoke: 10_000,
    words: &[
        "HTTP/1.1 200 OK\r\n",
        "Content-Type: multipart/x-mixed-replace; boundary=",
        "Transfer-Encoding: chunked\r\n",
        "Content-Length: ",
        "\r\n\r\n",
        "\r\n--ball\r\n",
        "ffffffffffffffff\r\n",
        "18446744073709551615",
    ],
};

/// Reads the pictures.
pub fn run(input: &[u8]) {
    let pictures = fuzzing::http(input);
    assert!(pictures <= input.len() as u64, "{pictures} pictures");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pictures_in_the_corpus_are_read() {
        for (reply, count) in [
            (&include_bytes!("../../corpus/http_reply/lengths")[..], 2),
            (include_bytes!("../../corpus/http_reply/chunks"), 2),
            (include_bytes!("../../corpus/http_reply/boundaries"), 2),
        ] {
            assert_eq!(fuzzing::http(reply), count);
        }
    }
}
