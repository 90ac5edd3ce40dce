//! Reading input files whole, and creating output files, but never without end: devices and pipes are refused before a byte is read, and so are files
//! larger than any input can be.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// Most bytes of a text that people write: scenarios, tables, robots.
const LARGEST_TEXT: u64 = 64 << 20;
/// Most bytes of data: meshes, elevation, recordings.
const LARGEST_DATA: u64 = 16 << 30;

/// Opens a regular file.
///
/// # Errors
/// The error of the system, or that the path is a folder, a pipe or a device.
pub fn open(path: &Path) -> Result<File> {
    // looked at before: to open a pipe waits for its other end
    let kind = std::fs::metadata(path)?.file_type();
    let what = match () {
        () if kind.is_file() => return File::open(path),
        () if kind.is_dir() => "a folder",
        () if kind.is_fifo() => "a pipe (FIFO)",
        () if kind.is_socket() => "a socket",
        () => "a device",
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, not a regular file")))
}

/// Reports before a file is created that it would block: a pipe without a reader holds up its writer for ever. Those of
/// the shell and standard output, below `/dev` and `/proc`, have a reader.
///
/// # Errors
/// It is a pipe, or a folder.
pub fn can_create(path: &Path) -> Result<()> {
    let Ok(kind) = std::fs::metadata(path).map(|m| m.file_type()) else { return Ok(()) };
    let of_the_system = path.starts_with("/dev") || path.starts_with("/proc");
    let what = match () {
        () if kind.is_dir() => "a folder",
        () if kind.is_fifo() && !of_the_system => "a pipe (FIFO), which may have no reader",
        () => return Ok(()),
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}: name a file")))
}

/// All bytes of a data file.
///
/// # Errors
/// As [`open`], or that it is too large.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    bounded(path, LARGEST_DATA)
}

/// All of a text file.
///
/// # Errors
/// As [`open`], that it is too large, or that it is no text.
pub fn read_text(path: &Path) -> Result<String> {
    text(bounded(path, LARGEST_TEXT)?)
}

/// All of a text file that holds data, such as a grid of heights.
///
/// # Errors
/// As [`read_text`].
pub fn read_large_text(path: &Path) -> Result<String> {
    text(read(path)?)
}

fn text(bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        Error::new(ErrorKind::InvalidData, format!("it is no text in UTF-8 (byte {at})"))
    })
}

fn bounded(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let stated = file.metadata()?.len();
    let mut bytes = Vec::new();
    let room = usize::try_from(stated.min(limit)).unwrap_or(usize::MAX);
    let full = || Error::new(ErrorKind::OutOfMemory, format!("there is no memory for its {stated} bytes"));
    if stated <= limit {
        bytes.try_reserve_exact(room).map_err(|_| full())?;
        file.take(limit + 1).read_to_end(&mut bytes)?;
    }
    // files of the system state no size
    if stated > limit || bytes.len() as u64 > limit {
        let message = format!("it is larger than {} MiB, the most that is read", limit >> 20);
        return Err(Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_never_ends_is_refused_before_it_is_read() {
        for (path, what) in [("/dev/zero", "a device"), ("/tmp", "a folder"), ("/no/such", "No such file")] {
            let error = read(Path::new(path)).expect_err("refused");
            assert!(error.to_string().contains(what), "{error}");
        }
    }

    #[test]
    fn large_files_and_bytes_that_are_no_text_are_refused() {
        let path = std::env::temp_dir().join(format!("terraglue-files-{}", std::process::id()));
        std::fs::write(&path, b"ab\xff").expect("written");
        assert!(read_text(&path).expect_err("no text").to_string().contains("byte 2"));
        assert_eq!(read(&path).expect("bytes"), b"ab\xff");
        // sparse: takes no room on the disk
        File::options().write(true).open(&path).and_then(|f| f.set_len(LARGEST_TEXT + 1)).expect("grown");
        let error = read_text(&path).expect_err("refused");
        std::fs::remove_file(&path).expect("removed");
        assert!(error.to_string().contains("larger than 64 MiB"), "{error}");
    }
}
