//! From the 8-bit occupancy image to the thinned free region, stage by stage.
//!
//! Source: W. Choi, C. Ryu, H. Kim, Navigation of a Mobile Robot using Mono-Vision and
//! Mono-Audition, IEEE Int. Conf. on Systems, Man, and Cybernetics 1999, section 2.2 and Fig. 5.

use crate::{
    BitImage, Border, Change, Components, Connectivity, Difference, Element, GrowRule, Kinship,
    Pixel, close, grow, holes, open, seed_fill, thin, threshold,
};

/// Which thinning makes the skeleton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Thinning {
    /// [`thin::zhang_suen`], the thinning of the textbook that the paper cites.
    #[default]
    ZhangSuen,
    /// [`thin::guo_hall`].
    GuoHall,
    /// [`thin::homotopic`]: keeps every component and hole.
    Homotopic,
}

/// The numbers of the cleaning chain; the default is the paper's chain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CleanerParams {
    /// Gray value from which on a pixel is free, 0 to 255. The paper's threshold 0.5 of an
    /// inverse-linear picture is 128. Raising it makes fewer pixels free.
    pub threshold: u8,
    /// Side of the square that opens [pixels], at least 1 (1 = no opening). Raising it drops
    /// wider wrong readings, and narrower passages with them. The paper gives no size.
    pub opening_side: usize,
    /// Side of the square that closes [pixels], at least 1 (1 = no closing). Raising it fills
    /// wider gaps, and larger obstacles with them. The paper gives no size.
    pub closing_side: usize,
    /// Side of a grown cell [pixels], at least 1: the robot's size over the map's resolution.
    pub cell_side: usize,
    /// When a grown cell is free. The paper does not say.
    pub grow_rule: GrowRule,
    /// Which free pixels are neighbours, when filling and when counting.
    pub connectivity: Connectivity,
    /// What lies outside the picture, when opening and closing.
    pub border: Border,
    /// A pixel of the region to keep; `None` keeps the largest component.
    pub seed: Option<Pixel>,
    /// Which thinning makes the skeleton.
    pub thinning: Thinning,
}

impl Default for CleanerParams {
    fn default() -> Self {
        Self {
            threshold: 128,
            opening_side: 3,
            closing_side: 3,
            cell_side: 3,
            grow_rule: GrowRule::All,
            connectivity: Connectivity::Eight,
            border: Border::Background,
            seed: None,
            thinning: Thinning::ZhangSuen,
        }
    }
}

/// Why an image could not be cleaned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CleanError {
    /// A side among the parameters is 0.
    #[error("{name} must be at least 1")]
    ZeroSide {
        /// The parameter's name.
        name: &'static str,
    },
    /// The seed does not lie on a pixel that is free after opening.
    #[error("the seed ({}, {}) is not free after opening, in a picture of {width} x {height}", seed.x, seed.y)]
    SeedNotFree {
        /// The seed.
        seed: Pixel,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
}

/// The stages of the chain, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize),
    serde(rename_all = "lowercase")
)]
pub enum Stage {
    /// After the threshold.
    Binary,
    /// After opening: frayed borders and wrong readings are gone.
    Opened,
    /// After the seed fill: only the target region is left.
    Filled,
    /// After closing: gaps in the region and along its border are filled.
    Closed,
    /// After cell growing: one cell a block.
    Grown,
    /// After thinning.
    Skeleton,
}

impl Stage {
    /// All stages, in order.
    pub const ALL: [Self; 6] = [
        Self::Binary,
        Self::Opened,
        Self::Filled,
        Self::Closed,
        Self::Grown,
        Self::Skeleton,
    ];

    /// The stage's name in lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Binary => "binary",
            Self::Opened => "opened",
            Self::Filled => "filled",
            Self::Closed => "closed",
            Self::Grown => "grown",
            Self::Skeleton => "skeleton",
        }
    }
}

/// The image after every stage; 1 = free. The last two count in cells, the others in pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stages {
    /// After the threshold.
    pub binary: BitImage,
    /// After opening.
    pub opened: BitImage,
    /// After the seed fill.
    pub filled: BitImage,
    /// After closing.
    pub closed: BitImage,
    /// After cell growing.
    pub grown: BitImage,
    /// After thinning.
    pub skeleton: BitImage,
}

impl Stages {
    /// The image after the given stage.
    #[must_use]
    pub const fn get(&self, stage: Stage) -> &BitImage {
        match stage {
            Stage::Binary => &self.binary,
            Stage::Opened => &self.opened,
            Stage::Filled => &self.filled,
            Stage::Closed => &self.closed,
            Stage::Grown => &self.grown,
            Stage::Skeleton => &self.skeleton,
        }
    }
}

