//! From grey levels to occupancy values, exactly as `map_server` does it.
//!
//! Sources: ros-navigation/navigation2 a3a97043e, `nav2_map_server/src/map_io.cpp` (single precision,
//! inclusive thresholds, GraphicsMagick's grey); ros-planning/navigation,
//! `map_server/src/image_loader.cpp` (double precision, strict thresholds, mean of the channels).

/// How a map's picture says what is free (the YAML key `mode`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum MapMode {
    /// Free (0), occupied (100) or unknown (-1), by two thresholds.
    #[default]
    Trinary,
    /// As trinary, with the greys between the thresholds spread over 1..=99; transparent is unknown.
    Scale,
    /// The grey level is the value; above 100 is unknown.
    Raw,
}

impl MapMode {
    /// The word in the YAML.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Trinary => "trinary",
            Self::Scale => "scale",
            Self::Raw => "raw",
        }
    }
}

/// What a pixel exactly on a threshold becomes, and how greys are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ThresholdRule {
    /// Nav2: on the threshold counts as free or occupied; colours become luma.
    #[default]
    Nav2,
    /// ROS 1: on the threshold is unknown; a colour is the mean of its channels (of all of them,
    /// alpha too, in trinary mode); scale mode spreads over 1..=99.
    Ros1,
}

/// Everything that turns a pixel into an occupancy value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ValueRule {
    pub(crate) rule: ThresholdRule,
    pub(crate) mode: MapMode,
    pub(crate) negate: bool,
    pub(crate) free_thresh: f64,
    pub(crate) occupied_thresh: f64,
}

pub(crate) const UNKNOWN: i8 = -1;

/// A 16-bit level in GraphicsMagick's 8 bits: white is 65,535 and the rest is cut off.
pub(crate) const fn level8(level16: u16) -> u8 {
    (level16 / 257) as u8
}

/// A sample of `0..=max_value` in 16 bits, rounded.
pub(crate) const fn level16(sample: u16, max_value: u16) -> u16 {
    let max = max_value as u32;
    ((sample as u32 * 65_535 + max / 2) / max) as u16
}

/// GraphicsMagick's luma of 16-bit levels.
#[cfg(feature = "image")]
pub(crate) fn luma16(red: u16, green: u16, blue: u16) -> u16 {
    let luma = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
    (luma + 0.5) as u16
}

/// [`luma16`] of 8-bit levels, cut to 8 bits; in whole numbers, equal for all 2^24 colours.
#[cfg(feature = "image")]
pub(crate) const fn luma8(red: u8, green: u8, blue: u8) -> u8 {
    // thousandths of the weights times 257, which widens the levels to 16 bits
    let thousandths = 76_843 * red as u32 + 150_859 * green as u32 + 29_298 * blue as u32;
    ((thousandths + 500) / 257_000) as u8
}

impl ValueRule {
    /// The value of an opaque grey pixel.
    pub(crate) fn of_grey(&self, grey: u8) -> i8 {
        match self.rule {
            ThresholdRule::Nav2 => self.nav2(grey),
            ThresholdRule::Ros1 => self.ros1(f64::from(grey), 1),
        }
    }

    /// The values of all opaque greys.
    pub(crate) fn table(&self) -> [i8; 256] {
        std::array::from_fn(|grey| self.of_grey(grey as u8))
    }

    fn nav2(&self, grey: u8) -> i8 {
        if self.mode == MapMode::Raw {
            return if grey <= 100 { grey as i8 } else { UNKNOWN };
        }
        // map_io.cpp computes in single precision and rounds the thresholds to it
        let white = f32::from(grey) / 255.0;
        let darkness = if self.negate { white } else { 1.0 - white };
        let (free, occupied) = (self.free_thresh as f32, self.occupied_thresh as f32);
        if darkness <= free {
            0
        } else if darkness >= occupied {
            100
        } else if self.mode == MapMode::Trinary {
            UNKNOWN
        } else {
            let range = (self.occupied_thresh - self.free_thresh) as f32;
            ((darkness - free) / range * 100.0).round() as i8
        }
    }

