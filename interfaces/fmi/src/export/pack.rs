//! Writes the archive of an FMU.

use std::fs::File;
use std::io::{Cursor, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;

/// Content of an entry of the archive.
#[derive(Clone, Debug)]
pub enum Content {
    /// Text.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
    /// A copy of a file.
    File(PathBuf),
}

/// How the entries of an archive are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// As they are: for an archive that is read once.
    None,
    /// Smaller.
    Deflate,
}

/// Writes an archive with these entries, in their order. The same content gives the same bytes: no time is written.
///
/// # Errors
/// A file that cannot be read or written, with its path.
pub fn pack(path: &Path, entries: &[(String, Content)], compression: Compression) -> Result<(), String> {
    let failed = |what: &Path, e: &dyn std::fmt::Display| format!("{}: {e}", what.display());
    // the archive is renamed into its place: anything there that is not a file (`/dev/null`, a pipe) would be gone
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Err(format!(
            "{}: is no file: the archive cannot take its place; name another path",
            path.display()
        ));
    }
    // an earlier FMU is an archive, which begins with PK
    let mut first = [b'P', b'K'];
    let full = File::open(path).is_ok_and(|mut file| file.read_exact(&mut first).is_ok());
    if full && &first != b"PK" {
        return Err(format!("{}: is no FMU and would be lost; name another path", path.display()));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(format!("{}: there is no folder {}", path.display(), folder.display()));
    }
    // a name of its own until it is whole
    let part = tempfile::Builder::new().prefix(".unit").tempfile_in(folder);
    let part = part.map_err(|e| failed(path, &e))?;
    // whole in memory: a writer of archives that meets a full disk complains a second time when it is dropped
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let method = match compression {
        Compression::None => zip::CompressionMethod::Stored,
        Compression::Deflate => zip::CompressionMethod::Deflated,
    };
    for (name, content) in entries {
        let library = name.starts_with("binaries/") || name.ends_with(".so");
        let options = SimpleFileOptions::default().compression_method(method).unix_permissions(if library {
            0o755
        } else {
            0o644
        });
        archive.start_file(name.as_str(), options).map_err(|e| failed(path, &e))?;
        match content {
            Content::Text(text) => archive.write_all(text.as_bytes()).map_err(|e| failed(path, &e))?,
            Content::Bytes(bytes) => archive.write_all(bytes).map_err(|e| failed(path, &e))?,
            Content::File(source) => {
                let mut file = File::open(source).map_err(|e| failed(source, &e))?;
                std::io::copy(&mut file, &mut archive).map_err(|e| failed(path, &e))?;
            }
        }
    }
    let bytes = archive.finish().map_err(|e| failed(path, &e))?.into_inner();
    part.as_file().write_all(&bytes).map_err(|e| match e.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            let room =
                rustix::fs::fstatvfs(part.as_file()).map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize));
            let room = room.map_or_else(|_| "an unknown number of MiB".into(), |room| mib(room as f64));
            failed(path, &format!("{e}; it has {}, {room} are free there", mib(bytes.len() as f64)))
        }
        _ => failed(path, &e),
    })?;
    let kept = part.persist(path).map_err(|e| failed(path, &e))?;
    readable(&kept).map_err(|e| failed(path, &e))
}

fn mib(bytes: f64) -> String {
    format!("{:.1} MiB", bytes / f64::from(1 << 20))
}

/// Temporary files are the owner's alone; an FMU is for everybody.
fn readable(file: &File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::FileTypeExt;

    #[test]
    fn takes_the_place_of_files_only() {
        let folder = tempfile::tempdir().expect("a folder");
        let entries = [("a.txt".to_owned(), Content::Text("a".into()))];
        let socket = folder.path().join("socket");
        let _open = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        let message = pack(&socket, &entries, Compression::Deflate).expect_err("no file");
        assert!(message.contains("is no file"), "{message}");
        assert!(std::fs::metadata(&socket).expect("stands").file_type().is_socket());
        let notes = folder.path().join("notes.txt");
        std::fs::write(&notes, "a week of work").expect("written");
        assert!(pack(&notes, &entries, Compression::Deflate).expect_err("kept").contains("would be lost"));
        assert!(
            pack(&folder.path().join("none/a.fmu"), &entries, Compression::Deflate)
                .expect_err("no folder")
                .contains("there is no folder")
        );
        let file = folder.path().join("unit.fmu");
        for _ in 0..2 {
            pack(&file, &entries, Compression::Deflate).expect("new, and in the place of a file");
        }
    }
}
