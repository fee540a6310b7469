//! Erosion, dilation, opening, closing.

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
    pub(crate) first: Option<BitImage>,
}

impl Workspace {
    /// A workspace that holds nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// The pixels p where every p + b, b in the element, is foreground.
#[must_use]
pub fn erode(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::new(0, 0);
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
    let _ = workspace;
    *out = crate::reference::ops::erode(image, element, border);
}

/// The pixels p where some p + b, b in the element, is foreground.
#[must_use]
pub fn dilate(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::new(0, 0);
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
    let _ = workspace;
    *out = crate::reference::ops::dilate(image, element, border);
}

/// The union of the element's translates that fit into the foreground.
#[must_use]
pub fn open(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::new(0, 0);
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
    let _ = workspace;
    *out = crate::reference::ops::open(image, element, border);
}

/// What the element's reflected translates that fit into the background leave over.
#[must_use]
pub fn close(image: &BitImage, element: &Element, border: Border) -> BitImage {
    let mut out = BitImage::new(0, 0);
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
    let _ = workspace;
    *out = crate::reference::ops::close(image, element, border);
}
