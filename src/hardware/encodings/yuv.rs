//! Brightness and two differences of colour to red, green and blue.

use schemars::JsonSchema;
use serde::Deserialize;

/// What Y, U and V mean. Cameras of USB and most drivers give `bt601`; video of 720 rows and more is
/// often `bt709`. In the limited range black is 16 and white 235; in the full one 0 and 255.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum YuvColours {
    /// ITU-R BT.601, limited range.
    #[default]
    Bt601,
    /// ITU-R BT.601, full range, as in JPEG.
    Bt601Full,
    /// ITU-R BT.709, limited range.
    Bt709,
    /// ITU-R BT.709, full range.
    Bt709Full,
}

/// Bits after the point of the weights.
const FRACTION_BITS: u32 = 16;

/// Weights of one meaning, as whole numbers of 2^-[`FRACTION_BITS`].
struct Weights {
    black: i32,
    y: i32,
    v_in_red: i32,
    u_in_green: i32,
    v_in_green: i32,
    u_in_blue: i32,
}

impl Weights {
    /// From the shares of red and blue in Y.
    ///
    /// Source: ITU-R BT.601-7, 2.5.1 to 2.5.3; BT.709-6, 3.2 to 3.5, solved for red, green and blue.
    fn of(colours: YuvColours) -> Self {
        let (red, blue) = match colours {
            YuvColours::Bt601 | YuvColours::Bt601Full => (0.299, 0.114),
            YuvColours::Bt709 | YuvColours::Bt709Full => (0.2126, 0.0722),
        };
        let (black, of_y, of_uv) = match colours {
            YuvColours::Bt601 | YuvColours::Bt709 => (16, 255.0 / 219.0, 255.0 / 224.0),
            YuvColours::Bt601Full | YuvColours::Bt709Full => (0, 1.0, 1.0),
        };
        let green = 1.0 - red - blue;
        let whole = |weight: f64| (weight * f64::from(1 << FRACTION_BITS)).round() as i32;
        Self {
            black,
            y: whole(of_y),
            v_in_red: whole(2.0 * (1.0 - red) * of_uv),
            u_in_green: whole(2.0 * (1.0 - blue) * blue / green * of_uv),
            v_in_green: whole(2.0 * (1.0 - red) * red / green * of_uv),
            u_in_blue: whole(2.0 * (1.0 - blue) * of_uv),
        }
    }

    fn rgb(&self, y: u8, u: u8, v: u8) -> [u8; 3] {
        let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
        let y = (i32::from(y) - self.black) * self.y;
        let byte = |value: i32| {
            let rounded = (value + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS;
            rounded.clamp(0, 255) as u8
        };
        [
            byte(y + self.v_in_red * v),
            byte(y - self.u_in_green * u - self.v_in_green * v),
            byte(y + self.u_in_blue * u),
        ]
    }
}

/// Rows of pairs of pixels; `at` are the places of the first Y, of U, of the second Y, and of V.
pub(super) fn of_pairs<'a>(
    rows: impl Iterator<Item = &'a [u8]>,
    at: [usize; 4],
    colours: YuvColours,
) -> Vec<u8> {
    let weights = Weights::of(colours);
    let pairs = rows.flat_map(|row| row.as_chunks::<4>().0);
    let pixels = pairs.flat_map(|pair| {
        let [y1, u, y2, v] = at.map(|place| pair.get(place).copied().unwrap_or(0));
        [weights.rgb(y1, u, v), weights.rgb(y2, u, v)]
    });
    pixels.flatten().collect()
}

/// Rows of Y, and for each two of them one of U and V in turns.
pub(super) fn of_planes<'a>(
    rows: impl Iterator<Item = &'a [u8]>,
    colour_rows: impl Iterator<Item = &'a [u8]>,
    colours: YuvColours,
) -> Vec<u8> {
    let weights = &Weights::of(colours);
    let twice = colour_rows.flat_map(|row| [row, row]);
    let pixels = rows.zip(twice).flat_map(|(row, colours)| {
        let twice = colours.as_chunks::<2>().0.iter().flat_map(|uv| [uv, uv]);
        row.iter().zip(twice).map(move |(y, [u, v])| weights.rgb(*y, *u, *v))
    });
    pixels.flatten().collect()
}
