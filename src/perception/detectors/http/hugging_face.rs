//! Zero-shot object detection as Hugging Face specifies it.
//!
//! `POST {"inputs": <base64>, "parameters": {"candidate_labels": […]}}` answers
//! `[{"label", "score", "box": {"xmin", "ymin", "xmax", "ymax"}}]`: the edges, in pixels.

use serde_json::{Value, json};

use super::convention::Convention;
use super::{Answer, Ask, RawBox};
use crate::http::{Header, Request};

/// The one request.
pub(super) fn request(ask: &Ask<'_>) -> Request {
    // The specification has no threshold: low scores are dropped here.
    let parameters = json!({ "candidate_labels": ask.queries });
    let request = Request::post(ask.url, json!({ "inputs": ask.image, "parameters": parameters }));
    match ask.key {
        Some(key) => request.with(Header::secret("Authorization", &format!("Bearer {key}"))),
        None => request,
    }
}

/// The boxes of a reply.
pub(super) fn answer(body: &Value) -> Result<Answer, String> {
    let found = body.as_array().ok_or("expected a list of {label, score, box}")?;
    Ok(Answer { boxes: found.iter().map(raw_box).collect(), convention: Convention::Corners })
}

fn raw_box(object: &Value) -> Result<RawBox, String> {
    RawBox::read(object, "label", "score", |object| {
        let edge = |name: &str| object.get("box")?.get(name)?.as_f64();
        Some([edge("xmin")?, edge("ymin")?, edge("xmax")?, edge("ymax")?])
    })
}
