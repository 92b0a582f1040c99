//! Calibration files: `camera_info` of ROS (as `camera_calibration` writes it, and as `ros2 topic echo` prints
//! it), and the `FileStorage` of `OpenCV` in YAML.

use serde_json::Value;

use super::{Calibration, Distortion};

/// Longest file, bytes: calibrations with all their views are far shorter.
const FILE_BYTES_MAX: usize = 4 << 20;

/// Names of the camera matrix, of the coefficients, and of width and height.
const MATRIX: [&str; 6] =
    ["camera_matrix", "Camera_Matrix", "cameraMatrix", "camera matrix", "K", "k"];
const COEFFICIENTS: [&str; 6] =
    ["distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "D", "d"];
const WIDTH: [&str; 3] = ["image_width", "image_Width", "width"];
const HEIGHT: [&str; 3] = ["image_height", "image_Height", "height"];

/// Reads a calibration.
///
/// # Errors
/// The key, what is expected there, and what to change.
pub fn parse_calibration(text: &str) -> Result<Calibration, String> {
    if text.len() > FILE_BYTES_MAX {
        return Err(format!("expected at most {FILE_BYTES_MAX} bytes, got {}", text.len()));
    }
    // `ros2 topic echo` ends each message with the mark of a next one.
    let text = text.trim_end().trim_end_matches("---");
    let file: Value = serde_saphyr::from_str(text).map_err(|error| error.to_string())?;
    let (key, matrix) = found(&file, &MATRIX).ok_or_else(|| {
        format!(
            "expected a camera matrix, as camera_matrix or k, got none of {}",
            MATRIX.join(", ")
        )
    })?;
    let matrix = numbers(matrix).map_err(|expected| format!("{key}: {expected}"))?;
    let size = match [found(&file, &WIDTH), found(&file, &HEIGHT)] {
        [Some(width), Some(height)] => Some([side(width)?, side(height)?]),
        [None, None] => None,
        [Some((key, _)), None] | [None, Some((key, _))] => {
            return Err(format!("{key}: expected width and height, or neither"));
        }
    };
    let (key_of, coefficients) = match found(&file, &COEFFICIENTS) {
        Some((key, value)) => (key, numbers(value).map_err(|error| format!("{key}: {error}"))?),
        None => (COEFFICIENTS[0], Vec::new()),
    };
    let is_fisheye = file.get("fisheye_model").is_some_and(|flag| *flag == 1 || *flag == true);
    let model = file.get("distortion_model").and_then(Value::as_str);
    let model = model.unwrap_or(if is_fisheye { "fisheye" } else { "" });
    let lens = Distortion::of_model(model, &coefficients).map_err(|e| format!("{key_of}: {e}"))?;
    Calibration::of_matrix(size, &matrix, lens).map_err(|error| format!("{key}: {error}"))
}

fn found<'v>(file: &'v Value, names: &[&'static str]) -> Option<(&'static str, &'v Value)> {
    names.iter().find_map(|name| Some((*name, file.get(name)?)))
}

fn side((key, value): (&str, &Value)) -> Result<u32, String> {
    let side = value.as_u64().and_then(|side| u32::try_from(side).ok()).filter(|side| *side > 0);
    side.ok_or_else(|| format!("{key}: expected a number of pixels, got {value}"))
}

/// The numbers of a matrix: a table with `data`, or an array, row by row.
fn numbers(value: &Value) -> Result<Vec<f64>, String> {
    let items = value.get("data").unwrap_or(value).as_array();
    let items = items.ok_or("expected an array of numbers, or a table with data".to_owned())?;
    let rows = items.iter().flat_map(|item| match item {
        Value::Array(row) => row.as_slice(),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) | Value::Object(_) => {
            std::slice::from_ref(item)
        }
    });
    rows.map(|item| item.as_f64().ok_or_else(|| format!("expected a number, got {item}"))).collect()
}
