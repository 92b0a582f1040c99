//! What the four numbers of a box mean: every dialect says its own.

/// How a service writes a box, in pixels of the image that it was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Convention {
    /// Left, top, right and bottom edge.
    Corners,
    /// Middle column, middle row, width, height.
    CentreAndSize,
}

impl Convention {
    /// Left, top, right and bottom edge. A negative size gives a box without an inside.
    pub(super) fn corners(self, [a, b, c, d]: [f64; 4]) -> [f64; 4] {
        match self {
            Self::Corners => [a, b, c, d],
            Self::CentreAndSize => [a - c / 2.0, b - d / 2.0, a + c / 2.0, b + d / 2.0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box that no two conventions write alike.
    #[test]
    fn an_asymmetric_box_is_the_same_in_every_convention() {
        let corners = [10.0, 20.0, 70.0, 50.0];
        assert_eq!(Convention::Corners.corners(corners), corners);
        assert_eq!(Convention::CentreAndSize.corners([40.0, 35.0, 60.0, 30.0]), corners);
    }
}
