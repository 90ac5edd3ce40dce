//! Who may talk with the server: pages of its own, programs of this machine, and whoever has the token.

use axum::http::{HeaderMap, header};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::net::{IpAddr, SocketAddr};

/// A number that nobody guesses: the keys of hash tables come from the operating system.
pub fn token() -> String {
    let half = || RandomState::new().build_hasher().finish();
    format!("{:016x}{:016x}", half(), half())
}

/// The rules.
#[derive(Clone, Debug)]
pub struct Access {
    token: String,
    /// Origins of pages that may connect, beside our own.
    origins: Vec<String>,
    /// Whether other machines reach it at all.
    is_open: bool,
}

impl Access {
    /// With a token, for pages of these origins beside our own; `is_open`: other machines reach the server.
    pub fn new(token: String, origins: Vec<String>, is_open: bool) -> Self {
        Self { token, origins, is_open }
    }

    /// Whether a request may change anything.
    ///
    /// # Errors
    /// The reason why it is not answered at all.
    pub fn check(&self, headers: &HeaderMap, from: SocketAddr, token: Option<&str>) -> Result<bool, String> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
        let host = text(header::HOST).unwrap_or_default();
        let has_token = token.is_some_and(|own| same(own, &self.token));
        // a name of elsewhere that was made to mean this machine
        if !self.is_open && !is_loopback(name_of(host)) {
            return Err(format!("this server is `localhost`, not `{host}`"));
        }
        if let Some(origin) = text(header::ORIGIN)
            && !self.is_known(origin, host)
        {
            let way = format!("start the server with `--allow-origin {origin}` if you trust it");
            return Err(format!("pages of {origin} may not connect: {way}"));
        }
        Ok(has_token || from.ip().to_canonical().is_loopback())
    }

    fn is_known(&self, origin: &str, host: &str) -> bool {
        let own = origin.split_once("://").map_or(origin, |(_, rest)| rest);
        own == host || self.origins.iter().any(|known| known.trim_end_matches('/') == origin)
    }
}

/// Whether two texts are the same, in a time that does not reveal where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
}

/// A host without its port.
fn name_of(host: &str) -> &str {
    let without = host.rsplit_once(':').filter(|(_, port)| port.bytes().all(|b| b.is_ascii_digit()));
    without.map_or(host, |(name, _)| name).trim_start_matches('[').trim_end_matches(']')
}

fn is_loopback(name: &str) -> bool {
    name == "localhost" || name.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: SocketAddr = SocketAddr::new(IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 5000);
    const THERE: SocketAddr = SocketAddr::new(IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 7)), 5000);

    fn headers(pairs: &[(header::HeaderName, &'static str)]) -> HeaderMap {
        pairs
            .iter()
            .map(|(name, value)| (name.clone(), axum::http::HeaderValue::from_static(value)))
            .collect()
    }

    #[test]
    fn foreign_pages_and_foreign_names_are_refused() {
        let access = Access::new("secret".into(), vec!["https://viewer.example".into()], false);
        let own = headers(&[(header::HOST, "127.0.0.1:8765"), (header::ORIGIN, "http://127.0.0.1:8765")]);
        assert_eq!(access.check(&own, HERE, None), Ok(true));
        let program = headers(&[(header::HOST, "localhost:8765")]);
        assert_eq!(access.check(&program, HERE, None), Ok(true));
        let known = headers(&[(header::HOST, "localhost:8765"), (header::ORIGIN, "https://viewer.example")]);
        assert_eq!(access.check(&known, HERE, None), Ok(true));
        let foreign = headers(&[(header::HOST, "localhost:8765"), (header::ORIGIN, "https://evil.example")]);
        assert!(access.check(&foreign, HERE, Some("secret")).is_err());
        let renamed =
            headers(&[(header::HOST, "evil.example:8765"), (header::ORIGIN, "http://evil.example:8765")]);
        assert!(access.check(&renamed, HERE, None).is_err());
        let nothing = headers(&[(header::HOST, "localhost:8765"), (header::ORIGIN, "null")]);
        assert!(access.check(&nothing, HERE, None).is_err());
    }

    #[test]
    fn another_machine_watches_and_writes_with_the_token_only() {
        let access = Access::new("secret".into(), Vec::new(), true);
        let own = headers(&[(header::HOST, "rover:8765"), (header::ORIGIN, "http://rover:8765")]);
        assert_eq!(access.check(&own, THERE, None), Ok(false));
        assert_eq!(access.check(&own, THERE, Some("secre")), Ok(false));
        assert_eq!(access.check(&own, THERE, Some("secret")), Ok(true));
    }

    #[test]
    fn two_tokens_differ() {
        assert!(token() != token() && token().len() == 32);
    }
}
