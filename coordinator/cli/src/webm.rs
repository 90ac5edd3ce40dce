//! WebM: a file of pictures that a browser has encoded, with the places of those that need none before them, so that players can go
//! to any time. After the Matroska specification (RFC 9559) and its subset WebM.

use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use terraglue_diagnostics::Result;
use terraglue_recording::at;

/// Unit of all times, ns.
const UNIT_NS: u64 = 1_000_000;
/// Room for the list of what is where in the file, bytes.
const INDEX_ROOM: usize = 192;

const EBML: &[u8] = &[0x1a, 0x45, 0xdf, 0xa3];
const SEGMENT: &[u8] = &[0x18, 0x53, 0x80, 0x67];
const SEEK_HEAD: &[u8] = &[0x11, 0x4d, 0x9b, 0x74];
const VOID: &[u8] = &[0xec];
const INFO: &[u8] = &[0x15, 0x49, 0xa9, 0x66];
const TRACKS: &[u8] = &[0x16, 0x54, 0xae, 0x6b];
const CLUSTER: &[u8] = &[0x1f, 0x43, 0xb6, 0x75];
const CUES: &[u8] = &[0x1c, 0x53, 0xbb, 0x6b];

/// An element: its number, its size in eight bytes, what is in it.
fn element(id: &[u8], body: &[u8]) -> Vec<u8> {
    [id, &sized(body.len()), body].concat()
}

fn sized(bytes: usize) -> [u8; 8] {
    (bytes as u64 | 1 << 56).to_be_bytes()
}

fn whole(id: &[u8], value: u64) -> Vec<u8> {
    let first = (value.leading_zeros() as usize / 8).min(7);
    element(id, &value.to_be_bytes()[first..])
}

fn text(id: &[u8], value: &str) -> Vec<u8> {
    element(id, value.as_bytes())
}

/// Properties of a video.
pub struct Video<'a> {
    /// Name of the encoding, as WebM has it.
    pub codec: &'a str,
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Pictures per second.
    pub fps: u32,
    /// How many pictures there will be.
    pub count: u64,
}

impl Video<'_> {
    fn head(&self) -> Vec<u8> {
        let kind = [
            whole(&[0x42, 0x86], 1),
            whole(&[0x42, 0xf7], 1),
            whole(&[0x42, 0xf2], 4),
            whole(&[0x42, 0xf3], 8),
            text(&[0x42, 0x82], "webm"),
            whole(&[0x42, 0x87], 4),
            whole(&[0x42, 0x85], 2),
        ];
        element(EBML, &kind.concat())
    }

    fn info(&self) -> Vec<u8> {
        let units = self.count as f64 / f64::from(self.fps) * 1e9 / UNIT_NS as f64;
        let body = [
            whole(&[0x2a, 0xd7, 0xb1], UNIT_NS),
            element(&[0x44, 0x89], &units.to_be_bytes()),
            text(&[0x4d, 0x80], "Terraglue"),
            text(&[0x57, 0x41], "Terraglue"),
        ];
        element(INFO, &body.concat())
    }

    fn tracks(&self) -> Vec<u8> {
        let (width, height) = self.size;
        let picture = [whole(&[0xb0], width.into()), whole(&[0xba], height.into())];
        let track = [
            whole(&[0xd7], 1),
            whole(&[0x73, 0xc5], 1),
            whole(&[0x83], 1),
            whole(&[0x9c], 0),
            text(&[0x86], self.codec),
            whole(&[0x23, 0xe3, 0x83], 1_000_000_000 / u64::from(self.fps)),
            element(&[0xe0], &picture.concat()),
        ];
        element(TRACKS, &element(&[0xae], &track.concat()))
    }
}

/// A file that is written.
pub struct WebmFile<F> {
    file: F,
    path: PathBuf,
    /// First byte of the segment, from which places count.
    begin: u64,
    /// Places of information and tracks.
    places: [u64; 2],
    /// Time and place of each cluster.
    clusters: Vec<(u64, u64)>,
    open: Vec<u8>,
}

