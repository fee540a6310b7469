//! Words that begin where a cache line begins: a register of 64 bytes then loads and stores one line, not
//! halves of two.

use std::ops::{Deref, DerefMut};

/// Words a line.
const LINE: usize = 8;

/// Some words, the first at the start of a cache line.
#[derive(Default)]
pub(crate) struct AlignedWords {
    buffer: Vec<u64>,
    start: usize,
    len: usize,
}

impl AlignedWords {
    /// All 0.
    pub(crate) fn zeros(len: usize) -> Self {
        let mut words = Self::default();
        words.resize(len);
        words
    }

    /// Takes a length, in the memory it has where that suffices; the words are of any value.
    pub(crate) fn resize(&mut self, len: usize) {
        if self.buffer.len() < len + LINE {
            // fresh zeros cost nothing until they are touched
            self.buffer = vec![0; len + LINE];
            self.start = self.buffer.as_ptr().align_offset(LINE * 8).min(LINE);
        }
        self.len = len;
    }
}

impl Clone for AlignedWords {
    fn clone(&self) -> Self {
        let mut words = Self::zeros(self.len);
        words.copy_from_slice(self);
        words
    }
}

impl std::fmt::Debug for AlignedWords {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(&**self).finish()
    }
}

impl PartialEq for AlignedWords {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl Eq for AlignedWords {}

impl Deref for AlignedWords {
    type Target = [u64];

    #[inline]
    fn deref(&self) -> &[u64] {
        &self.buffer[self.start..self.start + self.len]
    }
}

impl DerefMut for AlignedWords {
    #[inline]
    fn deref_mut(&mut self) -> &mut [u64] {
        &mut self.buffer[self.start..self.start + self.len]
    }
}
