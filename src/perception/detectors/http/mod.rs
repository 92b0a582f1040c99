//! Detectors behind HTTP: an open-vocabulary model is asked for the prompts of the domain's types,
//! and then for the phrases of the goal.
//!
//! Each dialect is one file that writes requests and reads replies; everything else is the same
//! for all: boxes become left, top, right and bottom edge by the dialect's own convention, labels
//! become types by the prompt that was asked for, and what does not fit is dropped and counted.

mod convention;
mod image;
mod labels;
mod dinox;
mod hugging_face;
mod roboflow;

use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use super::boxes::clipped;
use super::colour_namer::ColourNamer;
use super::{Detector, DetectorError, DetectorInputs};
use crate::geometry::PixelBox;
use crate::http::{Client, Reply, Request, RetryPolicy, SentImage, shown_url};
use crate::mismatch::{Mismatch, listed, quoted};
use crate::parts::{Part, PartContext, PartError, options_of};
use crate::perception::model::{ObjectBox, TypeSpec};
use crate::perception::phrases::phrase_of_name;
use crate::perception::{Detection, Detections, ImageView, PhraseBox};
use convention::Convention;
use image::Encoding;
use labels::query_of;

/// Most characters of a service's message that an error repeats.
const MESSAGE_CHARS_MAX: usize = 300;

/// What `key_env` is.
const A_KEY: &str = "the name of an environment variable with a key";

/// `[perception.options]` of the detector "http".
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// How the service speaks.
    dialect: Dialect,
    /// Where the service is. Without the key where the dialect's service usually is; every model of
    /// `hugging_face` has an address of its own.
    url: Option<String>,
    /// The environment variable that holds the key, for services that want one.
    key_env: Option<String>,
    /// The model, for services that have several.
    model: Option<String>,
    /// Least score of a box, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    score_min: f64,
    /// Boxes of one type that overlap more (intersection over union, 0 to 1) are one object.
    #[schemars(range(min = 0, max = 1))]
    duplicate_iou: f64,
    /// How frames are sent.
    image: Encoding,
    /// How a task is waited for, with the dialect `dino_x`.
    poll: Poll,
    /// Bounds of each request, all attempts together.
    retry: RetryPolicy,
}

/// `[perception.options.poll]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Poll {
    /// Pause between two questions, milliseconds.
    interval_ms: u64,
    /// Most questions.
    polls_max: u32,
}

/// How a service speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Dialect {
    /// DINO-X: a task is asked for, and its result waited for.
    DinoX,
    /// An endpoint for zero-shot detection of Hugging Face.
    HuggingFace,
    /// YOLO-World at Roboflow.
    Roboflow,
}

/// What a service is asked, whatever its dialect.
struct Ask<'a> {
    url: &'a str,
    key: Option<&'a str>,
    model: Option<&'a str>,
    /// Base64.
    image: &'a str,
    mime: &'static str,
    queries: &'a [String],
    score_min: f64,
}

/// What a service answers, whatever its dialect.
struct Answer {
    /// Each box, or what is wrong with it.
    boxes: Vec<Result<RawBox, String>>,
    convention: Convention,
}

/// One box as the service wrote it.
struct RawBox {
    label: String,
    score: f64,
    numbers: [f64; 4],
}

impl RawBox {
    /// Reads a box; one without a score counts fully.
    fn read(
        object: &Value,
        label: &str,
        score: &str,
        numbers: impl Fn(&Value) -> Option<[f64; 4]>,
    ) -> Result<Self, String> {
        let text = object.get(label).and_then(Value::as_str);
        let text = text.ok_or_else(|| format!("{label}: expected a text"))?;
        let numbers = numbers(object).ok_or("its box: expected four numbers")?;
        let score = match object.get(score) {
            None | Some(Value::Null) => 1.0,
            Some(value) => value.as_f64().ok_or_else(|| format!("{score}: expected a number"))?,
        };
        Ok(Self { label: text.to_owned(), score: score.clamp(0.0, 1.0), numbers })
    }
}

/// Asks a service.
struct HttpDetector {
    options: Options,
    url: String,
    key: Option<String>,
    client: Client,
    colour_namer: ColourNamer,
    /// What each type is asked for, in the order of the perception file.
    prompts: Vec<String>,
}

