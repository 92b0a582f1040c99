//! Lenses: where a ray of a pinhole really meets the picture.

use nalgebra::Point2;

/// A lens, by the names and coefficients of ROS and `OpenCV`.
#[derive(Debug, Clone, PartialEq)]
pub enum Distortion {
    /// `plumb_bob` and `rational_polynomial`: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4; those that are
    /// not said are 0.
    Polynomial([f64; 12]),
    /// `equidistant`, a fisheye: k1 to k4.
    Equidistant([f64; 4]),
    /// One that is not known here, by its name.
    Unknown(String),
}

impl Distortion {
    /// A pinhole.
    pub const NONE: Self = Self::Polynomial([0.0; 12]);

    /// The lens of a model of ROS; an empty name is that of `OpenCV`.
    ///
    /// # Errors
    /// How many coefficients there may be.
    pub fn of_model(model: &str, coefficients: &[f64]) -> Result<Self, String> {
        if coefficients.iter().any(|value| !value.is_finite()) {
            return Err("expected finite coefficients".to_owned());
        }
        let n = coefficients.len();
        match model {
            "" | "plumb_bob" | "rational_polynomial" => match (n, coefficients.get(12..14)) {
                (14, Some(tilts)) if tilts != [0.0, 0.0] => {
                    Ok(Self::Unknown("a tilted sensor".to_owned()))
                }
                (0 | 4 | 5 | 8 | 12 | 14, _) => {
                    let mut all = [0.0; 12];
                    all.iter_mut().zip(coefficients).for_each(|(to, from)| *to = *from);
                    Ok(Self::Polynomial(all))
                }
                _ => Err(format!("expected 0, 4, 5, 8, 12 or 14 coefficients, got {n}")),
            },
            "equidistant" | "fisheye" | "kannala_brandt" => {
                let four = <[f64; 4]>::try_from(coefficients);
                four.map(Self::Equidistant)
                    .map_err(|_other| format!("expected 4 coefficients, got {n}"))
            }
            other => Ok(Self::Unknown(other.to_owned())),
        }
    }

    /// What ROS calls its model.
    pub fn name(&self) -> &str {
        match self {
            Self::Polynomial(_) => "rational_polynomial",
            Self::Equidistant(_) => "equidistant",
            Self::Unknown(name) => name,
        }
    }

    /// Where the lens puts a ray, both at distance 1 along the optical axis; `None` where the lens is not
    /// known.
    ///
    /// Source: `OpenCV` 4, `calib3d` ("Detailed Description"; fisheye: "Fisheye camera model").
    pub fn bend(&self, at: Point2<f64>) -> Option<Point2<f64>> {
        let (x, y) = (at.x, at.y);
        let r2 = x * x + y * y;
        match self {
            Self::Polynomial([k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]) => {
                let cubic = |a: f64, b: f64, c: f64| 1.0 + r2 * (a + r2 * (b + r2 * c));
                let radial = cubic(*k1, *k2, *k3) / cubic(*k4, *k5, *k6);
                Some(Point2::new(
                    x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
                    y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
                ))
            }
            Self::Equidistant([k1, k2, k3, k4]) => {
                let r = r2.sqrt();
                if r == 0.0 {
                    return Some(at);
                }
                let angle = r.atan();
                let a2 = angle * angle;
                let bent = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
                Some(Point2::new(x * bent / r, y * bent / r))
            }
            Self::Unknown(_) => None,
        }
    }
}
