//! Small programs that write pictures, and some that do not.

use std::io::Cursor;

use image::{ImageFormat, RgbImage};

use super::*;

const RGB: PixelLayout =
    PixelLayout { encoding: Encoding::Rgb8, size: [2, 1], stride: None, yuv: YuvColours::Bt601 };

fn frame([width, height]: [u32; 2]) -> Frame {
    Frame { width, height, ..Frame::default() }
}

fn start(script: &str, colour: PixelLayout, depth: Option<PixelLayout>) -> PipeCamera {
    let command = ["sh", "-c", script].map(str::to_owned);
    PipeCamera::start(&command, (colour, depth), frame(colour.size)).unwrap()
}

/// All frames of a camera, and what ended it.
async fn played(camera: &mut PipeCamera) -> (Vec<Frame>, Option<String>) {
    let mut frames = Vec::new();
    loop {
        match camera.next().await {
            Ok(Some(frame)) => frames.push(frame.clone()),
            Ok(None) => return (frames, None),
            Err(error) => return (frames, Some(error.to_string())),
        }
    }
}

#[tokio::test]
async fn pictures_come_whole_and_in_order_until_the_program_ends() {
    let mut camera = start("printf abcdef; printf gh; printf ijkl", RGB, None);
    let (frames, error) = played(&mut camera).await;
    assert_eq!(error, None);
    let seen: Vec<&[u8]> = frames.iter().map(|frame| frame.rgb.as_slice()).collect();
    assert_eq!(seen, [b"abcdef", b"ghijkl"]);
    assert_eq!([frames[0].sequence, frames[1].sequence], [0, 1]);
    assert!(0 < frames[0].capture_ns && frames[0].capture_ns < frames[1].capture_ns);
}

#[tokio::test]
async fn how_a_program_ended_is_told() {
    for (script, n_frames, expect) in [
        ("printf abcdefgh", 1, "it ended with exit status: 0 after 1 pictures, within one: 2 of 6"),
        (
            "printf abcdef; exit 3",
            1,
            "it ended with exit status: 3 after 1 pictures; it said nothing",
        ),
        (
            "echo no device >&2; echo bye >&2; exit 1",
            0,
            "after 0 pictures; it said: no device | bye",
        ),
        (r"printf '\033[2J gone' >&2; exit 1", 0, "it said:  [2J gone"),
        ("kill -9 $$", 0, "it ended with signal: 9 (SIGKILL) after 0 pictures"),
        ("for i in 1 2 3 4 5 6 7; do echo $i >&2; done; exit 1", 0, "it said: 3 | 4 | 5 | 6 | 7"),
        ("head -c 400000 /dev/zero >&2; printf abcdef; exit 1", 1, "exit status: 1 after 1"),
    ] {
        let (frames, error) = played(&mut start(script, RGB, None)).await;
        let error = error.unwrap_or_default();
        assert!(
            error.starts_with("the program sh: ") && error.contains(expect),
            "{script}: {error}"
        );
        assert_eq!(frames.len(), n_frames, "{script}: {error}");
    }
}

#[tokio::test]
async fn a_program_that_is_not_there_is_told() {
    let command = ["no-such-program-here".to_owned()];
    let started = PipeCamera::start(&command, (RGB, None), frame([2, 1]));
    let said = started.err().unwrap().to_string();
    assert!(said.contains("no-such-program-here: it cannot be started: No such file"), "{said}");
}

#[tokio::test]
async fn depth_follows_each_picture() {
    let depth = PixelLayout { encoding: Encoding::Millimetres, ..RGB };
    let script = r"printf 'abcdef\350\003\000\000ghijkl\320\007\001\000'";
    let (frames, error) = played(&mut start(script, RGB, Some(depth))).await;
    assert_eq!(error, None);
    let depths: Vec<_> = frames.iter().map(|frame| frame.depth_m.clone().unwrap()).collect();
    assert_eq!(depths, [[1.0, 0.0], [2.0, 0.001]]);
    let (frames, error) = played(&mut start("printf abcdef", RGB, Some(depth))).await;
    assert!(frames.is_empty());
    assert!(error.unwrap().contains("a picture came without its depth"));
}

fn jpeg(grey: u8) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = RgbImage::from_pixel(16, 8, image::Rgb([grey; 3]));
    picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
    bytes.into_inner()
}

#[tokio::test]
async fn broken_images_are_passed_over_and_too_many_are_an_error() {
    let colour = PixelLayout { encoding: Encoding::Mjpeg, size: [16, 8], ..RGB };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stream");
    let mut broken = jpeg(90);
    let at = broken.len() - 20;
    broken.truncate(at);
    broken.extend([0xff, 0xd9]);
    let other_size = {
        let mut bytes = Cursor::new(Vec::new());
        RgbImage::new(8, 8).write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
        bytes.into_inner()
    };
    std::fs::write(&path, [jpeg(10), other_size.clone(), jpeg(200)].concat()).unwrap();
    let script = format!("cat '{}'", path.display());
    let (frames, error) = played(&mut start(&script, colour, None)).await;
    assert_eq!(error, None);
    let greys: Vec<u8> = frames.iter().map(|frame| frame.rgb[0]).collect();
    assert_eq!(greys, [10, 200]);
    assert_eq!(frames[1].sequence, 1);
    std::fs::write(&path, other_size.repeat(31)).unwrap();
    let (frames, error) = played(&mut start(&script, colour, None)).await;
    let error = error.unwrap();
    assert!(frames.is_empty() && error.contains("30 pictures in a row are broken"), "{error}");
    assert!(error.contains("expected 16x8 pixels, got 8x8"), "{error}");
}

/// Whether a process runs: one that has ended and that nobody has asked for is none.
fn runs(id: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| !rest.trim_start().starts_with('Z'))
}

/// The program ends with its camera, and so does what it has started.
#[tokio::test]
async fn the_program_and_its_children_are_killed_with_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ids");
    let script = format!("sleep 100000 & echo $$ $! > '{}'; yes", path.display());
    let mut camera = start(&script, RGB, None);
    assert!(camera.next().await.unwrap().is_some());
    let ids = std::fs::read_to_string(&path).unwrap();
    let ids: Vec<&str> = ids.split_whitespace().collect();
    assert!(ids.len() == 2 && ids.iter().all(|id| runs(id)), "{ids:?}");
    drop(camera);
    while ids.iter().any(|id| runs(id)) {
        tokio::task::yield_now().await;
    }
}
