//! A building as a person writes it down: walls with doors, furniture, people, light. Plain data, also
//! the layout of a world file (TOML).

use serde::Deserialize;

use super::world::WorldError;

/// Everything in a simulated building. Lengths in metres, map frame; brightness is the share of light
/// that a surface returns, 0 (black) to 1 (white).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Building {
    /// Free text.
    pub name: String,
    /// Where the robot starts: x [m], y [m], heading [rad].
    pub start: [f64; 3],
    /// Height of the ceiling, and of walls that name none [m], above 0.
    pub ceiling: f64,
    /// The floor.
    pub floor: Floor,
    /// Light that comes from everywhere, 0 to 1.
    pub ambient: f64,
    /// Lamps under the ceiling.
    pub lamps: Vec<Lamp>,
    /// Walls with their doors.
    pub walls: Vec<Wall>,
    /// Furniture with straight sides.
    pub boxes: Vec<Block>,
    /// Round furniture and pillars.
    pub cylinders: Vec<Cylinder>,
    /// People who walk about.
    pub people: Vec<Walker>,
}

impl Building {
    /// A building from the text of a world file (TOML). Its values are checked when it becomes a world.
    ///
    /// # Errors
    /// [`WorldError::Toml`] with the place that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, WorldError> {
        toml::from_str(text).map_err(|e| WorldError::Toml {
            message: e.to_string().trim_end().replace('\n', " "),
        })
    }
}

impl Default for Building {
    fn default() -> Self {
        Self {
            name: String::new(),
            start: [0.0; 3],
            ceiling: 2.6,
            floor: Floor::default(),
            ambient: 0.7,
            lamps: Vec::new(),
            walls: Vec::new(),
            boxes: Vec::new(),
            cylinders: Vec::new(),
            people: Vec::new(),
        }
    }
}

/// A pattern on a surface; `contrast` is the relative change of brightness, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Texture {
    /// One brightness.
    #[default]
    Plain,
    /// Square tiles, each a little different, with darker joints.
    Tiles {
        /// Side of a tile, joint included [m], above 0.
        size: f64,
        /// Width of a joint [m].
        joint: f64,
        /// Darkness of the joints; tiles differ by a fifth of it.
        contrast: f64,
    },
    /// Random grains, as of carpet, stone or plaster.
    Speckle {
        /// Size of the smallest grains [m], above 0.
        grain: f64,
        /// Largest change of brightness.
        contrast: f64,
    },
    /// Parallel stripes of equal width, light and dark.
    Stripes {
        /// One light and one dark stripe [m], above 0.
        period: f64,
        /// Darkness of the dark stripe.
        contrast: f64,
        /// Direction across the stripes, from the surface's first axis [rad].
        angle: f64,
    },
}

/// The floor, everywhere at height 0.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Floor {
    /// 0 to 1.
    pub brightness: f64,
    /// Its axes are those of the map.
    pub texture: Texture,
    /// Shadows, sun and stains lying on the floor.
    pub patches: Vec<Patch>,
}

impl Default for Floor {
    fn default() -> Self {
        Self {
            brightness: 0.55,
            texture: Texture::Plain,
            patches: Vec::new(),
        }
    }
}

/// A rectangle of changed brightness on the floor: a shadow, a patch of sun.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Patch {
    /// Centre [m].
    pub at: [f64; 2],
    /// Length and width [m].
    pub size: [f64; 2],
    /// Direction of its length [deg].
    pub yaw_deg: f64,
    /// Factor on the brightness: below 1 a shadow, above 1 sun.
    pub factor: f64,
    /// Width over which its border fades [m], 0 or more.
    pub softness: f64,
}

impl Default for Patch {
    fn default() -> Self {
        Self {
            at: [0.0; 2],
            size: [1.0; 2],
            yaw_deg: 0.0,
            factor: 0.6,
            softness: 0.05,
        }
    }
}

/// A lamp: shines downwards and sideways, falls off with the square of the distance.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lamp {
    /// [m]
    pub at: [f64; 2],
    /// Above the floor [m], above 0.
    pub height: f64,
    /// Light that it adds to a surface that faces it from 1 m.
    pub power: f64,
}

impl Default for Lamp {
    fn default() -> Self {
        Self {
            at: [0.0; 2],
            height: 2.5,
            power: 1.5,
        }
    }
}

/// A straight wall around the line from `from` to `to`; its ends reach half its thickness past the two
/// points, so that corners close.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wall {
    /// [m]
    pub from: [f64; 2],
    /// [m]
    pub to: [f64; 2],
    /// [m]; 0 = up to the ceiling.
    pub height: f64,
    /// [m], 0 or more.
    pub thickness: f64,
    /// 0 to 1.
    pub brightness: f64,
    /// Its axes: along the wall, and up.
    pub texture: Texture,
    /// Height of the skirting board [m]; 0 = none.
    pub skirting: f64,
    /// Brightness of the skirting board.
    pub skirting_brightness: f64,
    /// Openings; they must not overlap.
    pub doors: Vec<Door>,
    /// Rectangles on its faces.
    pub posters: Vec<Poster>,
}

