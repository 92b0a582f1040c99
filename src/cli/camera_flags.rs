//! Flags of `groundloop camera KIND`, made of the options that the kind declares: the first one that must be
//! there stands alone, the others are flags of their names.

use std::str::FromStr;

use clap::{Arg, ArgAction, ArgMatches, Command};
use toml::Value;

use crate::hardware::{CAMERAS, CameraPort, EXTERNAL};
use crate::parts::{Part, PartOption};

/// Kinds that need a run file, or are another process: `groundloop hardware` plays them.
const NOT_ALONE: [&str; 2] = [EXTERNAL, "sim"];

/// The kinds that a process can play alone.
pub(super) fn kinds() -> impl Iterator<Item = &'static Part<CameraPort>> {
    CAMERAS.0.iter().filter(|part| !NOT_ALONE.contains(&part.name))
}

/// The flags of one kind.
pub(super) struct Flags(Vec<PartOption>);

/// How an option is written on the command line.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    Words,
    Whole,
    Number,
    Wholes,
    Numbers,
    Switch,
}

fn form(option: &PartOption) -> Form {
    match option.kind.as_str() {
        "array of string" => Form::Words,
        "array of integer" => Form::Wholes,
        "array of number" => Form::Numbers,
        "integer" => Form::Whole,
        "number" => Form::Number,
        "boolean" => Form::Switch,
        _ => Form::Text,
    }
}

/// A command with the flags of a kind.
pub(super) fn flags_of(part: &Part<CameraPort>, command: Command) -> Command {
    let flags = Flags::of(part);
    let first = flags.first().map(|option| option.name.clone());
    flags.0.iter().fold(command, |command, option| {
        let text = |option: &PartOption| {
            let meaning = option.meaning.replace('\n', " ");
            let meaning = meaning.strip_suffix('.').unwrap_or(&meaning).to_owned();
            match &option.default {
                Some(default) => format!("{meaning} [default: {default}]"),
                None => meaning,
            }
        };
        let arg = Arg::new(option.name.clone()).help(text(option)).required(option.required);
        let arg = match form(option) {
            Form::Switch => arg.action(ArgAction::SetTrue),
            Form::Words => arg.num_args(1..).value_name(value_name(option)),
            Form::Text => arg.value_name(value_name(option)),
            Form::Whole | Form::Number | Form::Wholes | Form::Numbers => {
                arg.value_name(value_name(option)).allow_hyphen_values(true)
            }
        };
        let arg = match (first.as_ref() == Some(&option.name), form(option)) {
            // A command has flags of its own: it stands behind `--`.
            (true, Form::Words) => arg.last(true),
            (true, _) => arg,
            (false, _) => arg.long(option.name.replace('_', "-")),
        };
        // The rate is everybody's `--fps`.
        if option.name == "rate_hz" { command } else { command.arg(arg) }
    })
}

fn value_name(option: &PartOption) -> String {
    match (option.name.as_str(), form(option)) {
        ("size", _) => "WIDTHxHEIGHT".to_owned(),
        (_, Form::Wholes | Form::Numbers) => "A,B,…".to_owned(),
        (_, Form::Whole | Form::Number) => "N".to_owned(),
        // The last word says what it is: `depth_topic` is a TOPIC.
        (name, _) => name.rsplit('_').next().unwrap_or(name).to_uppercase(),
    }
}

impl Flags {
    pub(super) fn of(part: &Part<CameraPort>) -> Self {
        Self(part.described())
    }

    /// The option that stands alone.
    fn first(&self) -> Option<&PartOption> {
        self.0.iter().find(|option| option.required)
    }

    /// The options that the flags say.
    ///
    /// # Errors
    /// The flag that is no number.
    pub(super) fn read(&self, matches: &ArgMatches) -> Result<toml::Table, clap::Error> {
        let mut options = toml::Table::new();
        for option in self.0.iter().filter(|option| option.name != "rate_hz") {
            let name = option.name.as_str();
            if form(option) == Form::Switch {
                if matches.get_flag(name) {
                    options.insert(name.to_owned(), true.into());
                }
                continue;
            }
            let Some(words) = matches.get_many::<String>(name) else { continue };
            let words: Vec<&str> = words.map(String::as_str).collect();
            let value = value(form(option), &words).ok_or_else(|| {
                let message =
                    format!("--{name}: expected {}, got {}\n", option.kind, words.join(" "));
                clap::Error::raw(clap::error::ErrorKind::ValueValidation, message)
            })?;
            options.insert(name.to_owned(), value);
        }
        Ok(options)
    }
}

fn value(form: Form, words: &[&str]) -> Option<Value> {
    let text = words.first()?;
    match form {
        Form::Text | Form::Switch => Some((*text).into()),
        Form::Words => Some(words.to_vec().into()),
        Form::Whole => Some(text.parse::<i64>().ok()?.into()),
        Form::Number => Some(text.parse::<f64>().ok()?.into()),
        Form::Wholes => list::<i64>(text),
        Form::Numbers => list::<f64>(text),
    }
}

/// Numbers that commas, blanks or an `x` part, as in `640x480`.
fn list<T: FromStr + Into<Value>>(text: &str) -> Option<Value> {
    let parts = text.split([',', 'x', ' ']).filter(|part| !part.is_empty());
    Some(Value::Array(
        parts.map(|part| Some(part.parse::<T>().ok()?.into())).collect::<Option<_>>()?,
    ))
}
