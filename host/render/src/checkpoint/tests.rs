use super::*;
use crate::film::FilmError;
use crate::render::Fingerprint;
use glam::Vec3;
use std::fs;
use trisect_shared::film::PixelSums;

fn sums(value: f32, samples: u32) -> PixelSums {
    let radiance = Vec3::splat(value * samples as f32);
    PixelSums { radiance, samples, squares: radiance * value, segments: 2 * samples }
}

fn part(rows: Range<u32>, samples: Range<u32>) -> SampleBlock {
    SampleBlock { rows, samples }
}

/// Returns a film of 3x4 pixels with some parts.
fn film(parts: &[SampleBlock]) -> Film {
    let mut film = Film::new(3, 4);
    for part in parts {
        let chunk: Vec<PixelSums> =
            (0..3 * part.rows.len()).map(|i| sums(0.1 * i as f32, part.samples.len() as u32)).collect();
        film.merge(part, &chunk).unwrap();
    }
    film
}

fn checkpoint(parts: &[SampleBlock]) -> Checkpoint {
    let settings = [("seed", 5.into()), ("clamp", serde_json::Value::Null), ("spp", 1024.into())];
    let fingerprint = Fingerprint {
        version: "0.1.0".to_owned(),
        scene: "5ce3e".to_owned(),
        kernels: "cafe".to_owned(),
        settings: settings.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
    };
    let (prepared, arithmetic) = ("00000000".to_owned(), "precise".to_owned());
    let identity = Identity { fingerprint, prepared, arithmetic };
    let header = Header {
        format: FORMAT,
        identity,
        scene: "a scene".to_owned(),
        command: vec!["render".to_owned(), "scene.ron".to_owned()],
        folder: "/tmp".into(),
        spp: 1024,
        samples: 0..1024,
        seconds: 1.5,
        camera: None,
    };
    Checkpoint { header, film: film(parts) }
}

fn set(header: &mut Header, name: &str, value: u32) {
    header.identity.fingerprint.settings.insert(name.to_owned(), value.into());
}

fn path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("trisect-checkpoint-{}-{name}", std::process::id()))
}

#[test]
fn what_was_written_comes_back() {
    let path = path("back");
    for parts in [vec![], vec![part(0..4, 0..256)], vec![part(1..3, 256..512), part(0..2, 0..256)]] {
        let one = checkpoint(&parts);
        one.write(&path).unwrap();
        let other = Checkpoint::read(&path).unwrap();
        // Compared as bits, because a pixel without samples is NaN.
        let bits = |film: &Film| cast_slice::<_, u8>(&film.pixels.exact()).to_vec();
        assert_eq!((&other.header, &other.film.coverage), (&one.header, &one.film.coverage));
        assert_eq!(bits(&other.film), bits(&one.film));
    }
    fs::remove_file(path).unwrap();
}

/// A file that is cut off anywhere, or with a flipped bit, is not read.
#[test]
fn damage_shows() {
    let path = path("damage");
    checkpoint(&[part(0..4, 0..256)]).write(&path).unwrap();
    let whole = fs::read(&path).unwrap();
    for at in 0..whole.len() {
        fs::write(&path, &whole[..at]).unwrap();
        assert!(
            matches!(Checkpoint::read(&path), Err(CheckpointError::NotACheckpoint { .. })),
            "cut at {at}"
        );
        let mut flipped = whole.clone();
        flipped[at] ^= 4;
        fs::write(&path, &flipped).unwrap();
        assert!(
            matches!(Checkpoint::read(&path), Err(CheckpointError::NotACheckpoint { .. })),
            "bit of byte {at}"
        );
    }
    fs::remove_file(path).unwrap();
}