impl Default for Wall {
    fn default() -> Self {
        Self {
            from: [0.0; 2],
            to: [1.0, 0.0],
            height: 0.0,
            thickness: 0.12,
            brightness: 0.8,
            texture: Texture::Plain,
            skirting: 0.08,
            skirting_brightness: 0.25,
            doors: Vec::new(),
            posters: Vec::new(),
        }
    }
}

/// A side of a wall, seen along it from `from` to `to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// To the left of its direction.
    #[default]
    Left,
    /// To the right of its direction.
    Right,
}

/// At which jamb a door's leaf hangs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hinge {
    /// No leaf: an open doorway.
    None,
    /// The jamb nearer to the wall's `from`.
    #[default]
    Near,
    /// The jamb farther from it.
    Far,
}

/// A doorway in a wall, with its frame on both faces, and its leaf.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Door {
    /// From the wall's `from` to the nearer jamb [m].
    pub at: f64,
    /// Clear width [m], above 0.
    pub width: f64,
    /// Clear height [m], above 0.
    pub height: f64,
    /// Width of the frame's face around the opening [m]; 0 = no frame.
    pub frame: f64,
    /// 0 to 1.
    pub frame_brightness: f64,
    /// Where the leaf hangs.
    pub hinge: Hinge,
    /// The side to which it opens; a closed leaf is flush with that face.
    pub swing: Side,
    /// How far it is open [deg], 0 to 180.
    pub open_deg: f64,
    /// Brightness of the leaf, 0 to 1.
    pub brightness: f64,
}

impl Default for Door {
    fn default() -> Self {
        Self {
            at: 0.5,
            width: 0.9,
            height: 2.05,
            frame: 0.07,
            frame_brightness: 0.3,
            hinge: Hinge::Near,
            swing: Side::Left,
            open_deg: 0.0,
            brightness: 0.5,
        }
    }
}

/// A flat rectangle on a wall: a poster, a board, a window.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Poster {
    /// From the wall's `from` to its nearer edge [m].
    pub at: f64,
    /// [m]
    pub width: f64,
    /// Height of its lower edge above the floor [m].
    pub bottom: f64,
    /// [m]
    pub height: f64,
    /// 0 to 1.
    pub brightness: f64,
    /// The face it hangs on.
    pub side: Side,
}

impl Default for Poster {
    fn default() -> Self {
        Self {
            at: 0.0,
            width: 0.6,
            bottom: 1.0,
            height: 0.8,
            brightness: 0.4,
            side: Side::Left,
        }
    }
}

/// A piece of furniture with four upright sides.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Block {
    /// Centre [m].
    pub at: [f64; 2],
    /// Length and width [m].
    pub size: [f64; 2],
    /// Direction of its length [deg].
    pub yaw_deg: f64,
    /// Height of its underside above the floor [m]; 0 = it stands on the floor.
    pub bottom: f64,
    /// Height of its top above the floor [m], above `bottom`.
    pub height: f64,
    /// 0 to 1.
    pub brightness: f64,
    /// Its axes: along a side and up; along its length and width on top.
    pub texture: Texture,
}

impl Default for Block {
    fn default() -> Self {
        Self {
            at: [0.0; 2],
            size: [0.5; 2],
            yaw_deg: 0.0,
            bottom: 0.0,
            height: 0.75,
            brightness: 0.45,
            texture: Texture::Plain,
        }
    }
}

/// An upright cylinder: a pillar, a bin, a plant pot.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cylinder {
    /// Centre [m].
    pub at: [f64; 2],
    /// [m], above 0.
    pub radius: f64,
    /// Height of its top above the floor [m], above 0.
    pub height: f64,
    /// 0 to 1.
    pub brightness: f64,
    /// Its axes: around and up.
    pub texture: Texture,
}

impl Default for Cylinder {
    fn default() -> Self {
        Self {
            at: [0.0; 2],
            radius: 0.2,
            height: 0.75,
            brightness: 0.45,
            texture: Texture::Plain,
        }
    }
}

/// A person who walks to and fro along a way.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Walker {
    /// The way, two points or more [m].
    pub way: Vec<[f64; 2]>,
    /// [m/s], 0 or more.
    pub speed: f64,
    /// How far along the way (there and back) the person is at time 0 [m].
    pub start: f64,
    /// Brightness of trousers and shirt, 0 to 1.
    pub brightness: [f64; 2],
    /// Stands while the robot is before the person and nearer than this [m, body to body], and turns back after
    /// three seconds; 0, the default, walks on as if no robot were there.
    pub keeps: f64,
}

impl Default for Walker {
    fn default() -> Self {
        Self {
            way: Vec::new(),
            speed: 1.0,
            start: 0.0,
            brightness: [0.15, 0.6],
            keeps: 0.0,
        }
    }
}
