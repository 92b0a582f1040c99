//! What all plots of reports share: text, lines, colours, and how a plot fails. Drawn by `plotters`, as SVG.

use std::io;

use plotters::coord::Shift;
use plotters::prelude::{
    DrawingArea, DrawingAreaErrorKind, IntoFont as _, RGBColor, SVGBackend, TextStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

/// Text and axes.
pub(crate) const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
/// Lines across a panel.
pub(crate) const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
/// Colours that colour-blind people tell apart too (Okabe and Ito, 2008), the plainest first.
pub(crate) const COLOURS: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

/// A part of a picture.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// What drawing comes to.
pub(crate) type Drawn<T> = Result<T, DrawingAreaErrorKind<io::Error>>;

/// A plot cannot be laid out.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the plot of {what}: {reason}")]
pub struct PlotError {
    /// What it shows.
    pub what: &'static str,
    /// What the drawing library says.
    pub reason: String,
}

impl PlotError {
    /// What the drawing library says of a plot.
    pub(crate) fn of(what: &'static str) -> impl FnOnce(DrawingAreaErrorKind<io::Error>) -> Self {
        move |error| Self { what, reason: error.to_string() }
    }
}

/// Text; sizes are those of the drawing library, a quarter larger than pixels.
pub(crate) fn ink(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

/// Text that begins at its place.
pub(crate) fn left(size: u32) -> TextStyle<'static> {
    ink(size).pos(at(HPos::Left))
}

/// Vertically in the middle.
pub(crate) fn at(across: HPos) -> Pos {
    Pos::new(across, VPos::Center)
}
