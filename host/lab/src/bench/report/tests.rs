#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use trisect::device::DeviceKind;
use trisect::device::cpu::Cpu;
use trisect::render::Schedule;

pub(super) fn conditions() -> Conditions {
    let scene = Scene::hello_world().unwrap();
    let device = trisect::device::cpu::describe(1);
    Conditions::new(&device, &Settings::of(&scene), &ReportPlan::new(DeviceKind::Cpu, true))
}

fn cpu() -> Box<dyn Device> {
    Box::new(Cpu::open(Some(1)).unwrap())
}

#[test]
fn all_of_it_on_a_few_pixels() {
    let plan = ReportPlan {
        width: 8,
        height: 4,
        spp: vec![1, 2, 3],
        samples: 2,
        frames: 2,
        ..ReportPlan::new(DeviceKind::Cpu, true)
    };
    let mut lines = Vec::new();
    let scenes = [SceneDocument::hello_world().unwrap()];
    let mut say = |line: &str| lines.push(line.to_owned());
    let report = Report::measure(cpu(), cpu(), &plan.up_to(100), &scenes, &mut say).unwrap();

    let text = serde_json::to_string(&report).unwrap();
    assert_eq!(serde_json::from_str::<Report>(&text).unwrap(), report);
    assert_eq!(report.spp.points.len(), 3);
    assert_eq!(report.spp.points[2].seconds.count, 2);
    // Each method at each number of spheres was measured or is named as left out.
    for method in METHODS {
        let measured = report.complexity.points.iter().filter(|point| point.method == method.name).count();
        let left = report.complexity.left_out.iter().any(|left| left.method == method.name);
        assert!(measured == 2 || left, "{}: {measured}, {lines:#?}", method.name);
    }
    let names: Vec<&str> = report.against.points.iter().map(|point| point.scene.as_str()).collect();
    assert_eq!(names, ["three spheres", "10 spheres", "three_spheres.ron (built in)"]);
    let points = 3 + report.complexity.points.len() + report.complexity.left_out.len() + 3;
    assert_eq!(lines.len(), points, "{lines:#?}");

    let folder = std::env::temp_dir().join(format!("trisect-report-{}", std::process::id()));
    let files = report.write(&folder).unwrap();
    assert_eq!(files.len(), 4 * 2 + 3 * 2 + 1);
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    crate::page::check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!((page.matches("<figure class=\"chart\">").count(), page.matches("<table").count()), (4, 3));
    assert!(page.contains("times as fast as one thread of") && page.contains("three_spheres.ron (built in)"));
    assert!(files.iter().all(|file| is_output(Path::new(file.file_name().unwrap()))));
    assert!(!is_output(Path::new("scene.json")));
    assert!(files.iter().all(|file| file.metadata().unwrap().len() > 100));
    fs::remove_dir_all(&folder).unwrap();
    // A file stands where the folder should be.
    fs::write(&folder, "").unwrap();
    assert!(matches!(report.write(&folder), Err(BenchError::Io { .. })));
    fs::remove_file(&folder).unwrap();
}

#[test]
fn methods_are_told_apart() {
    for (index, method) in METHODS.iter().enumerate() {
        for other in &METHODS[..index] {
            assert_ne!(method.name, other.name);
            assert_ne!((method.traversal, method.schedule), (other.traversal, other.schedule));
        }
        let settings = method.settings(Settings::of(&Scene::hello_world().unwrap()));
        assert_eq!((settings.traversal, settings.schedule), (Some(method.traversal), Some(method.schedule)));
    }
    assert!(METHODS.iter().any(|method| method.schedule == Schedule::Persistent));
}

#[test]
fn cells_with_commas_are_quoted() {
    let rows = [["a,b".to_owned(), "c\"d".to_owned()], ["1".to_owned(), "2".to_owned()]];
    assert_eq!(csv(["x", "y"], rows.into_iter()), "x,y\n\"a,b\",\"c\"\"d\"\n1,2\n");
}
