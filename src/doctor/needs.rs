//! What a run needs of the machine.

use std::path::Path;

use crate::clock::ClockKind;
use crate::run::{ConfigError, PreparedRun, RunConfig};

/// What a run file needs of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct RunNeeds {
    /// The run file.
    pub file: String,
    /// Each camera with the bytes of one of its frames, depth included.
    pub frame_bytes: Vec<(String, u64)>,
    /// Which clock drives it.
    pub clock: ClockKind,
    /// Frames a second.
    pub rate_hz: f64,
    /// Keys that name a service, with its address.
    pub services: Vec<(String, String)>,
    /// Whether services are asked at all.
    pub asks_services: bool,
    /// Keys that name a program that the run starts, with the program.
    pub programs: Vec<(String, String)>,
}

impl RunNeeds {
    /// Reads everything that a run file names; `data` is what `$data` stands for.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and line or key.
    pub fn read(config: RunConfig, data: Option<&Path>) -> Result<Self, ConfigError> {
        let settings: toml::Table = config.resolved.parse().unwrap_or_default();
        let (mut services, mut programs) = (Vec::new(), Vec::new());
        gather(&settings, "", &mut services, &mut programs);
        let prepared = PreparedRun::read(config, data)?;
        let config = &prepared.config;
        Ok(Self {
            file: config.origin.to_string(),
            frame_bytes: prepared.frame_bytes(),
            clock: config.clock,
            rate_hz: config.camera.rate_hz,
            services,
            asks_services: !config.services.offline,
            programs,
        })
    }
}

/// Every key whose value is an address, and every command.
fn gather(
    table: &toml::Table,
    within: &str,
    services: &mut Vec<(String, String)>,
    programs: &mut Vec<(String, String)>,
) {
    for (name, value) in table {
        let key = if within.is_empty() { name.clone() } else { format!("{within}.{name}") };
        match value {
            toml::Value::Table(inner) => gather(inner, &key, services, programs),
            toml::Value::String(text) if is_address(text) => services.push((key, text.clone())),
            toml::Value::Array(words) if name == "command" => {
                let program = words.first().and_then(toml::Value::as_str);
                programs.extend(program.map(|program| (key, program.to_owned())));
            }
            toml::Value::String(_)
            | toml::Value::Array(_)
            | toml::Value::Integer(_)
            | toml::Value::Float(_)
            | toml::Value::Boolean(_)
            | toml::Value::Datetime(_) => {}
        }
    }
}

fn is_address(text: &str) -> bool {
    ["http://", "https://"].iter().any(|scheme| text.starts_with(scheme))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_commands_are_gathered_by_their_keys() {
        let text = r#"
            [goal]
            text = "see http://nowhere"
            options = { url = "http://127.0.0.1:8080/v1" }
            [camera.options]
            command = ["ffmpeg", "-i", "x"]
        "#;
        let (mut services, mut programs) = (Vec::new(), Vec::new());
        gather(&text.parse().unwrap(), "", &mut services, &mut programs);
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        assert_eq!(services, [pair("goal.options.url", "http://127.0.0.1:8080/v1")]);
        assert_eq!(programs, [pair("camera.options.command", "ffmpeg")]);
    }
}
