#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;
use tempfile::TempDir;

/// Returns the error of EACCES (13), EROFS (30) or ENOSPC (28).
fn libc_error(number: i32) -> ErrorKind {
    io::Error::from_raw_os_error(number).kind()
}

fn new_folder() -> TempDir {
    tempfile::Builder::new().prefix("trisect-replace-").tempdir().unwrap()
}

fn names(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

/// The earlier file stays whole until the new one is complete, and nothing else is left.
#[test]
fn whole_or_not_at_all() {
    let folder = new_folder();
    let path = folder.path().join("a.png");
    write_atomic_or_in_place(&path, b"first").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    let failed = write_atomic(&path, |file| {
        file.write_all(b"sec")?;
        assert_eq!(fs::read(&path)?, b"first");
        Err(io::Error::other("the disk is full"))
    });
    assert!(failed.is_err());
    assert_eq!(fs::read(&path).unwrap(), b"first");
    write_atomic_or_in_place(&path, b"second").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"second");
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    assert_eq!(names(&folder), ["a.png"]);
    // Negative control: written in place, half of the content would be there.
    fs::write(&path, b"sec").unwrap();
    assert_ne!(fs::read(&path).unwrap(), b"second");
}

#[test]
fn what_cannot_be_replaced_is_written_to() {
    let folder = new_folder();
    let (path, link) = (folder.path().join("a.png"), folder.path().join("link.png"));
    fs::write(&path, b"first").unwrap();
    symlink(&path, &link).unwrap();
    write_atomic_or_in_place(&link, b"second").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read(&path).unwrap(), b"second");
    // A link to a link to a file that does not exist yet.
    fs::remove_file(&path).unwrap();
    let far = folder.path().join("far.png");
    symlink("link.png", &far).unwrap();
    write_atomic_or_in_place(&far, b"again").unwrap();
    assert!([&link, &far].iter().all(|link| fs::symlink_metadata(link).unwrap().is_symlink()));
    assert_eq!(fs::read(&path).unwrap(), b"again");
    // A file with two names stays one file.
    let other = folder.path().join("other.png");
    fs::hard_link(&path, &other).unwrap();
    write_atomic_or_in_place(&path, b"both").unwrap();
    assert_eq!(fs::read(&other).unwrap(), b"both");
    // A name of the maximum length.
    let long = folder.path().join("a".repeat(251) + ".png");
    write_atomic_or_in_place(&long, b"long").unwrap();
    write_atomic_or_in_place(&long, b"longer").unwrap();
    assert_eq!(fs::read(&long).unwrap(), b"longer");
    assert_eq!(names(&folder).len(), 5);
    for (error, in_place) in [(libc_error(13), true), (libc_error(30), true), (libc_error(28), false)] {
        assert_eq!(is_for_want_of_a_new_file(error), in_place, "{error}");
    }
    write_atomic_or_in_place(Path::new("/dev/null"), b"third").unwrap();
    assert!(write_atomic(Path::new("/dev/null"), |_| Ok(())).is_err());
    assert!(write_atomic_or_in_place(&folder.path().join("none/a.png"), b"").is_err());
}

/// Writers with the same process id, as in two containers, have their own temporary files.
#[test]
fn two_writers_share_nothing() {
    let folder = new_folder();
    let path = folder.path().join("a.png");
    write_atomic(&path, |first| {
        first.write_all(b"fir")?;
        write_atomic(&path, |second| second.write_all(b"second"))?;
        assert_eq!(fs::read(&path)?, b"second");
        first.write_all(b"st")
    })
    .unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"first");
    assert_eq!(names(&folder), ["a.png"]);
}

/// A file or link at a guessable name of a temporary file is left alone.
#[test]
fn planted_names_are_not_followed() {
    let folder = new_folder();
    let (path, other) = (folder.path().join("a.png"), folder.path().join("other"));
    fs::write(&other, b"other").unwrap();
    let planted = folder.path().join(format!(".a.png.{}.part", std::process::id()));
    symlink(&other, &planted).unwrap();
    write_atomic_or_in_place(&path, b"first").unwrap();
    probe_atomic(&path).unwrap();
    assert_eq!((fs::read(&path).unwrap(), fs::read(&other).unwrap()), (b"first".into(), b"other".into()));
    assert!(fs::symlink_metadata(&path).unwrap().is_file());
    assert!(fs::symlink_metadata(&planted).unwrap().is_symlink());
}

/// Temporary files that were left behind are removed once they are old, and nothing else is.
#[test]
fn leftovers_are_swept() {
    let folder = new_folder();
    let path = folder.path().join("a.png");
    let old = SystemTime::now() - 2 * MAX_AGE;
    let names = [".a.png.0123456789abcdef.part", ".a.png.bak.part", ".a.png.fedcba9876543210.part"];
    let left = names.map(|name| folder.path().join(name));
    left.iter().for_each(|left| fs::write(left, b"").unwrap());
    left[..2].iter().for_each(|left| {
        OpenOptions::new().write(true).open(left).unwrap().set_modified(old).unwrap();
    });
    write_atomic_or_in_place(&path, b"first").unwrap();
    assert_eq!(left.map(|left| left.exists()), [false, true, true]);
}

