//! Goals for a long-lived run, and what becomes of them, as JSON.

use serde::{Deserialize, Serialize};

use super::report::{check_text, check_verdict, from_json, to_json};
use super::{WireError, device_header};
use crate::messages::{Submission, TaskRequest, TaskState, TaskStatus};
use crate::mismatch::quoted;
use crate::transport::wire::DeviceHeader;

/// Longest identity of a goal, in bytes.
pub const TASK_ID_BYTES_MAX: usize = 64;
/// Longest text of a goal, in bytes.
pub const TASK_TEXT_BYTES_MAX: usize = 1 << 16;

/// A status as it travels: what people read, and what programs read.
#[derive(Serialize, Deserialize)]
struct StatusText {
    line: String,
    #[serde(flatten)]
    status: TaskStatus,
}

/// Writes a request; `sequence` is its number among those of its writer.
///
/// # Errors
/// [`WireError`] naming the field that is too long or has characters that it may not have.
pub fn task_request_to_wire(
    sequence: u64,
    request: &TaskRequest,
) -> Result<(DeviceHeader, Vec<u8>), WireError> {
    check_request(request)?;
    Ok((device_header(sequence, 0), to_json("request", request)?))
}

/// Checks a request.
///
/// # Errors
/// [`WireError`] naming the field: no JSON of a request, an identity or text that is too long or has characters
/// that it may not have.
pub fn task_request_from_wire(payload: &[u8]) -> Result<TaskRequest, WireError> {
    let request: TaskRequest = from_json("request", payload)?;
    check_request(&request)?;
    Ok(request)
}

/// Writes what has become of a goal; `sequence` is the number of the status.
///
/// # Errors
/// [`WireError`] when it cannot be put into JSON.
pub fn task_status_to_wire(
    sequence: u64,
    status: &TaskStatus,
) -> Result<(DeviceHeader, Vec<u8>), WireError> {
    let line = status.state.to_string();
    let line = line.lines().next().unwrap_or_default().to_owned();
    let text = StatusText { line, status: status.clone() };
    Ok((device_header(sequence, 0), to_json("status", &text)?))
}

/// Checks what has become of a goal.
///
/// # Errors
/// [`WireError`] naming the field: no JSON of a status, control characters.
pub fn task_status_from_wire(payload: &[u8]) -> Result<TaskStatus, WireError> {
    let StatusText { line, status } = from_json("status", payload)?;
    check_text(&line)?;
    check_submission(&status.task)?;
    match &status.state {
        TaskState::Queued { .. } | TaskState::Running => {}
        TaskState::Done(result) => {
            check_verdict(&result.end)?;
            check_lines("goal", &result.goal)?;
        }
        TaskState::Cancelled { reason }
        | TaskState::Refused { reason }
        | TaskState::Failed { reason } => check_lines("reason", reason)?,
    }
    Ok(status)
}

fn check_request(request: &TaskRequest) -> Result<(), WireError> {
    match request {
        TaskRequest::Submit(task) => check_submission(task),
        TaskRequest::Cancel { id } => check_id(id),
    }
}

fn check_submission(Submission { id, kind, text }: &Submission) -> Result<(), WireError> {
    check_id(id)?;
    if let Some(kind) = kind {
        check_text(kind)?;
    }
    if text.len() > TASK_TEXT_BYTES_MAX {
        return Err(WireError::new("text", format!("{TASK_TEXT_BYTES_MAX} bytes"), text.len()));
    }
    check_lines("text", text)
}

/// An identity stands in lines for people: one word that can be seen.
fn check_id(id: &str) -> Result<(), WireError> {
    let is_plain = id.chars().all(|c| c.is_ascii_graphic());
    if id.is_empty() || id.len() > TASK_ID_BYTES_MAX || !is_plain {
        let expected = format!("1 to {TASK_ID_BYTES_MAX} printable characters without a blank");
        return Err(WireError::new("id", expected, quoted(id)));
    }
    Ok(())
}

/// Text of several lines: no other control characters than those between lines and words.
fn check_lines(field: &'static str, text: &str) -> Result<(), WireError> {
    let is_bad = |c: char| c.is_control() && !matches!(c, '\n' | '\r' | '\t');
    if text.chars().any(is_bad) {
        return Err(WireError::new(field, "lines without control characters", quoted(text)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{EpisodeCounts, Limit, TaskResult, Verdict};

    fn submission() -> Submission {
        Submission { id: "a-1".to_owned(), kind: None, text: "red over blue".to_owned() }
    }

    #[test]
    fn requests_come_back_as_they_were() {
        let kind = Some("logical".to_owned());
        let logical = Submission { kind, text: "(and\n(on a b))".to_owned(), ..submission() };
        for request in [
            TaskRequest::Submit(submission()),
            TaskRequest::Submit(logical),
            TaskRequest::Cancel { id: "a-1".to_owned() },
        ] {
            let (header, bytes) = task_request_to_wire(7, &request).unwrap();
            assert_eq!(header.sequence, 7);
            assert_eq!(task_request_from_wire(&bytes).unwrap(), request);
        }
        let plain = br#"{"request":"submit","id":"a-1","text":"red over blue"}"#;
        assert_eq!(task_request_from_wire(plain).unwrap(), TaskRequest::Submit(submission()));
    }

    #[test]
    fn statuses_come_back_as_they_were() {
        let limit = Limit::Observing;
        let result = TaskResult {
            end: Verdict::GaveUp { limit, detail: "nothing is seen".to_owned() },
            goal: "(on red blue)".to_owned(),
            counts: EpisodeCounts::default(),
            run_s: 2.5,
            goal_in_simulator: Some(false),
        };
        let reason = || "instruction:1:1: error\n  | words\n  | ^^^".to_owned();
        for state in [
            TaskState::Queued { ahead: 2 },
            TaskState::Running,
            TaskState::Done(result),
            TaskState::Cancelled { reason: reason() },
            TaskState::Refused { reason: reason() },
            TaskState::Failed { reason: reason() },
        ] {
            assert!(TaskState::WORDS.contains(&state.word()));
            let status = TaskStatus { task: submission(), state };
            let (_, bytes) = task_status_to_wire(0, &status).unwrap();
            assert_eq!(task_status_from_wire(&bytes).unwrap(), status);
            let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
            assert_eq!(json["state"], status.state.word(), "one flat object: {json}");
            assert!(json["line"].as_str().is_some_and(|line| !line.contains('\n')), "{json}");
        }
    }

    #[test]
    fn what_is_no_request_is_refused_by_its_field() {
        let field = |text: &str| task_request_from_wire(text.as_bytes()).unwrap_err().field;
        assert_eq!(field("{"), "request");
        assert_eq!(field(r#"{"request":"dance","id":"a"}"#), "request");
        assert_eq!(field(r#"{"request":"submit","id":"a"}"#), "request");
        assert_eq!(field(r#"{"request":"cancel","id":"a b"}"#), "id");
        assert_eq!(field(r#"{"request":"submit","id":"","text":"x"}"#), "id");
        assert_eq!(field(r#"{"request":"submit","id":"a","text":"\u001b[2J"}"#), "text");
        let long = "x".repeat(TASK_TEXT_BYTES_MAX + 1);
        assert_eq!(field(&format!(r#"{{"request":"submit","id":"a","text":"{long}"}}"#)), "text");
    }
}
