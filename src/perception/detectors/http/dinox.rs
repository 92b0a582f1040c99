//! DINO-X: a task is posted, then asked for until it is done.
//!
//! `POST /v2/task/dinox/detection` answers `{"code": 0, "data": {"task_uuid"}}`;
//! `GET /v2/task_status/<uuid>` answers `{"data": {"status", "result": {"objects": […]}}}`.
//! Boxes are left, top, right and bottom edge, as the boxes show that were recorded with it.

use serde_json::{Value, json};

use super::convention::Convention;
use super::{Answer, Ask, RawBox};
use crate::http::{Header, Request};
use crate::mismatch::quoted;

/// Where the vendor's service is.
pub(super) const URL: &str = "https://api.deepdataspace.com";
/// The model, without `model` in the options.
const MODEL: &str = "DINO-X-1.0";
/// How much two boxes of the service may overlap, intersection over union: the vendor's value.
const IOU_THRESHOLD: f64 = 0.8;

/// The request that starts a task.
pub(super) fn request(ask: &Ask<'_>) -> Request {
    let body = json!({
        "model": ask.model.unwrap_or(MODEL),
        "image": format!("data:{};base64,{}", ask.mime, ask.image),
        "prompt": { "type": "text", "text": ask.queries.join(" . ") },
        "targets": ["bbox"],
        "bbox_threshold": ask.score_min,
        "iou_threshold": IOU_THRESHOLD,
    });
    signed(Request::post(&format!("{}/v2/task/dinox/detection", ask.url), body), ask.key)
}

/// The number of the task that a reply tells.
pub(super) fn task(body: &Value) -> Result<String, String> {
    let refused = body.get("code").and_then(Value::as_i64).is_some_and(|code| code != 0);
    let uuid = body.pointer("/data/task_uuid").and_then(Value::as_str).filter(|_| !refused);
    // It becomes a part of the next address.
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    match uuid {
        Some(uuid) if !uuid.is_empty() && uuid.chars().all(is_plain) => Ok(uuid.to_owned()),
        Some(uuid) => {
            Err(format!("data.task_uuid: expected letters and digits, got {}", quoted(uuid)))
        }
        None => Err(format!("expected code 0 and data.task_uuid, got {}", message(body))),
    }
}

/// The request that asks for a task.
pub(super) fn status_request(url: &str, uuid: &str, key: Option<&str>) -> Request {
    signed(Request::get(&format!("{url}/v2/task_status/{uuid}")), key)
}

/// What the reply says of the task: `None` while it is not done.
pub(super) fn status(body: &Value) -> Result<Option<Answer>, String> {
    match body.pointer("/data/status").and_then(Value::as_str) {
        Some("waiting" | "running") => Ok(None),
        Some("success") => {
            let objects = body.pointer("/data/result/objects").and_then(Value::as_array);
            let objects = objects.ok_or("data.result.objects: expected a list")?;
            let boxes = objects.iter().map(raw_box).collect();
            Ok(Some(Answer { boxes, convention: Convention::Corners }))
        }
        Some("failed") => Err(format!("the task has failed: {}", message(body))),
        other => Err(format!(
            "data.status: expected waiting, running, success or failed, got {}",
            other.unwrap_or("nothing")
        )),
    }
}

fn raw_box(object: &Value) -> Result<RawBox, String> {
    RawBox::read(object, "category", "score", |object| {
        let edges = object.get("bbox")?.as_array()?;
        let numbers: Vec<f64> = edges.iter().filter_map(Value::as_f64).collect();
        numbers.try_into().ok()
    })
}

fn signed(request: Request, key: Option<&str>) -> Request {
    match key {
        Some(key) => request.with(Header::secret("Token", key)),
        None => request,
    }
}

/// What a body says is wrong.
fn message(body: &Value) -> String {
    let said = ["/data/error", "/errors", "/msg"].into_iter().find_map(|at| body.pointer(at));
    said.unwrap_or(body).to_string().chars().take(super::MESSAGE_CHARS_MAX).collect()
}