/// The entry of the table of detectors.
pub(super) const PART: Part<dyn Detector> = Part {
    name: "http",
    help: "an open-vocabulary model behind HTTP: DINO-X, Hugging Face or Roboflow",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, dyn Detector>) -> Result<Box<dyn Detector>, PartError> {
    let options: Options = context.options()?;
    let url = match (&options.url, options.dialect) {
        (Some(url), _) => url.trim_end_matches('/').to_owned(),
        (None, Dialect::DinoX) => dinox::URL.to_owned(),
        (None, Dialect::Roboflow) => roboflow::URL.to_owned(),
        (None, Dialect::HuggingFace) => {
            let expected = "the address of an endpoint: every model has its own";
            return Err(context.bad_option("url", expected, "none"));
        }
    };
    let answers = context.choice.answers.clone();
    let variable = options.key_env.as_deref();
    let key = variable.and_then(context.environment).filter(|key| !key.is_empty());
    if let (Some(name), None, None) = (variable, &key, &answers) {
        return Err(context.bad_option("key_env", A_KEY, format!("{name}, which is not set")));
    }
    let DetectorInputs { perception, .. } = context.inputs;
    let prompts: Vec<String> = perception.types.iter().map(prompt_of).collect();
    if let Some((i, prompt)) = prompts.iter().enumerate().find(|(i, p)| prompts[..*i].contains(p)) {
        let type_name = &perception.types[i].name;
        let message =
            format!("type.{type_name}.prompt: expected a prompt of its own, got {prompt}");
        return Err(PartError::file("perception.toml", message));
    }
    let client = client(&options.retry)?.with_answers(answers);
    let colour_namer = ColourNamer::new(perception)?;
    Ok(Box::new(HttpDetector { options, url, key, client, colour_namer, prompts }))
}

fn client(policy: &RetryPolicy) -> Result<Client, DetectorError> {
    Ok(Client::new(policy)?)
}

/// The service does not take the key, or wants one.
fn bad_key(expected: &str, got: &str) -> DetectorError {
    let message = Mismatch::new("perception.options.key_env", expected, got).to_string();
    PartError::Options { file: String::new(), message }.into()
}

fn prompt_of(spec: &TypeSpec) -> String {
    spec.prompt.clone().unwrap_or_else(|| phrase_of_name(&spec.name))
}

impl Detector for HttpDetector {
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError> {
        self.colour_namer.learn(image, objects);
        Ok(())
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        let fault = |e: ::image::ImageError| self.reply_error(&e.to_string());
        let encoding = self.options.image;
        let text = encoding.base64(image).map_err(fault)?;
        let sent = SentImage { text, name: encoding.name(image) };
        let found = self.boxes(image, &sent, &self.prompts)?;
        let types = &self.colour_namer.perception().types;
        let objects: Vec<Detection> = found
            .into_iter()
            .filter_map(|Found { query_idx, pixel_box, score }| {
                Some(self.colour_namer.detection(image, types.get(query_idx)?, (pixel_box, score)))
            })
            .collect();
        let objects = self.colour_namer.sorted(objects, self.options.duplicate_iou);
        let places = self.boxes(image, &sent, phrases)?.into_iter();
        let phrases = places.filter_map(|Found { query_idx, pixel_box, score }| {
            Some(PhraseBox { phrase: phrases.get(query_idx)?.clone(), pixel_box, score })
        });
        Ok(Detections { objects, phrases: phrases.collect(), ..Detections::default() })
    }

    /// A service is not asked about an example: the first frame is soon enough.
    fn warm_up(&mut self, _: &ImageView<'_>) -> Result<(), DetectorError> {
        Ok(())
    }

    fn is_slow(&self) -> bool {
        true
    }
}

/// One usable box.
struct Found {
    query_idx: usize,
    pixel_box: PixelBox,
    score: f32,
}