/// A probe creates no visible file, and removes none that another process wrote meanwhile.
#[test]
fn probes_leave_no_trace() {
    let folder = new_folder();
    let path = folder.path().join("a.ckpt");
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while !ended.load(Ordering::Relaxed) {
                    probe(&path).unwrap();
                    probe_atomic(&path).unwrap();
                }
            });
        }
        let seen: Vec<bool> = (0..2000).map(|_| path.exists()).collect();
        let kept = (0..200).map(|_| {
            write_atomic_or_in_place(&path, b"whole").unwrap();
            let reads: Vec<_> = (0..20).map(|_| fs::read(&path).ok()).collect();
            fs::remove_file(&path).is_ok() && reads.iter().all(|read| read.as_deref() == Some(b"whole"))
        });
        let kept: Vec<bool> = kept.collect();
        ended.store(true, Ordering::Relaxed);
        assert!(!seen.contains(&true), "an empty file was there");
        assert!(!kept.contains(&false), "a file was removed, or empty");
    });
    assert!(names(&folder).is_empty());
}

#[test]
fn probes_say_what_would_fail() {
    let folder = new_folder();
    let there = folder.path().join("a.png");
    fs::write(&there, b"first").unwrap();
    probe(&there).unwrap();
    assert_eq!(fs::read(&there).unwrap(), b"first");
    probe(Path::new("/dev/null")).unwrap();
    assert!(probe_atomic(Path::new("/dev/null")).is_err());
    for bad in [folder.path().to_owned(), folder.path().join("none/a.png"), there.join("a.png")] {
        assert!(probe(&bad).is_err(), "{}", bad.display());
    }
    assert!(probe(&folder.path().join("a".repeat(256))).is_err());
    let to_nowhere = folder.path().join("link");
    symlink("none/a.png", &to_nowhere).unwrap();
    assert!(probe(&to_nowhere).is_err());
}

#[test]
fn one_file_of_many_names() {
    let folder = new_folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("a"), b"").unwrap();
    fs::hard_link(at("a"), at("b")).unwrap();
    symlink("a", at("c")).unwrap();
    symlink("new", at("d")).unwrap();
    fs::create_dir(at("sub")).unwrap();
    for (one, other) in
        [("a", "./a"), ("a", "sub/../a"), ("a", "b"), ("c", "b"), ("d", "new"), ("x", "sub/../x")]
    {
        assert!(is_same(&at(one), &at(other)), "{one} {other}");
    }
    for (one, other) in [("a", "x"), ("x", "sub/x"), ("d", "a")] {
        assert!(!is_same(&at(one), &at(other)), "{one} {other}");
    }
}

/// Returns whether a claim refuses to replace an existing file, which stays unchanged.
fn is_refused(claim: &mut Claim, path: &Path) -> bool {
    let before = fs::read(path).unwrap();
    let written = claim.replace(path, |file| file.write_all(b"not this"));
    written.is_err_and(|error| error.kind() == ErrorKind::AlreadyExists) && fs::read(path).unwrap() == before
}

#[test]
fn a_claim_is_to_ones_own_file() {
    let folder = new_folder();
    let path = folder.path().join("a.ckpt");
    let mut claim = Claim::default();
    // A file that appears while the first one is written.
    let written = claim.replace(&path, |file| {
        write_atomic_or_in_place(&path, b"other")?;
        file.write_all(b"own")
    });
    assert_eq!(written.unwrap_err().kind(), ErrorKind::AlreadyExists);
    assert_eq!(fs::read(&path).unwrap(), b"other");
    assert!(is_refused(&mut claim, &path));
    fs::remove_file(&path).unwrap();
    for bytes in [b"own", b"new"] {
        claim.replace(&path, |file| file.write_all(bytes)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), bytes);
    }
    // A failed write does not lose the claim.
    assert!(claim.replace(&path, |_| Err(io::Error::other("the disk is full"))).is_err());
    claim.replace(&path, |file| file.write_all(b"own")).unwrap();
    // Other files, some of which would get its inode number if it were not kept open.
    for _ in 0..8 {
        write_atomic_or_in_place(&path, b"other").unwrap();
        assert!(is_refused(&mut claim, &path));
    }
    let mut second = Claim::of(&path);
    second.replace(&path, |file| file.write_all(b"second")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"second");
    assert_eq!(names(&folder), ["a.ckpt"]);
}

/// A pipe without a reader is refused at once, by a probe and by a writer.
#[test]
fn pipes_do_not_hang() {
    let folder = new_folder();
    let (pipe, link) = (folder.path().join("a.png"), folder.path().join("link.png"));
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    symlink(&pipe, &link).unwrap();
    for path in [&pipe, &link] {
        let error = probe(path).unwrap_err();
        assert!(error.to_string().contains("a pipe") && error.to_string().contains("/dev/null"), "{error}");
        assert!(probe_atomic(path).is_err());
        let error = write_atomic_or_in_place(path, b"first").unwrap_err();
        assert!(error.to_string().contains("no one reads"), "{error}");
    }
    // More than a pipe holds, to a slow reader.
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || {
            let mut file = File::open(pipe).unwrap();
            std::thread::sleep(Duration::from_millis(100));
            let mut bytes = Vec::new();
            io::Read::read_to_end(&mut file, &mut bytes).unwrap();
            bytes
        }
    });
    let bytes = vec![7; 1 << 20];
    while write_atomic_or_in_place(&pipe, &bytes).is_err() {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(reader.join().unwrap(), bytes);
    let socket = folder.path().join("socket");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    assert!(probe(&socket).unwrap_err().to_string().contains("a socket"));
    // A pipe that is already open.
    let (_reader, writer) = io::pipe().unwrap();
    let open = PathBuf::from(format!("/dev/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&writer)));
    let open_link = folder.path().join("open");
    symlink(&open, &open_link).unwrap();
    for path in [&open, &open_link] {
        probe(path).unwrap();
        write_atomic_or_in_place(path, b"few").unwrap();
    }
}
