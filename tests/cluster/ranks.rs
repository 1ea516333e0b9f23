//! The program over MPI ranks: processes of mpirun on this machine, and on simulated hosts in
//! network namespaces.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::process::Output;
use std::time::Duration;
use trisect_tests::hosts::Hosts;
use trisect_tests::mpi::{self, Job};
use trisect_tests::program::{self, Temporary};

/// Returns the path of a scene of the project.
fn scene(name: &str) -> String {
    trisect_tests::root().join("scenes").join(name).to_str().unwrap().to_owned()
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn check(output: &Output) {
    assert!(output.status.success(), "{}", text(output));
}

/// Returns the arguments of a small render.
fn small<'a>(scene: &'a str, output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["render", scene, "--backend", "cpu", "--threads", "1", "-q", "-o", output];
    if !more.contains(&"--resolution") {
        all.extend(["--resolution", "60x33"]);
    }
    all.extend(more);
    all
}

/// Renders by one process, then over ranks with the arguments `distribute`, and compares the files'
/// bytes.
fn same(folder: &Temporary, scene: &str, name: &str, common: &[&str], ranks: &[u32], distribute: &[&str]) {
    let (one, many) = (folder.file(&format!("one-{name}")), folder.file(&format!("many-{name}")));
    check(&program::trisect(&small(scene, &one, common)));
    for &count in ranks {
        let mut more = common.to_vec();
        more.extend(distribute);
        check(&mpi::run(count, &small(scene, &many, &more)));
        assert!(fs::read(&one).unwrap() == fs::read(&many).unwrap(), "{count} ranks, {name}, {distribute:?}");
        fs::remove_file(&many).unwrap();
    }
}

#[test]
fn rows_are_the_image_of_one_process() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "rows"), scene("rtiow_final.ron"));
    let rows = ["--distribute", "rows"];
    same(&folder, &scene, "a.png", &["--spp", "5"], &[1, 2, 3, 7], &rows);
    same(&folder, &scene, "a.pfm", &["--spp", "5"], &[2], &["--distribute", "rows", "--block", "1"]);
    same(&folder, &scene, "b.png", &["--spp", "5"], &[3], &["--distribute", "rows", "--balance", "dynamic"]);
    // More ranks than rows.
    same(
        &folder,
        &scene,
        "c.png",
        &["--spp", "2", "--resolution", "9x2"],
        &[4],
        &["--distribute", "rows", "--block", "1"],
    );
    // All layers of a film, and a filter over it.
    let layers = ["--spp", "3", "--aov", "normal,position,albedo,depth,id,variance,samples"];
    same(&folder, &scene, "a.exr", &layers, &[3], &rows);
    same(&folder, &scene, "d.png", &["--spp", "2", "--denoise", "svgf"], &[2], &rows);
    // Negative control: another seed gives another image.
    let (one, other) = (folder.file("one-a.png"), folder.file("other.png"));
    check(&mpi::run(2, &small(&scene, &other, &["--spp", "5", "--seed", "1", "--distribute", "rows"])));
    assert!(fs::read(one).unwrap() != fs::read(other).unwrap(), "negative control not detected");
}

#[test]
fn averages_are_the_image_of_one_process() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "average"), scene("three_spheres.ron"));
    // Each rank has whole chunks.
    let average = ["--distribute", "average"];
    same(&folder, &scene, "a.pfm", &["--spp", "3072", "--resolution", "16x9"], &[1, 2, 3, 4], &average);
    // Fewer samples than ranks, or a number that the ranks do not divide: each rank's sum may be
    // off by half a unit in the last place.
    let (one, many) = (folder.file("one.pfm"), folder.file("many.pfm"));
    for (samples, ranks) in [("2", 3), ("7", 3)] {
        check(&program::trisect(&small(&scene, &one, &["--spp", samples])));
        check(&mpi::run(ranks, &small(&scene, &many, &["--spp", samples, "--distribute", "average"])));
        let compared = program::trisect(&["compare", &many, &one, "--max-rel-mse", "1e-13"]);
        assert!(compared.status.success(), "{}", String::from_utf8_lossy(&compared.stdout));
    }
    let auto = mpi::run(2, &small(&scene, &many, &["--spp", "7", "--distribute", "auto"]));
    check(&auto);
    check(&program::trisect(&["compare", &many, &one, "--max-rel-mse", "1e-13"]));
}