impl HttpDetector {
    /// Where the service sees what it is asked for.
    fn boxes(
        &self,
        image: &ImageView<'_>,
        sent: &SentImage,
        queries: &[String],
    ) -> Result<Vec<Found>, DetectorError> {
        if queries.is_empty() {
            return Ok(Vec::new());
        }
        let ask = Ask {
            url: &self.url,
            key: self.key.as_deref(),
            model: self.options.model.as_deref(),
            image: &sent.text,
            mime: self.options.image.mime(),
            queries,
            score_min: self.options.score_min,
        };
        let mut request = self.request(&ask);
        request.images.push(sent.clone());
        let reply = self.client.answer(&request, || self.ask(&request))?;
        let answer = self.read(&reply)?;
        let (mut found, mut n_dropped) = (Vec::new(), 0);
        for raw in answer.boxes {
            match self.usable(raw, answer.convention, image, queries) {
                Ok(Some(usable)) => found.push(usable),
                Ok(None) => {}
                Err(reason) => {
                    n_dropped += 1;
                    tracing::debug!(reason, "a box of the service is not used");
                }
            }
        }
        tracing::debug!(n_found = found.len(), n_dropped, "the service has answered");
        Ok(found)
    }

    /// One box checked; `None` when its score is too low.
    fn usable(
        &self,
        raw: Result<RawBox, String>,
        convention: Convention,
        image: &ImageView<'_>,
        queries: &[String],
    ) -> Result<Option<Found>, String> {
        let RawBox { label, score, numbers } = raw?;
        if score < self.options.score_min {
            return Ok(None);
        }
        let query_idx = query_of(&label, queries)
            .ok_or_else(|| format!("{} is not what was asked for", quoted(&label)))?;
        let pixel_box = clipped(convention.corners(numbers), image)
            .map_err(|reason| format!("{}: a box {reason}: {}", quoted(&label), listed(numbers)))?;
        Ok(Some(Found { query_idx, pixel_box, score: score as f32 }))
    }

    /// The request in the service's dialect.
    fn request(&self, ask: &Ask<'_>) -> Request {
        match self.options.dialect {
            Dialect::HuggingFace => hugging_face::request(ask),
            Dialect::Roboflow => roboflow::request(ask),
            Dialect::DinoX => dinox::request(ask),
        }
    }

    /// The service's reply, once it is one that can be read.
    fn ask(&self, request: &Request) -> Result<Value, DetectorError> {
        if let (Some(name), None) = (&self.options.key_env, &self.key) {
            return Err(bad_key(A_KEY, &format!("{name}, which is not set")));
        }
        let reply = self.send(request)?.body;
        let reply = match self.options.dialect {
            Dialect::HuggingFace | Dialect::Roboflow => reply,
            Dialect::DinoX => self.poll(&dinox::task(&reply).map_err(|e| self.reply_error(&e))?)?,
        };
        self.read(&reply)?;
        Ok(reply)
    }

    fn read(&self, reply: &Value) -> Result<Answer, DetectorError> {
        let answer = match self.options.dialect {
            Dialect::HuggingFace => hugging_face::answer(reply),
            Dialect::Roboflow => roboflow::answer(reply),
            Dialect::DinoX => dinox::status(reply)
                .and_then(|answer| answer.ok_or_else(|| "expected a task that is done".to_owned())),
        };
        answer.map_err(|message| self.reply_error(&message))
    }

    /// Asks for a task until it is done; what is said of it then.
    fn poll(&self, uuid: &str) -> Result<Value, DetectorError> {
        let Poll { interval_ms, polls_max } = self.options.poll;
        let request = dinox::status_request(&self.url, uuid, self.key.as_deref());
        for _ in 0..polls_max {
            let reply = self.send(&request)?.body;
            if dinox::status(&reply).map_err(|e| self.reply_error(&e))?.is_some() {
                return Ok(reply);
            }
            std::thread::sleep(Duration::from_millis(interval_ms));
        }
        let how = format!(
            "it was not there after {polls_max} questions, {interval_ms} ms apart; raise \
             perception.options.poll.polls_max or interval_ms"
        );
        Err(PartError::missing(format!("the result of {}", shown_url(&self.url)), how).into())
    }

    fn send(&self, request: &Request) -> Result<Reply, DetectorError> {
        self.client.send(request).map_err(|error| match &self.options.key_env {
            Some(name) if error.is_unauthorised() => bad_key(
                "the name of an environment variable with a key that the service takes",
                &format!("{name} ({error})"),
            ),
            None if error.is_unauthorised() => bad_key(
                "the name of an environment variable with a key, since the service wants one",
                &format!("none ({error})"),
            ),
            Some(_) | None => DetectorError::from(error),
        })
    }

    fn reply_error(&self, message: &str) -> DetectorError {
        let message = message.chars().take(2 * MESSAGE_CHARS_MAX).collect();
        DetectorError::Reply { url: shown_url(&self.url), message }
    }
}
