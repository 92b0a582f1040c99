//! A program whose standard output is read, and what is said of it when it ends.

use std::collections::VecDeque;
use std::process::{ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use tokio::io::{AsyncBufReadExt as _, AsyncRead, AsyncReadExt as _, BufReader};
use tokio::process::{Child, ChildStdout, Command};
use tokio::time::timeout;

use super::jpeg_stream::{IMAGE_START, JpegByte, JpegStream};
use crate::hardware::CameraError;
use crate::hardware::encodings::PixelLayout;

/// Lines of standard error that are kept for the message, and bytes of each.
const SAID_LINES_MAX: usize = 5;
const SAID_BYTES_MAX: usize = 300;
/// How long a program may take to end once its output has, and its last words to come.
const END_WAIT: Duration = Duration::from_secs(2);
/// Largest compressed image, bytes.
const JPEG_BYTES_MAX: usize = 64 << 20;
/// Bytes that are read at once.
const READ_BYTES: usize = 1 << 16;

/// A program that runs; it is killed, with all that it has started, when this is dropped.
pub(super) struct Program {
    name: String,
    child: Child,
    output: BufReader<ChildStdout>,
    said: Said,
    /// Holds until its standard error ends.
    listening: tokio::task::JoinHandle<()>,
    /// One picture.
    bytes: Vec<u8>,
    n_pictures: u64,
}

/// The last lines that a program has written to its standard error.
type Said = Arc<Mutex<VecDeque<String>>>;

/// What came of reading.
pub(super) enum Picture<'a> {
    /// The bytes of a picture.
    Whole(&'a [u8]),
    /// The program has ended well, between two pictures.
    End,
}

impl Program {
    /// Starts a program with its arguments.
    pub(super) fn start(command: &[String]) -> Result<Self, CameraError> {
        let (name, args) = command.split_first().map(|(n, a)| (n.clone(), a)).unwrap_or_default();
        let fault = |reason: String| CameraError::Program { name: name.clone(), reason };
        let mut child = Command::new(&name)
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // What it starts is killed with it.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()
            .map_err(|error| fault(format!("it cannot be started: {error}")))?;
        let (Some(output), Some(errors)) = (child.stdout.take(), child.stderr.take()) else {
            return Err(fault("it has no standard output".to_owned()));
        };
        let said = Said::default();
        let listening = tokio::spawn(listen(errors, Arc::clone(&said)));
        let output = BufReader::with_capacity(READ_BYTES, output);
        Ok(Self { name, child, output, said, listening, bytes: Vec::new(), n_pictures: 0 })
    }

    /// Waits for the next picture, whole.
    ///
    /// # Errors
    /// [`CameraError::Program`]: it has failed, or ended within a picture.
    pub(super) async fn picture(
        &mut self,
        layout: &PixelLayout,
    ) -> Result<Picture<'_>, CameraError> {
        let n_wanted = layout.bytes().map_err(|error| self.failure(&error.to_string()))?;
        self.bytes.clear();
        let read = match n_wanted {
            Some(n_wanted) => read_exactly(&mut self.output, n_wanted, &mut self.bytes).await,
            None => read_jpeg(&mut self.output, &mut self.bytes).await,
        };
        if read.map_err(|error| self.failure(&error.to_string()))? {
            self.n_pictures += 1;
            return Ok(Picture::Whole(&self.bytes));
        }
        let status = self.end().await;
        let n_left = self.bytes.len();
        if status.is_some_and(|status| status.success()) && n_left == 0 {
            return Ok(Picture::End);
        }
        let ended = match status {
            Some(status) => format!("it ended with {status}"),
            None => "it closed its output and went on".to_owned(),
        };
        let within = match (n_left, n_wanted) {
            (0, _) => String::new(),
            (n, Some(wanted)) => format!(", within one: {n} of {wanted} bytes"),
            (n, None) => format!(", within one: {n} bytes"),
        };
        Err(self.failure(&format!("{ended} after {} pictures{within}", self.n_pictures)))
    }

    /// Waits a little until it ends, and until its last words are read.
    async fn end(&mut self) -> Option<ExitStatus> {
        let status = timeout(END_WAIT, self.child.wait()).await;
        // What it started may still hold its standard error.
        if timeout(END_WAIT, &mut self.listening).await.is_err() {
            self.listening.abort();
        }
        status.ok()?.ok()
    }

    /// An error with the last lines of its standard error.
    pub(super) fn failure(&self, reason: &str) -> CameraError {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let said: Vec<&str> = said.iter().map(String::as_str).collect();
        let said = if said.is_empty() {
            "it said nothing on standard error".to_owned()
        } else {
            format!("it said: {}", said.join(" | "))
        };
        CameraError::Program { name: self.name.clone(), reason: format!("{reason}; {said}") }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let id = self.child.id().and_then(|id| Pid::from_raw(i32::try_from(id).ok()?));
        // It may have ended by itself.
        if let Some(Err(error)) = id.map(|id| kill_process_group(id, Signal::KILL)) {
            tracing::debug!(%error, program = self.name, "not killed");
        }
        self.listening.abort();
    }
}

/// Keeps the last lines.
async fn listen(errors: impl AsyncRead + Unpin, said: Said) {
    let mut errors = BufReader::new(errors);
    let mut line = Vec::new();
    loop {
        line.clear();
        // A line that never ends is cut; what is left of it comes as the next one.
        let mut bounded = (&mut errors).take(SAID_BYTES_MAX as u64);
        match bounded.read_until(b'\n', &mut line).await {
            Ok(1..) => {}
            Ok(0) | Err(_) => return,
        }
        // It goes to a terminal: what moves the cursor there is a blank.
        let text: String = String::from_utf8_lossy(&line)
            .trim()
            .chars()
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        if text.is_empty() {
            continue;
        }
        let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
        if said.len() == SAID_LINES_MAX {
            said.pop_front();
        }
        said.push_back(text);
    }
}

/// Reads so many bytes; false where the stream ends before.
async fn read_exactly(
    output: &mut BufReader<ChildStdout>,
    n_wanted: usize,
    bytes: &mut Vec<u8>,
) -> std::io::Result<bool> {
    bytes.reserve_exact(n_wanted);
    let n_read = output.take(n_wanted as u64).read_to_end(bytes).await?;
    Ok(n_read == n_wanted)
}

/// Reads up to the end of the next JPEG image; false where the stream ends before.
async fn read_jpeg(
    output: &mut BufReader<ChildStdout>,
    bytes: &mut Vec<u8>,
) -> std::io::Result<bool> {
    let mut stream = JpegStream::default();
    loop {
        let piece = output.fill_buf().await?;
        if piece.is_empty() {
            return Ok(false);
        }
        let mut n_used = 0;
        let mut is_whole = false;
        for byte in piece {
            n_used += 1;
            match stream.push(*byte) {
                JpegByte::Outside => bytes.clear(),
                JpegByte::Second => bytes.extend(IMAGE_START),
                JpegByte::Inside => bytes.push(*byte),
                JpegByte::Last => {
                    bytes.push(*byte);
                    is_whole = true;
                    break;
                }
            }
        }
        output.consume(n_used);
        if is_whole {
            return Ok(true);
        }
        if bytes.len() > JPEG_BYTES_MAX {
            stream = JpegStream::default();
            bytes.clear();
        }
    }
}
