//! Real ports.

use std::io::{self, Read, Write};
use std::time::Duration;

use serialport::{SerialPort as _, StopBits, TTYPort};
use thiserror::Error;

/// Why a port was not opened.
#[derive(Debug, Error)]
#[error("{path}: {source}")]
pub struct OpenError {
    /// The port's name.
    pub path: String,
    /// What the system says.
    pub source: serialport::Error,
}

/// An open port: raw, exclusive, reads return after 5 ms.
#[derive(Debug)]
pub struct Port(TTYPort);

/// Opens a port, best by its stable name as in `/dev/serial/by-id`, with eight data bits, no parity, and two
/// stop bits where `two_stop_bits` (SRF02) or one. What had come before is thrown away.
///
/// # Errors
/// [`OpenError`] with the port's name: it does not exist, is in use, or may not be opened.
pub fn open(path: &str, baud: u32, two_stop_bits: bool) -> Result<Port, OpenError> {
    let stop_bits = if two_stop_bits {
        StopBits::Two
    } else {
        StopBits::One
    };
    let named = |source| OpenError {
        path: path.to_owned(),
        source,
    };
    let port = serialport::new(path, baud)
        .stop_bits(stop_bits)
        .timeout(Duration::from_millis(5))
        .open_native()
        .map_err(named)?;
    port.clear(serialport::ClearBuffer::Input).map_err(named)?;
    Ok(Port(port))
}

impl Port {
    /// The same port once more, to write to it from another thread.
    ///
    /// # Errors
    /// The system's.
    #[cfg(unix)]
    pub(crate) fn again(&self) -> io::Result<Self> {
        Ok(Self(self.0.try_clone_native()?))
    }
}

impl Read for Port {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}
