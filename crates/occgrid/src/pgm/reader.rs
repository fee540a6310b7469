//! The header of a PGM, then its samples, within bounds.

use std::io::{self, BufRead};

use super::{PgmEncoding, PgmError, PgmLimits, content};
use crate::map_file_error::quoted;

/// What stands before the samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PgmHeader {
    encoding: PgmEncoding,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) max_value: u16,
}

/// A PGM whose header has been read.
pub(crate) struct PgmReader<R> {
    reader: R,
    offset: u64,
    comment_bytes: u64,
    max_comment_bytes: u64,
    pub(crate) header: PgmHeader,
}

impl<R: BufRead> PgmReader<R> {
    pub(crate) fn new(reader: R, limits: &PgmLimits) -> Result<Self, PgmError> {
        let mut this = Self {
            reader,
            offset: 0,
            comment_bytes: 0,
            max_comment_bytes: limits.max_comment_bytes,
            header: PgmHeader {
                encoding: PgmEncoding::Binary,
                width: 0,
                height: 0,
                max_value: 0,
            },
        };
        let magic = [this.next_byte()?, this.next_byte()?];
        this.header.encoding = match magic {
            [Some(b'P'), Some(b'2')] => PgmEncoding::Ascii,
            [Some(b'P'), Some(b'5')] => PgmEncoding::Binary,
            other => {
                let found: Vec<u8> = other.into_iter().flatten().collect();
                let found = quoted(&String::from_utf8_lossy(&found));
                return Err(content("byte 0", "a PGM (P2 or P5)", found));
            }
        };
        let width = this.header_number("width")?;
        let height = this.header_number("height")?;
        let max_value = this.header_number("maximum value")?;
        for (place, side) in [("width", width), ("height", height)] {
            if side == 0 {
                return Err(content(place, "at least 1 px", "0"));
            }
            check_limit(place, u64::from(limits.max_side), side)?;
        }
        check_limit("pixels", limits.max_pixels, width.saturating_mul(height))?;
        if !(1..=65_535).contains(&max_value) {
            let found = max_value.to_string();
            return Err(content("maximum value", "1 to 65535", found));
        }
        this.header.width = width as u32;
        this.header.height = height as u32;
        this.header.max_value = max_value as u16;
        Ok(this)
    }

    /// The samples, each passed through `of_sample` (which is called once for each possible value,
    /// not once a pixel). `file_bytes`, where known, is the length of the whole file: a file too
    /// short for its header is refused before any memory is asked for.
    pub(crate) fn decode<T: Copy>(
        mut self,
        file_bytes: Option<u64>,
        of_sample: impl Fn(u16) -> T,
    ) -> Result<Vec<T>, PgmError> {
        let PgmHeader {
            encoding,
            width,
            height,
            max_value,
        } = self.header;
        let pixels = u64::from(width) * u64::from(height);
        let least = match encoding {
            PgmEncoding::Ascii => 2 * pixels - 1,
            PgmEncoding::Binary if max_value < 256 => pixels,
            PgmEncoding::Binary => 2 * pixels,
        };
        if let Some(bytes) = file_bytes {
            let left = bytes.saturating_sub(self.offset);
            if left < least {
                let place = format!("samples (from byte {})", self.offset);
                let expected = format!("{pixels} samples in at least {least} bytes");
                return Err(content(place, expected, format!("{left} bytes")));
            }
        }
        let table: Vec<T> = (0..=max_value).map(of_sample).collect();
        let mut out = Vec::new();
        let pixels = usize::try_from(pixels).unwrap_or(usize::MAX);
        out.try_reserve_exact(pixels)
            .map_err(|e| PgmError::Io(io::Error::new(io::ErrorKind::OutOfMemory, e)))?;
        match encoding {
            PgmEncoding::Ascii => self.decode_ascii(pixels, &table, &mut out)?,
            PgmEncoding::Binary if max_value < 256 => {
                self.decode_bytes(pixels, &table, &mut out)?
            }
            PgmEncoding::Binary => self.decode_words(pixels, &table, &mut out)?,
        }
        Ok(out)
    }

    fn decode_bytes<T: Copy>(
        &mut self,
        pixels: usize,
        table: &[T],
        out: &mut Vec<T>,
    ) -> Result<(), PgmError> {
        let mut chunk = vec![0; CHUNK.min(pixels)];
        let highest = (table.len() - 1) as u8;
        // a full table lets the compiler drop the bounds check of every pixel
        let mut full = [table[0]; 256];
        full[..table.len()].copy_from_slice(table);
        while out.len() < pixels {
            let wanted = chunk.len().min(pixels - out.len());
            let bytes = &mut chunk[..wanted];
            self.read_samples(bytes, out.len(), pixels)?;
            if highest < 255
                && let Some(i) = bytes.iter().position(|&b| b > highest)
            {
                return Err(self.too_high(
                    (wanted - i) as u64,
                    u32::from(bytes[i]),
                    highest.into(),
                ));
            }
            out.extend(bytes.iter().map(|&b| full[usize::from(b)]));
        }
        Ok(())
    }

    fn decode_words<T: Copy>(
        &mut self,
        pixels: usize,
        table: &[T],
        out: &mut Vec<T>,
    ) -> Result<(), PgmError> {
        let mut chunk = vec![0; CHUNK.min(2 * pixels)];
        while out.len() < pixels {
            let wanted = chunk.len().min(2 * (pixels - out.len()));
            let bytes = &mut chunk[..wanted];
            self.read_samples(bytes, out.len(), pixels)?;
            for (i, pair) in bytes.chunks_exact(2).enumerate() {
                let sample = u16::from_be_bytes([pair[0], pair[1]]);
                let Some(&value) = table.get(usize::from(sample)) else {
                    let back = (wanted - 2 * i) as u64;
                    return Err(self.too_high(back, sample.into(), (table.len() - 1) as u16));
                };
                out.push(value);
            }
        }
        Ok(())
    }