/// Ranks with other backends and numbers of threads render the same image; lavapipe has the CPU's
/// bits.
#[test]
fn ranks_may_differ_in_their_devices() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "mixed"), scene("three_spheres.ron"));
    let (one, many) = (folder.file("one.png"), folder.file("many.png"));
    check(&program::trisect(&small(&scene, &one, &["--spp", "4"])));
    let of = |backend: &'static str, more: [&'static str; 2]| {
        let all = [
            "render",
            &scene,
            "--backend",
            backend,
            more[0],
            more[1],
            "--resolution",
            "60x33",
            "--spp",
            "4",
            "-o",
            &many,
        ];
        [&all[..], &["--distribute", "rows", "-q"]]
            .concat()
            .into_iter()
            .map(str::to_owned)
            .collect::<Vec<String>>()
    };
    let listed = String::from_utf8_lossy(&program::trisect(&["info"]).stdout).into_owned();
    let second = match listed.contains("llvmpipe") {
        true => of("wgpu", ["--device", "0"]),
        false => of("cpu", ["--threads", "3"]),
    };
    let first = of("cpu", ["--threads", "2"]);
    let [first, second] = [&first, &second].map(|all| all.iter().map(String::as_str).collect::<Vec<_>>());
    check(&mpi::run_each(&[(1, &first), (1, &second)]));
    assert!(fs::read(&one).unwrap() == fs::read(&many).unwrap());
}

/// Checks that the program ended with `code`, each of `words`, a single error message and no panic.
fn refused(output: &Output, code: i32, words: &[&str]) {
    let text = text(output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    words.iter().for_each(|word| assert!(text.contains(word), "no {word:?} in {text}"));
    assert_eq!(text.matches("error: ").count(), 1, "said more than once: {text}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    if !mpi::available() {
        return;
    }
    let (folder, own) = (Temporary::new("cluster", "refused"), scene("three_spheres.ron"));
    let (image, other) = (folder.file("a.png"), scene("rtiow_final.ron"));
    let rows = ["--distribute", "rows", "--spp", "2"];
    let with = |more: &[&'static str]| {
        small(&own, &image, &[&rows[..], more].concat()).into_iter().map(str::to_owned).collect()
    };
    let usual: Vec<String> = with(&[]);
    let pair = |second: Vec<String>| {
        let [first, second] = [&usual, &second].map(|all| all.iter().map(String::as_str).collect::<Vec<_>>());
        mpi::run_each(&[(1, &first), (1, &second)])
    };
    refused(
        &pair(with(&["--seed", "7"])),
        2,
        &["rank 1 on ", "the seed is 7, rank 0 has 0", "start all ranks with the same"],
    );
    refused(&pair(with(&["--depth", "7"])), 2, &["rank 1 on ", "the depth is 7"]);
    refused(&pair(with(&["--bvh-quality", "fast"])), 2, &["rank 1 on ", "the bvh quality is fast"]);
    let scene_of = |path: &str| {
        usual.iter().map(|word| if *word == own { path.to_owned() } else { word.clone() }).collect()
    };
    refused(&pair(scene_of(&other)), 2, &["rank 1 on ", "the scene's hash is "]);
    refused(&pair(scene_of("/nowhere/a.ron")), 4, &["rank 1 on ", "/nowhere/a.ron"]);
    let missing: Vec<&str> = small("/nowhere/a.ron", &image, &rows);
    refused(&mpi::run(2, &missing), 4, &["rank 0 on ", "/nowhere/a.ron"]);
    let unwritable = small(&own, "/nowhere/a.png", &rows);
    refused(&mpi::run(2, &unwritable), 1, &["rank 0 on ", "/nowhere/a.png"]);
    // Without --distribute each rank would write the same file.
    let forgotten = mpi::run(2, &small(&own, &image, &["--spp", "2"]));
    assert_eq!(forgotten.status.code(), Some(2));
    assert!(text(&forgotten).contains("add --distribute"), "{}", text(&forgotten));
    assert!(!folder.path("a.png").exists());
    // With --broadcast-scene only the root needs the file.
    let mut sent: [Vec<String>; 2] = [usual.clone(), scene_of("/nowhere/a.ron")];
    sent.iter_mut().for_each(|all| all.push("--broadcast-scene".to_owned()));
    let [first, second] = [&sent[0], &sent[1]].map(|all| all.iter().map(String::as_str).collect::<Vec<_>>());
    check(&mpi::run_each(&[(1, &first), (1, &second)]));
    assert!(folder.path("a.png").exists());
}

/// Returns the arguments of a render that takes about a minute, in pieces of a fraction of a
/// second.
fn long<'a>(scene: &'a str, image: &'a str) -> Vec<&'a str> {
    let of = ["--spp", "256", "--distribute", "rows", "--write-partial", "--resolution", "200x6000"];
    small(scene, image, &of)
}

/// A rank is killed with SIGKILL while it loads, while it renders, and later; the job ends each
/// time.
#[test]
fn a_rank_that_dies_ends_the_job() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "killed"), scene("rtiow_final.ron"));
    for (name, after) in [("early", 0), ("begun", 1500), ("later", 5000)] {
        let image = folder.file(&format!("{name}.png"));
        let job = Job::start(&folder, &long(&scene, &image));
        std::thread::sleep(Duration::from_millis(after));
        job.signal("KILL");
        let (output, took) = job.end();
        let text = text(&output);
        assert!(!output.status.success(), "{name}: {text}");
        assert!(took < Duration::from_secs(10), "{name}: {took:?}");
        // mpirun names the rank and its signal.
        assert!(text.contains("rank 1") && text.contains("exited on signal 9"), "{name}: {text}");
        if name == "later" {
            let image = trisect::image::Image::read(folder.path("later.png").as_path()).unwrap();
            let known = image.pixels.iter().filter(|pixel| pixel.iter().sum::<f32>() > 0.0).count();
            assert!((1..image.pixels.len()).contains(&known), "{known} pixels: no partial image");
        }
    }
}

