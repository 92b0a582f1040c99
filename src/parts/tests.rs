//! A role of toys.

use schemars::JsonSchema;
use serde::Deserialize;

use super::*;

trait Toy: std::fmt::Debug {
    fn noise(&self) -> String;
}

impl Role for dyn Toy {
    type Inputs<'a> = &'a str;
    const NAME: &'static str = "toy";
    const KEY: &'static str = "toy.kind";
    const OPTIONS: &'static str = "toy.options";
}

static TOYS: Registry<dyn Toy> = Registry(&[
    Part { name: "drum", help: "beats", options: options_of::<Drum>(), build: drum },
    Part {
        name: "stick",
        help: "does nothing",
        options: no_options,
        build: |_| Ok(Box::new(Noise(String::new()))),
    },
]);

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Drum {
    /// How often.
    beats: usize,
    /// In which file.
    #[serde(default)]
    score: Option<String>,
}

#[derive(Debug)]
struct Noise(String);

impl Toy for Noise {
    fn noise(&self) -> String {
        self.0.clone()
    }
}

fn drum(context: &PartContext<'_, dyn Toy>) -> Result<Box<dyn Toy>, PartError> {
    let Drum { beats, score } = context.options()?;
    if beats == 0 {
        return Err(context.bad_option("beats", "1 or more", beats));
    }
    let score = score.map(|path| context.read(&path)).transpose()?.unwrap_or_default();
    Ok(Box::new(Noise(context.inputs.repeat(beats) + &score)))
}

fn built(name: &str, options: &str, file: &str) -> Result<Box<dyn Toy>, PartError> {
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("toy.kind", name).with_options(Some(&options), file);
    TOYS.build(&PartContext { choice: &choice, inputs: "bum", environment: |_| None })
}

#[test]
fn a_part_is_made_from_its_options_and_inputs() {
    assert_eq!(built("drum", "beats = 2", "run.toml").unwrap().noise(), "bumbum");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("score.txt"), "!").unwrap();
    let file = folder.path().join("run.toml").display().to_string();
    let toy = built("drum", "beats = 1\nscore = 'score.txt'", &file).unwrap();
    assert_eq!(toy.noise(), "bum!", "paths start from the file's folder");
    assert!(built("stick", "", "").is_ok());
}

#[test]
fn what_is_wrong_is_told_by_key() {
    for (name, options, wanted) in [
        ("gong", "", "toy.kind: expected drum or stick, got gong"),
        ("drum", "", "run.toml: missing key: toy.options.beats"),
        ("drum", "beats = 0", "run.toml: toy.options.beats: expected 1 or more, got 0"),
        ("drum", "beets = 1", "toy.options.beets: unknown key; did you mean beats?"),
        ("drum", "beats = 'two'", "toy.options.beats: expected an integer, 0 or more, got \"two\""),
        ("drum", "beats = 1\nscore = 'none'", "none: No such file"),
        ("stick", "beats = 1", "run.toml: toy.options.beats: the toy \"stick\" has no options"),
    ] {
        let error = built(name, options, "run.toml").unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}