    fn decode_ascii<T: Copy>(
        &mut self,
        pixels: usize,
        table: &[T],
        out: &mut Vec<T>,
    ) -> Result<(), PgmError> {
        let highest = (table.len() - 1) as u32;
        // the number being read; none between numbers
        let mut number: Option<u32> = None;
        let mut in_comment = false;
        while out.len() < pixels {
            let buffer = self.reader.fill_buf()?;
            if buffer.is_empty() {
                if let Some(value) = number.take() {
                    out.push(table[value as usize]);
                    continue;
                }
                let found = format!("the end after {} samples", out.len());
                return Err(content("samples", format!("{pixels} samples"), found));
            }
            let mut used = 0;
            for &byte in buffer {
                used += 1;
                if in_comment {
                    self.comment_bytes += 1;
                    in_comment = byte != b'\n' && byte != b'\r';
                    continue;
                }
                if byte.is_ascii_digit() {
                    let value = number.unwrap_or(0) * 10 + u32::from(byte - b'0');
                    if value > highest {
                        self.offset += used as u64;
                        return Err(self.too_high(1, value, highest as u16));
                    }
                    number = Some(value);
                    continue;
                }
                if !is_space(byte) && byte != b'#' {
                    let place = format!("byte {}", self.offset + used as u64 - 1);
                    let found = quoted(&char::from(byte).to_string());
                    return Err(content(place, "a decimal sample", found));
                }
                in_comment = byte == b'#';
                if let Some(value) = number.take() {
                    out.push(table[value as usize]);
                    if out.len() == pixels {
                        break;
                    }
                }
            }
            self.reader.consume(used);
            self.offset += used as u64;
            self.check_comments()?;
        }
        Ok(())
    }

    fn too_high(&self, bytes_back: u64, found: u32, highest: u16) -> PgmError {
        content(
            format!("byte {}", self.offset.saturating_sub(bytes_back)),
            format!("a sample of at most {highest}"),
            found.to_string(),
        )
    }

    /// Fills `bytes` or says how many samples were there.
    fn read_samples(
        &mut self,
        bytes: &mut [u8],
        samples_so_far: usize,
        pixels: usize,
    ) -> Result<(), PgmError> {
        match self.reader.read_exact(bytes) {
            Ok(()) => {
                self.offset += bytes.len() as u64;
                Ok(())
            }
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Err(content(
                format!("samples (from byte {})", self.offset),
                format!("{pixels} samples"),
                format!("the end after sample {samples_so_far} or soon after"),
            )),
            Err(e) => Err(e.into()),
        }
    }

    fn peek(&mut self) -> io::Result<Option<u8>> {
        Ok(self.reader.fill_buf()?.first().copied())
    }

    fn next_byte(&mut self) -> io::Result<Option<u8>> {
        let byte = self.peek()?;
        if byte.is_some() {
            self.reader.consume(1);
            self.offset += 1;
        }
        Ok(byte)
    }

    fn check_comments(&self) -> Result<(), PgmError> {
        check_limit("comment bytes", self.max_comment_bytes, self.comment_bytes)
    }

    /// White space and comments, then a number and the one byte of white space that ends it.
    fn header_number(&mut self, name: &'static str) -> Result<u64, PgmError> {
        loop {
            match self.peek()? {
                Some(b'#') => self.skip_comment()?,
                Some(byte) if is_space(byte) => {
                    // white space is bounded as comments are
                    self.comment_bytes += 1;
                    self.check_comments()?;
                    self.next_byte()?;
                }
                // white space must follow the magic number
                Some(byte) if byte.is_ascii_digit() && self.offset > 2 => break,
                other => return Err(self.no_number(name, other)),
            }
        }
        let mut number = 0_u64;
        while let Some(byte) = self.peek()?.filter(u8::is_ascii_digit) {
            number = number
                .saturating_mul(10)
                .saturating_add(u64::from(byte - b'0'));
            self.next_byte()?;
            // leading zeros are bounded as comments are
            self.comment_bytes += 1;
            self.check_comments()?;
        }
        match self.peek()? {
            Some(byte) if is_space(byte) => {
                self.next_byte()?;
                Ok(number)
            }
            // the end of the comment's line is the white space that ends the number
            Some(b'#') => self.skip_comment().map(|()| number),
            other => Err(self.no_number(name, other)),
        }
    }

    /// From the `#` to the end of its line.
    fn skip_comment(&mut self) -> Result<(), PgmError> {
        loop {
            self.comment_bytes += 1;
            self.check_comments()?;
            if matches!(self.next_byte()?, None | Some(b'\n' | b'\r')) {
                return Ok(());
            }
        }
    }

    fn no_number(&self, name: &'static str, found: Option<u8>) -> PgmError {
        let found = found.map_or_else(
            || "the end of the file".to_owned(),
            |byte| quoted(&char::from(byte).to_string()),
        );
        let place = format!("byte {}", self.offset);
        content(place, format!("the {name} as a decimal number"), found)
    }
}

/// Bytes read at a time: fits the second-level cache with the values made from them.
const CHUNK: usize = 1 << 16;

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c)
}

fn check_limit(place: &'static str, limit: u64, found: u64) -> Result<(), PgmError> {
    if found > limit {
        return Err(PgmError::Limit {
            place: place.to_owned(),
            limit,
            found,
        });
    }
    Ok(())
}
