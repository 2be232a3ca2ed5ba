//! Requests to the page's server.

use std::cell::OnceCell;

use plumb_page::RigView;
use plumb_page::fuzzing::Parsers;
use plumb_runtime::rig::Rig;

use super::Target;

/// This target.
pub const TARGET: Target = Target {
    name: "page_request",
    input: "the head of an HTTP request",
    run,
    max_length: 2000,
    smoke: 10_000,
    words: &[
        "GET / HTTP/1.1\r\n",
        "GET /socket?token=",
        "Host: 127.0.0.1:7586\r\n",
        "Origin: http://",
        "Cookie: plumb-7586=",
        "Upgrade: websocket\r\n",
        "Sec-WebSocket-Key: ",
        "\r\n\r\n",
        "[::1]",
    ],
};

thread_local! {
    /// The page.
    static PARSERS: OnceCell<Option<Parsers>> = const { OnceCell::new() };
}

fn new_parsers() -> Option<Parsers> {
    Parsers::new(RigView::of(&Rig::paper().ok()?))
}

/// Reads the request and decides about its access. A page with a token, which no input knows,
/// answers none.
pub fn run(input: &[u8]) {
    PARSERS.with(|cell| {
        let answered = cell.get_or_init(new_parsers).as_ref().and_then(|it| it.request(input));
        if let Some((_, with_token)) = answered {
            assert!(!with_token, "a request without the token is answered");
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_requests_in_the_corpus_are_answered_without_a_token_on_loopback() {
        let parsers = new_parsers().unwrap();
        for request in [
            &include_bytes!("../../corpus/page_request/page")[..],
            include_bytes!("../../corpus/page_request/socket"),
        ] {
            assert_eq!(parsers.request(request), Some((true, false)));
        }
    }
}