#[test]
fn a_rank_that_hangs_ends_the_job() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "stopped"), scene("rtiow_final.ron"));
    let image = folder.file("a.png");
    let job = Job::start(&folder, &long(&scene, &image));
    std::thread::sleep(Duration::from_millis(3000));
    job.signal("STOP");
    let (output, took) = job.end();
    let text = text(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert!(text.contains("error: rank 1 on ") && text.contains("was silent for 6 s"), "{text}");
    assert!(text.contains("wrote the partial image to"), "{text}");
    assert!(folder.path("a.png").exists());
}

/// Live frames are those of one process: each rank renders a band of rows, and the rows around it
/// that the filters read.
#[test]
fn frames_are_those_of_one_process() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "frames"), scene("three_spheres.ron"));
    let (one, many) = (folder.file("one"), folder.file("many"));
    let of = |output: &str, more: &[&str]| {
        let all = [
            "view",
            &scene,
            "--headless",
            "--backend",
            "cpu",
            "--threads",
            "1",
            "--resolution",
            "64x200",
            "--frames",
            "4",
            "-o",
            output,
        ];
        [&all[..], more].concat().into_iter().map(str::to_owned).collect::<Vec<String>>()
    };
    for more in [&[][..], &["--denoise", "atrous"], &["--denoise", "off", "--history", "0"]] {
        let single = of(&one, more);
        check(&program::trisect(&single.iter().map(String::as_str).collect::<Vec<_>>()));
        let spread = of(&many, &[more, &["--distribute", "rows"]].concat());
        let output = mpi::run(3, &spread.iter().map(String::as_str).collect::<Vec<_>>());
        check(&output);
        assert!(String::from_utf8_lossy(&output.stdout).contains("from frame to frame"));
        for frame in 0..4 {
            let [one, many] =
                [&one, &many].map(|folder| fs::read(format!("{folder}/{frame:04}.png")).unwrap());
            assert!(one == many, "frame {frame} of {more:?}");
        }
    }
}