/// Undamaged files with impossible contents are refused.
#[test]
fn what_cannot_be_is_refused() {
    let path = path("cannot");
    let good = checkpoint(&[part(0..4, 0..256)]);
    good.write(&path).unwrap();
    let Contents { header, data } = checksummed_file::read(&path, MAGIC).unwrap();
    let header = String::from_utf8(header).unwrap();
    let read = |header: &str, data: &[u8]| {
        checksummed_file::write(&path, MAGIC, header.as_bytes(), &[data]).unwrap();
        Checkpoint::read(&path).map_err(|error| error.to_string())
    };
    assert!(read(&header, &data).is_ok());
    for (from, to) in [
        ("\"width\":3", "\"width\":4"),
        ("\"height\":4", "\"height\":4294967295"),
        ("\"guides\":false", "\"guides\":true"),
        ("\"end\":4}", "\"end\":5}"),
        ("\"end\":256}", "\"end\":512}"),
        ("\"start\":0,\"end\":256", "\"start\":9,\"end\":256"),
        ("\"seconds\"", "\"hours\""),
        ("\"end\":256}", "\"end\":100}"),
        ("\"spp\":1024", "\"spp\":2048"),
        ("{", ""),
    ] {
        assert!(header.contains(from), "{from} in {header}");
        let found = read(&header.replacen(from, to, 1), &data);
        assert!(found.as_ref().is_err_and(|error| error.contains("not a checkpoint")), "{from}: {found:?}");
    }
    let other = read(&header.replacen("\"format\":1", "\"format\":2", 1), &data);
    assert!(other.as_ref().is_err_and(|error| error.contains("format 2")), "{other:?}");
    let mut counts = data.clone();
    counts[96] ^= 1;
    assert!(read(&header, &counts).is_err_and(|error| error.contains("row 0")));
    fs::remove_file(path).unwrap();
}

#[test]
fn parts_that_belong_together() {
    let of = Path::new("other");
    let mut one = checkpoint(&[part(0..4, 0..512)]);
    one.header.samples = 0..512;
    let mut other = checkpoint(&[part(0..4, 512..1024)]);
    other.header.samples = 512..1024;
    one.merge(of, &other).unwrap();
    assert_eq!((one.header.samples.clone(), one.header.seconds), (0..1024, 3.0));
    assert_eq!(one.film.coverage.missing(&(0..1024)), []);
    // Several arithmetics are all kept, in any order.
    for (a, b) in [("precise", "precise and fast"), ("fast and precise", "precise")] {
        let mut both = checkpoint(&[part(0..4, 0..512)]);
        let mut rest = checkpoint(&[part(0..4, 512..1024)]);
        (both.header.identity.arithmetic, rest.header.identity.arithmetic) = (a.to_owned(), b.to_owned());
        both.merge(of, &rest).unwrap();
        let all = both.header.identity.arithmetic;
        assert!(all.contains("fast") && all.matches("precise").count() == 1, "{all}");
    }
    // A second merge would add the samples twice.
    let before = one.clone();
    let twice = one.merge(of, &other);
    assert!(matches!(twice, Err(CheckpointError::Film { source: FilmError::Overlap { .. }, .. })));
    assert_eq!(one, before);
    for (field, change) in [
        ("scene", (|it: &mut Header| it.identity.fingerprint.scene.push('f')) as fn(&mut Header)),
        ("version", |it| it.identity.fingerprint.version.push('f')),
        ("prepared", |it| it.identity.prepared.push('f')),
        ("kernels", |it| it.identity.fingerprint.kernels.push('f')),
        ("arithmetic", |it| it.identity.arithmetic.push('f')),
        ("seed", |it| set(it, "seed", 6)),
        ("clamp", |it| set(it, "clamp", 1)),
        ("depth", |it| set(it, "depth", 1)),
        ("spp", |it| set(it, "spp", 2048)),
    ] {
        let mut stranger = checkpoint(&[]);
        change(&mut stranger.header);
        let found = one.merge(of, &stranger).unwrap_err().to_string();
        assert!(found.starts_with(&format!("other: {field} is ")), "{found}");
        assert_eq!(one, before);
    }
}

