//! Grounding DINO on a Roboflow inference server of one's own.
//!
//! `POST /grounding_dino/infer` with the image and a list of texts answers
//! `{"predictions": [{"x", "y", "width", "height", "confidence", "class"}]}`, where x and y are the
//! middle of the box, in pixels. For one image the reply may be a list of one such object.

use serde_json::{Value, json};

use super::convention::Convention;
use super::{Answer, Ask, RawBox};
use crate::http::Request;

/// Where such a server listens if it is not told otherwise.
pub(super) const URL: &str = "http://localhost:9001";

/// The one request.
pub(super) fn request(ask: &Ask<'_>) -> Request {
    let mut body = json!({
        "image": { "type": "base64", "value": ask.image },
        "text": ask.queries,
        "box_threshold": ask.score_min,
        "text_threshold": ask.score_min,
    });
    let url = format!("{}/grounding_dino/infer", ask.url);
    let Some(key) = ask.key else { return Request::post(&url, body) };
    body["api_key"] = Value::from(key);
    let mut request = Request::post(&url, body);
    request.secrets.push(key.to_owned());
    request
}

/// The boxes of a reply.
pub(super) fn answer(body: &Value) -> Result<Answer, String> {
    let of_image = body.as_array().and_then(|list| list.first()).unwrap_or(body);
    let found = of_image.get("predictions").and_then(Value::as_array);
    let found = found.ok_or("predictions: expected a list")?;
    Ok(Answer { boxes: found.iter().map(raw_box).collect(), convention: Convention::CentreAndSize })
}

fn raw_box(object: &Value) -> Result<RawBox, String> {
    RawBox::read(object, "class", "confidence", |object| {
        let number = |name: &str| object.get(name)?.as_f64();
        Some([number("x")?, number("y")?, number("width")?, number("height")?])
    })
}