    /// `mean` is the mean of the channels that count; `alpha` matters only as zero or not.
    pub(crate) fn ros1(&self, mean: f64, alpha: u8) -> i8 {
        let mean = if self.negate { 255.0 - mean } else { mean };
        if self.mode == MapMode::Raw {
            let level = mean as u8;
            // OccupancyGrid knows no values above 100
            return if level <= 100 { level as i8 } else { UNKNOWN };
        }
        let darkness = (255.0 - mean) / 255.0;
        if darkness > self.occupied_thresh {
            100
        } else if darkness < self.free_thresh {
            0
        } else if self.mode == MapMode::Trinary || alpha == 0 {
            UNKNOWN
        } else {
            let ratio = (darkness - self.free_thresh) / (self.occupied_thresh - self.free_thresh);
            (1.0 + 98.0 * ratio) as i8
        }
    }

    /// The class limits of the values: `(free_at_most, occupied_at_least)`.
    pub(crate) fn class_limits(&self) -> (i8, i8) {
        if self.mode != MapMode::Raw {
            return (0, 100);
        }
        // 0 is below any occupied_thresh, as that is above free_thresh
        let occupied = ((100.0 * self.occupied_thresh).round() as i8).max(1);
        let free = (100.0 * self.free_thresh).round() as i8;
        // thresholds closer than one value: the value between them is not free
        (free.min(occupied - 1), occupied)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(rule: ThresholdRule, mode: MapMode, free: f64, occupied: f64) -> ValueRule {
        ValueRule {
            rule,
            mode,
            negate: false,
            free_thresh: free,
            occupied_thresh: occupied,
        }
    }

    #[test]
    fn a_pixel_on_the_threshold_is_classed_by_nav2_and_unknown_in_ros1() {
        // 0.2 is grey 204, 0.6 is grey 102
        let nav2 = rule(ThresholdRule::Nav2, MapMode::Trinary, 0.2, 0.6);
        assert_eq!(
            [204, 203, 103, 102].map(|g| nav2.of_grey(g)),
            [0, -1, -1, 100]
        );
        let ros1 = rule(ThresholdRule::Ros1, MapMode::Trinary, 0.2, 0.6);
        assert_eq!(
            [205, 204, 102, 101].map(|g| ros1.of_grey(g)),
            [0, -1, -1, 100]
        );
    }

    #[test]
    fn scale_uses_the_whole_range() {
        let nav2 = rule(ThresholdRule::Nav2, MapMode::Scale, 0.0, 1.0);
        assert_eq!(
            [255, 128, 127, 0].map(|g| nav2.of_grey(g)),
            [0, 50, 50, 100]
        );
        let ros1 = rule(ThresholdRule::Ros1, MapMode::Scale, 0.1, 0.9);
        assert_eq!([255, 127, 0].map(|g| ros1.of_grey(g)), [0, 50, 100]);
    }

    #[test]
    fn raw_takes_the_level_and_ignores_negate() {
        let mut raw = rule(ThresholdRule::Nav2, MapMode::Raw, 0.25, 0.65);
        raw.negate = true;
        assert_eq!([0, 100, 101, 255].map(|g| raw.of_grey(g)), [0, 100, -1, -1]);
        assert_eq!(raw.class_limits(), (25, 65));
        raw.free_thresh = 0.649;
        assert_eq!(raw.class_limits(), (64, 65));
        (raw.free_thresh, raw.occupied_thresh) = (0.0, 0.001);
        assert_eq!(raw.class_limits(), (0, 1));
    }

    #[test]
    fn levels_are_scaled_to_white() {
        assert_eq!([256, 257, 65_534, 65_535].map(level8), [0, 1, 254, 255]);
        assert_eq!(level16(1, 1), 65_535);
        assert_eq!(level16(3, 7), 28_086);
        #[cfg(feature = "image")]
        assert_eq!(luma16(257, 257, 257), 257);
    }

    #[cfg(feature = "image")]
    #[test]
    fn luma_in_whole_numbers_is_the_same_for_all_colours() {
        let wide = |level: u8| u16::from(level) * 257;
        for colour in 0..1_u32 << 24 {
            let [red, green, blue, _] = colour.to_le_bytes();
            let expected = level8(luma16(wide(red), wide(green), wide(blue)));
            assert_eq!(luma8(red, green, blue), expected, "{red} {green} {blue}");
        }
    }
}
