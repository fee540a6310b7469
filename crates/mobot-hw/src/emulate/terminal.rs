//! A pseudo-terminal under a name that stays when it is pulled out and plugged in again.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};
use rustix::io::FdFlags;
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

/// A pseudo-terminal in raw mode, and a symbolic link to it; dropped, both are gone.
#[derive(Debug)]
pub(super) struct Terminal {
    ours: OwnedFd,
    /// Held open so that a client may come and go.
    _theirs: OwnedFd,
    link: PathBuf,
}

impl Terminal {
    /// Makes one; a link of that name that is left over is replaced.
    pub(super) fn open(link: &Path) -> io::Result<Self> {
        // a child process that kept an end would keep a pulled plug in
        let ours = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        rustix::io::fcntl_setfd(&ours, FdFlags::CLOEXEC)?;
        rustix::pty::grantpt(&ours)?;
        rustix::pty::unlockpt(&ours)?;
        let name = rustix::pty::ptsname(&ours, Vec::new())?;
        let path = PathBuf::from(name.into_string().map_err(io::Error::other)?);
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let theirs = rustix::fs::open(&path, flags, Mode::empty())?;
        let mut mode = rustix::termios::tcgetattr(&theirs)?;
        mode.make_raw();
        rustix::termios::tcsetattr(&theirs, OptionalActions::Now, &mode)?;
        rustix::fs::fcntl_setfl(&ours, OFlags::RDWR | OFlags::NONBLOCK)?;
        if link.is_symlink() {
            std::fs::remove_file(link)?;
        }
        std::os::unix::fs::symlink(path, link)?;
        Ok(Self {
            ours,
            _theirs: theirs,
            link: link.to_owned(),
        })
    }

    /// How many bytes have come; 0 where none did.
    pub(super) fn read(&self, bytes: &mut [u8]) -> usize {
        // nothing to read is no error here; nobody else has the other end
        rustix::io::read(&self.ours, bytes).unwrap_or(0)
    }

    /// Sends; what does not fit is lost, as on a line that nobody reads.
    pub(super) fn write(&self, bytes: &[u8]) {
        rustix::io::write(&self.ours, bytes).ok();
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        std::fs::remove_file(&self.link).ok();
    }
}
