//! Access to the page: which requests it answers.

use std::fmt;
use std::net::{IpAddr, SocketAddr};

use subtle::ConstantTimeEq;

use crate::http::Request;

/// Length of a token, bytes.
const TOKEN_BYTES: usize = 16;

/// Secret in the address of a page that other computers may open.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Returns a new random token of 128 bits.
    ///
    /// # Errors
    /// Where the operating system has no random numbers.
    pub fn random() -> Result<Self, getrandom::Error> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Returns the token as text, for the address.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns whether `text` is this token, in a time that does not depend on where they differ.
    fn matches(&self, text: &str) -> bool {
        self.0.as_bytes().ct_eq(text.as_bytes()).into()
    }
}

/// Hides the secret.
impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(...)")
    }
}

/// Reason why a request is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Denied {
    /// `Host` is missing or is a name: another site's name may lead here (DNS rebinding).
    Host,
    /// The request comes from a page of another site.
    Origin,
    /// The token is missing or wrong.
    Token,
}

impl Denied {
    /// Returns what to tell a person.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Host => "Open this page by the address that plumb printed.\n",
            Self::Origin => "Another site's page may not use this page.\n",
            Self::Token => {
                "This page needs its token: open the whole address that plumb printed.\n"
            }
        }
    }
}

/// Rule that decides which requests are answered.
#[derive(Debug, Clone)]
pub(crate) struct Access {
    address: SocketAddr,
    /// `None` on a loopback address.
    token: Option<Token>,
}

impl Access {
    pub(crate) fn new(address: SocketAddr, token: Option<Token>) -> Self {
        Self { address, token }
    }

    /// Checks a request: its `Host`, its `Origin` and its token.
    pub(crate) fn check(&self, request: &Request) -> Result<(), Denied> {
        let host = request.header("host").ok_or(Denied::Host)?;
        if !self.is_own_host(host) {
            return Err(Denied::Host);
        }
        // A program that is no browser sends no origin.
        if request.header("origin").is_some_and(|origin| origin != format!("http://{host}")) {
            return Err(Denied::Origin);
        }
        let Some(token) = &self.token else { return Ok(()) };
        let given = [request.parameter("token"), request.cookie(&self.cookie_name())];
        if given.into_iter().flatten().any(|text| token.matches(text)) {
            Ok(())
        } else {
            Err(Denied::Token)
        }
    }

    /// Returns the cookie that carries the token of a request's address from then on.
    pub(crate) fn cookie(&self, request: &Request) -> Option<String> {
        let token = self.token.as_ref()?;
        request.parameter("token").filter(|text| token.matches(text))?;
        let (name, token) = (self.cookie_name(), token.as_str());
        Some(format!("{name}={token}; Path=/; HttpOnly; SameSite=Strict"))
    }

    /// Returns the cookie's name. Cookies are shared between the ports of a computer.
    fn cookie_name(&self) -> String {
        format!("plumb-{}", self.address.port())
    }

    /// Returns whether `host` is an address or `localhost`. Its port may be that of a tunnel.
    fn is_own_host(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !name.ends_with(':') && !port.ends_with(']') => (name, port),
            _ => (host, "80"),
        };
        if port.parse::<u16>().is_err() {
            return false;
        }
        if name.eq_ignore_ascii_case("localhost") {
            return true;
        }
        let name = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
        match name.parse::<IpAddr>() {
            Ok(address) => address.is_loopback() || !self.address.ip().is_loopback(),
            Err(_) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::Parsed;

    fn access(address: &str, token: Option<&str>) -> Access {
        Access::new(address.parse().unwrap(), token.map(|token| Token(token.to_owned())))
    }

    fn check(access: &Access, target: &str, headers: &[&str]) -> Result<(), Denied> {
        let lines: String = headers.iter().map(|line| format!("{line}\r\n")).collect();
        let text = format!("GET {target} HTTP/1.1\r\n{lines}\r\n");
        let Parsed::Complete(request, _) = Request::parse(text.as_bytes()) else {
            panic!("{text}")
        };
        access.check(&request)
    }

    #[test]
    fn only_own_hosts_and_origins_are_accepted() {
        let local = access("127.0.0.1:7586", None);
        for host in
            ["127.0.0.1:7586", "localhost:7586", "LocalHost:9000", "[::1]:7586", "localhost"]
        {
            assert_eq!(check(&local, "/", &[&format!("Host: {host}")]), Ok(()), "{host}");
        }
        for host in ["evil.example:7586", "127.0.0.1.evil.example", "192.168.1.5:7586", "", "a:b"] {
            let answer = check(&local, "/", &[&format!("Host: {host}")]);
            assert_eq!(answer, Err(Denied::Host), "{host}");
        }
        assert_eq!(check(&local, "/", &[]), Err(Denied::Host));
        let from = |origin: &str| {
            check(&local, "/socket", &["Host: 127.0.0.1:7586", &format!("Origin: {origin}")])
        };
        assert_eq!(from("http://127.0.0.1:7586"), Ok(()));
        for origin in
            ["http://evil.example", "null", "https://127.0.0.1:7586", "http://localhost:7586"]
        {
            assert_eq!(from(origin), Err(Denied::Origin), "{origin}");
        }
    }

    #[test]
    fn a_token_is_needed_where_there_is_one() {
        let open = access("0.0.0.0:7586", Some("00ff"));
        let host = "Host: 192.168.1.5:7586";
        assert_eq!(check(&open, "/?token=00ff", &[host]), Ok(()));
        assert_eq!(check(&open, "/", &[host, "Cookie: a=b; plumb-7586=00ff"]), Ok(()));
        for (target, cookie) in [
            ("/", "Cookie: plumb-7587=00ff"),
            ("/?token=", "Cookie: a=b"),
            ("/?token=00fe", "Cookie: a=b"),
            ("/?token=00ff0", "Cookie: plumb-7586=00f"),
        ] {
            assert_eq!(check(&open, target, &[host, cookie]), Err(Denied::Token), "{target}");
        }
        assert_eq!(check(&open, "/?token=00ff", &["Host: robot.example"]), Err(Denied::Host));
    }

    #[test]
    fn tokens_are_random_and_hidden_from_debug() {
        let [a, b] = [Token::random().unwrap(), Token::random().unwrap()];
        assert_ne!(a, b);
        assert_eq!(a.as_str().len(), 2 * TOKEN_BYTES);
        assert!(!format!("{a:?}").contains(a.as_str()));
    }
}
