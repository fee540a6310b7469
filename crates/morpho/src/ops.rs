//! Erosion, dilation, opening, closing.

use crate::window::{Buffers, Operation, Step, Turn};
use crate::{BitImage, Element};

/// What an operation takes the pixels outside the image to be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Border {
    /// They do not count: an element is cut to the part that lies inside the image. Erosion does
    /// not eat from the edge, dilation does not grow from it. OpenCV's default.
    #[default]
    Neutral,
    /// They are background (occupied): erosion eats from the edge.
    Background,
    /// They are foreground (free): dilation grows from the edge.
    Foreground,
}

/// Memory that the `_into` forms keep between calls: after the first call of a kind, further calls
/// on images of that size allocate nothing.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    buffers: Buffers,
    between: BitImage,
    plane: BitImage,
}

impl Workspace {
    /// A workspace that holds nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// The pixels p where every p + b, b in the element, is foreground.
///
/// `erode(x, e, border)` is the complement of [`dilate`] of the complement of x under the border
/// rule with foreground and background exchanged. The result is OpenCV's `erode`.
#[must_use]
pub fn erode(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::default();
    erode_into(image, element, border, &mut Workspace::new(), &mut out);
    out
}

/// [`erode`] into an image whose memory is reused.
pub fn erode_into(
    image: &BitImage,
    element: &Element,
    border: Border,
    workspace: &mut Workspace,
    out: &mut BitImage,
) {
    let step = Step::erosion(element, Turn::Upright, border);
    step.run(image, &mut workspace.buffers, out);
}

/// The pixels p where some p + b, b in the element, is foreground. The result is OpenCV's `dilate`;
/// for the Minkowski sum give it [`Element::reflected`].
#[must_use]
pub fn dilate(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::default();
    dilate_into(image, element, border, &mut Workspace::new(), &mut out);
    out
}

/// [`dilate`] into an image whose memory is reused.
pub fn dilate_into(
    image: &BitImage,
    element: &Element,
    border: Border,
    workspace: &mut Workspace,
    out: &mut BitImage,
) {
    let step = Step::dilation(element, Turn::Upright, border);
    step.run(image, &mut workspace.buffers, out);
}

/// The union of the translates of the element that fit into the foreground: erosion, then dilation
/// with the reflected element, on the infinite plane, of which the image's part is returned. A
/// subset of the image, under every border rule and for every element; under [`Border::Neutral`]
/// opening twice changes nothing more.
#[must_use]
pub fn open(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::default();
    open_into(image, element, border, &mut Workspace::new(), &mut out);
    out
}

/// [`open`] into an image whose memory is reused.
pub fn open_into(
    image: &BitImage,
    element: &Element,
    border: Border,
    workspace: &mut Workspace,
    out: &mut BitImage,
) {
    let steps = [
        Step::erosion(element, Turn::Upright, border),
        Step::dilation(element, Turn::Reflected, border),
    ];
    // eroded to background, the outside is neutral to the dilation too
    let local = border == Border::Background && element.contains(0, 0);
    both(
        image,
        steps,
        local || border == Border::Neutral,
        workspace,
        out,
    );
}

/// Dilation, then erosion with the reflected element, on the infinite plane. A superset of the
/// image, under every border rule and for every element; under [`Border::Neutral`] closing twice
/// changes nothing more.
///
/// `close(x, e, border)` is the complement of `open` of the complement of x under the border rule
/// with foreground and background exchanged.
#[must_use]
pub fn close(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::default();
    close_into(image, element, border, &mut Workspace::new(), &mut out);
    out
}

/// [`close`] into an image whose memory is reused.
pub fn close_into(
    image: &BitImage,
    element: &Element,
    border: Border,
    workspace: &mut Workspace,
    out: &mut BitImage,
) {
    let steps = [
        Step::dilation(element, Turn::Upright, border),
        Step::erosion(element, Turn::Reflected, border),
    ];
    let local = border == Border::Foreground && element.contains(0, 0);
    both(
        image,
        steps,
        local || border == Border::Neutral,
        workspace,
        out,
    );
}

impl<'a> Step<'a> {
    fn erosion(element: &'a Element, turn: Turn, border: Border) -> Self {
        Self {
            operation: Operation::Erode,
            element,
            turn,
            outside: border != Border::Background,
        }
    }

    fn dilation(element: &'a Element, turn: Turn, border: Border) -> Self {
        Self {
            operation: Operation::Dilate,
            element,
            turn,
            outside: border == Border::Foreground,
        }
    }
}

/// Two steps. Unless they are `local`, what the first makes of the outside near the image matters
/// to the second, so both run on a plane with that margin.
fn both(
    image: &BitImage,
    [first, second]: [Step<'_>; 2],
    local: bool,
    workspace: &mut Workspace,
    out: &mut BitImage,
) {
    let Workspace {
        buffers,
        between,
        plane,
    } = workspace;
    if local {
        first.run_both(&second, image, buffers, between, out);
        return;
    }
    let margin = Margin::new(first.element.reach());
    margin.embed(image, first.outside, plane);
    first.run_both(&second, plane, buffers, out, between);
    margin.crop(between, image.width(), image.height(), out);
}

/// A margin of whole words left, and of rows above and below.
struct Margin {
    words: usize,
    rows: usize,
}

impl Margin {
    fn new(reach: usize) -> Self {
        Self {
            words: reach.div_ceil(64),
            rows: reach,
        }
    }

    /// The image with the margin all round it, which is `outside`.
    fn embed(&self, image: &BitImage, outside: bool, plane: &mut BitImage) {
        let width = self.words * 64 + image.width() + self.rows;
        plane.reset(width, image.height() + 2 * self.rows);
        if outside {
            plane.invert();
        }
        let (stride, tail) = (image.stride(), image.tail_mask());
        for y in 0..image.height() {
            let row = &mut plane.row_mut(y + self.rows)[self.words..][..stride];
            let rest = row.last().map_or(0, |last| last & !tail);
            row.copy_from_slice(image.row(y));
            if let Some(last) = row.last_mut() {
                *last |= rest;
            }
        }
    }

    /// The part of the plane inside the margin.
    fn crop(&self, plane: &BitImage, width: usize, height: usize, out: &mut BitImage) {
        out.reshape(width, height);
        let (stride, tail) = (out.stride(), out.tail_mask());
        for y in 0..height {
            let row = out.row_mut(y);
            row.copy_from_slice(&plane.row(y + self.rows)[self.words..][..stride]);
            if let Some(last) = row.last_mut() {
                *last &= tail;
            }
        }
    }
}
