//! Whether somebody answers at an address.

use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::Duration;

/// Whether the server of a URL takes a connection within a time; nothing is asked of it.
///
/// # Errors
/// Why not.
pub fn reachable(url: &str, wait: Duration) -> Result<(), String> {
    let url = reqwest::Url::parse(url).map_err(|error| error.to_string())?;
    let host = url.host_str().ok_or("no host")?;
    let port = url.port_or_known_default().ok_or("no port")?;
    let addresses = (host.trim_matches(['[', ']']), port).to_socket_addrs();
    let mut last = "no address".to_owned();
    for address in addresses.map_err(|error| error.to_string())? {
        match TcpStream::connect_timeout(&address, wait) {
            Ok(_) => return Ok(()),
            Err(error) => last = error.to_string(),
        }
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_is_there_or_not() {
        let server = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = server.local_addr().unwrap();
        let url = format!("http://{address}/v1");
        assert_eq!(reachable(&url, Duration::from_secs(5)), Ok(()));
        drop(server);
        assert!(reachable(&url, Duration::from_secs(5)).is_err());
        assert!(reachable("nonsense", Duration::ZERO).is_err());
    }
}