/// A saver writes when a checkpoint is due, and at the end.
#[test]
fn a_saver_writes() {
    let path = path("saver");
    let _ = fs::remove_file(&path);
    let header = checkpoint(&[]).header;
    let film = film(&[part(0..4, 0..256)]);
    let saver = Saver::new(&path, header.clone(), SaveInterval::Samples(512));
    saver.save_if_due(&film);
    drop(saver);
    assert!(!path.exists(), "256 samples are not due");
    let saver = Saver::new(&path, header.clone(), SaveInterval::Samples(256));
    saver.save_if_due(&film);
    drop(saver); // waits for the thread
    assert_eq!(Checkpoint::read(&path).unwrap().film, film);
    let more = self::film(&[part(0..4, 0..256), part(0..4, 256..512)]);
    // After a resume the interval counts from the samples that the file has.
    let every = SaveInterval::Samples(256);
    for (resumed, is_written) in [(&more, false), (&film, true)] {
        fs::remove_file(&path).unwrap();
        write(&path, &header, resumed).unwrap();
        let saver = Saver::resume(Place::of(&path), header.clone(), every, resumed);
        saver.save_if_due(&more);
        drop(saver);
        assert_eq!(Checkpoint::read(&path).unwrap().header.seconds > header.seconds, is_written);
    }
    let saver = Saver::resume(Place::of(&path), header.clone(), SaveInterval::default(), &more);
    saver.save_if_due(&more);
    saver.finish(&more).unwrap();
    let found = Checkpoint::read(&path).unwrap();
    assert_eq!(found.film, more);
    assert!(found.header.seconds > header.seconds);
    fs::remove_file(path).unwrap();
}

/// The first of two renders with one checkpoint that writes owns the file; the other one does not
/// overwrite it.
#[test]
fn two_savers_replace_none_of_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ckpt");
    let header = checkpoint(&[]).header;
    let films = [film(&[part(0..4, 0..256)]), film(&[part(0..4, 256..512)]), film(&[part(0..4, 512..768)])];
    let is_taken = |written: Result<(), CheckpointError>| {
        let error = written.unwrap_err();
        assert!(matches!(&error, CheckpointError::Taken { path: named } if *named == path), "{error}");
        error.to_string()
    };
    let has = |film: &Film| Checkpoint::read(&path).unwrap().film == *film;
    let new = || Saver::new(&path, header.clone(), SaveInterval::Samples(1));
    let (one, other) = (new(), new());
    one.finish(&films[0]).unwrap();
    let message = is_taken(other.finish(&films[1]));
    assert!(message.contains("a.ckpt") && message.contains("`checkpoint`"), "{message}");
    // The thread that writes during the render does not overwrite it either.
    other.save_if_due(&films[1]);
    let failure = (0..1000).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(10));
        other.failure()
    });
    is_taken(failure.map_or(Ok(()), Err));
    assert!(has(&films[0]));
    // A saver replaces its own file, and creates one that was removed.
    one.finish(&films[1]).unwrap();
    fs::remove_file(&path).unwrap();
    one.finish(&films[0]).unwrap();
    // Two renders that resume the same file.
    let resume = || Saver::resume(Place::of(&path), header.clone(), SaveInterval::default(), &films[0]);
    let (one, other) = (resume(), resume());
    one.finish(&films[1]).unwrap();
    one.finish(&films[2]).unwrap();
    is_taken(other.finish(&films[1]));
    assert!(has(&films[2]));
    // Negative control: a write without a claim replaces the file.
    write(&path, &header, &films[0]).unwrap();
    assert!(has(&films[0]));
    is_taken(one.finish(&films[2]));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A failed write is reported, and the render continues.
#[test]
fn a_saver_fails_aloud() {
    let path = path("nowhere").join("file");
    let film = film(&[part(0..4, 0..256)]);
    let saver = Saver::new(&path, checkpoint(&[]).header, SaveInterval::Samples(1));
    saver.save_if_due(&film);
    let error = saver.finish(&film).unwrap_err();
    assert!(matches!(&error, CheckpointError::Io { path: named, .. } if *named == path), "{error}");
    // Once the folder exists, the next checkpoint is written.
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    saver.finish(&film).unwrap();
    assert_eq!(Checkpoint::read(&path).unwrap().film, film);
    fs::remove_dir_all(path.parent().unwrap()).unwrap();
}