impl<F: Write + Seek> WebmFile<F> {
    /// Writes the header before the pictures.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn begin(mut file: F, path: &Path, video: &Video) -> Result<Self> {
        let mut head = video.head();
        head.extend([SEGMENT, &sized(0)].concat());
        let begin = head.len() as u64;
        head.extend(void(INDEX_ROOM));
        let info = head.len() as u64 - begin;
        head.extend(video.info());
        let tracks = head.len() as u64 - begin;
        head.extend(video.tracks());
        file.write_all(&head).map_err(at(path))?;
        let path = path.to_owned();
        Ok(Self { file, path, begin, places: [info, tracks], clusters: Vec::new(), open: Vec::new() })
    }

    /// Appends a picture; one that needs none before it begins a cluster.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn picture(&mut self, time_us: u64, is_whole: bool, data: &[u8]) -> Result {
        let time = time_us * 1000 / UNIT_NS;
        let start = self.clusters.last().map(|(start, _)| *start);
        // times within a cluster have 16 bits
        let is_far = start.is_none_or(|start| time - start > 30_000);
        if is_whole || is_far {
            self.close_cluster()?;
            let place = self.file.stream_position().map_err(at(&self.path))? - self.begin;
            self.clusters.push((time, place));
            self.open = whole(&[0xe7], time);
        }
        let start = self.clusters.last().map_or(time, |(start, _)| *start);
        let flags = if is_whole { 0x80 } else { 0 };
        let apart = ((time - start) as i16).to_be_bytes();
        let body = [&[0x81][..], &apart, &[flags], data].concat();
        self.open.extend(element(&[0xa3], &body));
        Ok(())
    }

    fn close_cluster(&mut self) -> Result {
        if self.open.is_empty() {
            return Ok(());
        }
        let cluster = element(CLUSTER, &self.open);
        self.open.clear();
        self.file.write_all(&cluster).map_err(at(&self.path))
    }

    /// Ends the file: its index, and what could not be known at its beginning.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn end(mut self) -> Result<F> {
        self.close_cluster()?;
        let failed = at(&self.path);
        let cue = |(time, place): &(u64, u64)| {
            let position = [whole(&[0xf7], 1), whole(&[0xf1], *place)].concat();
            element(&[0xbb], &[whole(&[0xb3], *time), element(&[0xb7], &position)].concat())
        };
        let cues = self.file.stream_position().map_err(&failed)? - self.begin;
        let body: Vec<u8> = self.clusters.iter().flat_map(cue).collect();
        self.file.write_all(&element(CUES, &body)).map_err(&failed)?;
        let end = self.file.stream_position().map_err(&failed)?;
        let [info, tracks] = self.places;
        let seek = |(id, place): (&[u8], u64)| {
            element(&[0x4d, 0xbb], &[element(&[0x53, 0xab], id), whole(&[0x53, 0xac], place)].concat())
        };
        let all: Vec<u8> =
            [(INFO, info), (TRACKS, tracks), (CUES, cues)].into_iter().flat_map(seek).collect();
        let mut index = element(SEEK_HEAD, &all);
        index.extend(void(INDEX_ROOM.saturating_sub(index.len())));
        self.file.seek(SeekFrom::Start(self.begin)).map_err(&failed)?;
        self.file.write_all(&index).map_err(&failed)?;
        self.file.seek(SeekFrom::Start(self.begin - 8)).map_err(&failed)?;
        self.file.write_all(&sized((end - self.begin) as usize)).map_err(&failed)?;
        self.file.flush().map_err(&failed)?;
        drop(failed);
        Ok(self.file)
    }
}

/// An element of so many bytes that means nothing.
fn void(bytes: usize) -> Vec<u8> {
    let body = vec![0; bytes.saturating_sub(VOID.len() + 8)];
    element(VOID, &body)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// Elements one after another: number, place, body.
    fn elements(bytes: &[u8]) -> Vec<(Vec<u8>, usize, &[u8])> {
        let (mut all, mut k) = (Vec::new(), 0);
        while k < bytes.len() {
            let id = bytes[k].leading_zeros() as usize + 1;
            let size = u64::from_be_bytes(bytes[k + id..k + id + 8].try_into().expect("eight")) & !(1 << 56);
            let from = k + id + 8;
            all.push((bytes[k..k + id].to_vec(), k, &bytes[from..from + size as usize]));
            k = from + size as usize;
        }
        all
    }

    #[test]
    fn the_index_names_the_places_of_all_parts() -> Result {
        let video = Video { codec: "V_VP8", size: (64, 48), fps: 25, count: 100 };
        let mut file = WebmFile::begin(Cursor::new(Vec::new()), Path::new("x.webm"), &video)?;
        for k in 0..100_u64 {
            file.picture(k * 40_000, k.is_multiple_of(50), &[k as u8; 7])?;
        }
        let bytes = file.end()?.into_inner();
        let outer = elements(&bytes);
        assert_eq!(outer.iter().map(|(id, ..)| &id[..]).collect::<Vec<_>>(), [EBML, SEGMENT]);
        let inner = elements(outer[1].2);
        let order: Vec<&[u8]> = inner.iter().map(|(id, ..)| &id[..]).collect();
        assert_eq!(order, [SEEK_HEAD, VOID, INFO, TRACKS, CLUSTER, CLUSTER, CUES]);
        let place = |id: &[u8]| inner.iter().find(|(own, ..)| own == id).map(|(_, place, _)| *place as u64);
        let number = |bytes: &[u8]| bytes.iter().fold(0, |sum, b| sum << 8 | u64::from(*b));
        for (_, _, seek) in elements(inner[0].2) {
            let parts = elements(seek);
            assert_eq!(place(parts[0].2), Some(number(parts[1].2)));
        }
        let clusters: Vec<u64> =
            inner.iter().filter(|(id, ..)| id == CLUSTER).map(|(_, place, _)| *place as u64).collect();
        let cued: Vec<u64> = elements(inner[6].2)
            .iter()
            .map(|(_, _, cue)| number(elements(elements(cue)[1].2)[1].2))
            .collect();
        assert_eq!(cued, clusters);
        let first = elements(inner[4].2);
        assert_eq!(first.len(), 51, "a time and fifty pictures");
        assert_eq!(first[2].2, [0x81, 0, 40, 0, 1, 1, 1, 1, 1, 1, 1]);
        Ok(())
    }
}