/// The ledger's page on one stage. Places and counts are in the pixels of the stage's input,
/// except `free_cells`, `free_components` and `holes`, which describe its output.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Entry {
    /// The stage.
    pub stage: Stage,
    /// Free cells after it.
    pub free_cells: usize,
    /// Components of the free cells after it.
    pub free_components: usize,
    /// Holes in the free cells after it: obstacles that stand alone.
    pub holes: usize,
    /// Free before, not after.
    pub removed: Change,
    /// Free after, not before.
    pub added: Change,
    /// The fate of the free components.
    pub components: Kinship,
    /// The fate of the holes.
    pub hole_kinship: Kinship,
}

/// What every stage did: one entry a stage, in order. The first changes nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Ledger {
    /// The entries, in the order of [`Stage::ALL`].
    pub entries: Vec<Entry>,
}

/// All that the chain returns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cleaned {
    /// The image after every stage.
    pub stages: Stages,
    /// What every stage did.
    pub ledger: Ledger,
}

/// The cleaning chain: threshold, opening, seed filling, closing, cell growing, thinning.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cleaner {
    params: CleanerParams,
}

impl Cleaner {
    /// A chain with these parameters.
    #[must_use]
    pub const fn new(params: CleanerParams) -> Self {
        Self { params }
    }

    /// Cleans an 8-bit occupancy picture, row after row, darker = more occupied.
    ///
    /// # Errors
    /// [`CleanError`] for a side of 0, and for a seed that is not free after opening.
    ///
    /// # Panics
    /// If `gray` does not hold `width * height` values.
    pub fn clean_gray(
        &self,
        gray: &[u8],
        width: usize,
        height: usize,
    ) -> Result<Cleaned, CleanError> {
        // §2.2 i)
        self.clean(threshold(gray, width, height, self.params.threshold))
    }

    /// Cleans an image that is binary already; `threshold` is not used.
    ///
    /// # Errors
    /// [`CleanError`] for a side of 0, and for a seed that is not free after opening.
    pub fn clean(&self, binary: BitImage) -> Result<Cleaned, CleanError> {
        let p = &self.params;
        for (name, side) in [
            ("opening_side", p.opening_side),
            ("closing_side", p.closing_side),
            ("cell_side", p.cell_side),
        ] {
            if side == 0 {
                return Err(CleanError::ZeroSide { name });
            }
        }
        // §2.2 ii)
        let opened = open(&binary, &Element::square(p.opening_side), p.border);
        // §2.2 iii)
        let filled = self.fill(&opened)?;
        // §2.2 iv)
        let closed = close(&filled, &Element::square(p.closing_side), p.border);
        // §2.2 v)
        let grown = grow(&closed, p.cell_side, p.grow_rule);
        // §2.2 vi)
        let skeleton = match p.thinning {
            Thinning::ZhangSuen => thin::zhang_suen(&grown),
            Thinning::GuoHall => thin::guo_hall(&grown),
            Thinning::Homotopic => thin::homotopic(&grown),
        };
        let stages = Stages {
            binary,
            opened,
            filled,
            closed,
            grown,
            skeleton,
        };
        let ledger = self.account(&stages);
        Ok(Cleaned { stages, ledger })
    }

    /// The target region.
    fn fill(&self, opened: &BitImage) -> Result<BitImage, CleanError> {
        let connectivity = self.params.connectivity;
        let seed = match self.params.seed {
            Some(seed) if opened.get(seed.x, seed.y) => Some(seed),
            Some(seed) => {
                return Err(CleanError::SeedNotFree {
                    seed,
                    width: opened.width(),
                    height: opened.height(),
                });
            }
            None => Components::label(opened, connectivity)
                .largest()
                .map(|component| component.first),
        };
        Ok(match seed {
            Some(seed) => seed_fill(opened, seed, connectivity),
            None => BitImage::new(opened.width(), opened.height()),
        })
    }

    fn account(&self, stages: &Stages) -> Ledger {
        let connectivity = self.params.connectivity;
        let mut entries = Vec::with_capacity(Stage::ALL.len());
        let mut before = &stages.binary;
        for stage in Stage::ALL {
            let after = stages.get(stage);
            let Difference {
                removed,
                added,
                components,
                holes: hole_kinship,
            } = match stage {
                Stage::Binary => Difference::default(),
                Stage::Grown => {
                    let spread = spread(after, self.params.cell_side, before);
                    Difference::between(before, &spread, connectivity)
                }
                _ => Difference::between(before, after, connectivity),
            };
            entries.push(Entry {
                stage,
                free_cells: after.count_ones(),
                free_components: Components::label(after, connectivity).count(),
                holes: holes(after, connectivity),
                removed,
                added,
                components,
                hole_kinship,
            });
            before = after;
        }
        Ledger { entries }
    }
}

/// The pixels of the cells: every cell as a block of `k` x `k`, cut to the size of `like`.
fn spread(cells: &BitImage, k: usize, like: &BitImage) -> BitImage {
    BitImage::from_fn(like.width(), like.height(), |x, y| cells.get(x / k, y / k))
}