/// Messages of megabytes, which ranks of one host copy through shared memory, arrive complete, even
/// those larger than that memory.
#[test]
fn long_messages_come_whole() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "long"), scene("three_spheres.ron"));
    let large = ["--resolution", "1600x1200", "--spp", "1", "--depth", "2"];
    same(&folder, &scene, "rows.pfm", &large, &[2, 3], &["--distribute", "rows"]);
    same(
        &folder,
        &scene,
        "layers.exr",
        &[&large[..], &["--aov", "normal,albedo"]].concat(),
        &[3],
        &["--distribute", "rows"],
    );
    let (one, many) = (folder.file("one.pfm"), folder.file("many.pfm"));
    let large = [&large[..2], &["--spp", "4", "--depth", "2"][..]].concat();
    check(&program::trisect(&small(&scene, &one, &large)));
    check(&mpi::run(4, &small(&scene, &many, &[&large[..], &["--distribute", "average"]].concat())));
    check(&program::trisect(&["compare", &many, &one, "--max-rel-mse", "1e-13"]));
}

#[test]
fn the_benchmark_writes_what_it_measured() {
    if !mpi::available() {
        return;
    }
    let (folder, scene) = (Temporary::new("cluster", "bench"), scene("three_spheres.ron"));
    let out = folder.file("out");
    let common = ["bench", "cluster", &scene, "--backend", "cpu", "--threads", "1", "--resolution", "64x64"];
    let small = ["--frames", "2", "--frame-spp", "1", "--average-spp", "2", "--noise-spp", "1", "-o", &out];
    for (more, ways) in [(&[][..], &["gather", "allreduce"][..]), (&["--sync", "allreduce"], &["allreduce"])]
    {
        let output = mpi::run(2, &[&common[..], &small, more].concat());
        check(&output);
        let table = fs::read_to_string(format!("{out}/cluster.csv")).unwrap();
        for what in ["rows,1,1", "rows,1,2", "average,2,1", "average,2,2"] {
            for way in ["gather", "allreduce"] {
                let line = table.lines().any(|line| line.starts_with(&format!("{what},{way},")));
                assert_eq!(line, ways.contains(&way), "{what} {way}:\n{table}");
            }
        }
        assert!(fs::read_to_string(format!("{out}/rows_1spp.svg")).unwrap().contains("</svg>"));
    }
}

#[test]
fn hosts_apart_render_the_same() {
    if !mpi::available() {
        return;
    }
    let folder = Temporary::new("cluster", "hosts");
    let Some(hosts) = Hosts::make(&folder) else { return };
    let scene = scene("rtiow_final.ron");
    let (one, many, stats) = (folder.file("one.png"), folder.file("many.png"), folder.file("stats.json"));
    check(&program::trisect(&small(&scene, &one, &["--spp", "5"])));
    let slots = format!("{}:2,{}:1", hosts.names[0], hosts.names[1]);
    let agent = [
        "--mca",
        "plm_rsh_agent",
        &hosts.agent,
        "--mca",
        "btl",
        "tcp,vader,self",
        "--mca",
        "btl_tcp_if_exclude",
        "lo",
        "--host",
        &slots,
    ];
    for mode in ["rows", "average"] {
        let all = small(&scene, &many, &["--spp", "5", "--distribute", mode, "--stats", &stats]);
        let output = mpi::command(&agent, &[(3, &all)]).output().unwrap();
        check(&output);
        let told = fs::read_to_string(&stats).unwrap();
        hosts.names.iter().for_each(|host| assert!(told.contains(host.as_str()), "no {host} in {told}"));
        if mode == "rows" {
            assert!(fs::read(&one).unwrap() == fs::read(&many).unwrap());
        } else {
            check(&program::trisect(&["compare", &many, &one, "--max-rel-mse", "1e-6"]));
        }
    }
    // Live frames: two ranks share memory with the root, the third sends its rows.
    let (one, many) = (folder.file("frames"), folder.file("frames-apart"));
    let view = [
        "view",
        &scene,
        "--headless",
        "--frames",
        "5",
        "--backend",
        "cpu",
        "--threads",
        "1",
        "--resolution",
        "32x90",
        "-o",
    ];
    check(&program::trisect(&[&view[..], &[&one]].concat()));
    let output =
        mpi::command(&agent, &[(3, &[&view[..], &[&many, "--distribute", "rows"]].concat())]).output();
    check(&output.unwrap());
    for frame in 0..5 {
        let [one, many] = [&one, &many].map(|folder| fs::read(format!("{folder}/{frame:04}.png")).unwrap());
        assert!(one == many, "frame {frame}");
    }
}
