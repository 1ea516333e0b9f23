//! Error curves that end early.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::super::supervisor::tests::Scripted;
use super::*;
use crate::tradeoff::configurations;
use trisect::adaptive::Goal;
use trisect::device::cpu::Cpu;
use trisect::scene::Scene;

/// Requested numbers of samples per pixel.
const COUNTS: [u32; 5] = [1, 2, 4, 8, 16];

fn followed(supervisor: &mut Scripted) -> Convergence {
    let scene = Scene::hello_world().unwrap();
    let settings = Settings { width: 16, height: 9, depth: 3, ..Settings::of(&scene) };
    let knobs = ["sampler", "scale", "depth"].map(str::to_owned);
    let modes = configurations(&scene, &Configuration::base(&settings, None), &knobs, false).unwrap();
    let mut lab = Lab::new(&scene, Box::new(Cpu::open(Some(1)).unwrap()));
    let renderer = lab.renderer(&modes[0]).unwrap();
    // Each render takes one submission, however fast the machine is.
    renderer.limit_submissions(Some(u64::MAX));
    let goal = Goal::Error { target: 1e-9, max_samples: 32 };
    let reference = Reference::render(renderer, &scene, &settings, None, goal, &mut ()).unwrap();
    let courses = ConvergencePlan { configurations: &modes, first: 1, last: 16, seeds: 4 };
    lab.converge(&courses, Some(&reference), supervisor).unwrap()
}

/// Returns the number of sample counts that a line names as missing.
fn lacking(missing: &Missing) -> usize {
    missing.reason.split(';').next().unwrap().split(',').count()
}

#[test]
fn courses_end_where_they_are_told_to() {
    let mut whole = Scripted::new(u32::MAX);
    let all = followed(&mut whole);
    assert_eq!((all.courses.len(), all.ended), (3, None));
    assert!(all.courses.iter().all(|course| course.captures.len() == COUNTS.len()));
    let scaled = |missing: &Missing| missing.knob == "scale" && missing.reason.contains("no error curve");
    assert!(all.missing.len() == 2 && all.missing.iter().all(scaled), "{:?}", all.missing);

    for submissions in [0, 1, whole.done / 2, whole.done - 1] {
        let mut supervisor = Scripted::new(submissions);
        let found = followed(&mut supervisor);
        assert_eq!(supervisor.late.get(), 0, "{submissions}: something began after the end");
        assert_eq!(found.ended, Some(Stop::Interrupted));
        for course in &found.courses {
            let other = all.courses.iter().find(|other| other.mode == course.mode).unwrap();
            assert_eq!(course.captures[..], other.captures[..course.captures.len()]);
        }
        let captures: usize = found.courses.iter().map(|course| course.captures.len()).sum();
        let cut = found.missing.iter().filter(|missing| missing.reason.contains("ended by an interrupt"));
        assert_eq!(captures + cut.map(lacking).sum::<usize>(), 3 * COUNTS.len(), "{:?}", found.missing);
        assert_eq!(captures == 0, submissions < 2);
        let text = serde_json::to_string(&found).unwrap();
        assert!(serde_json::from_str::<Convergence>(&text).is_ok(), "{text}");
    }
}

/// The first configuration does not take the time of the others.
#[test]
fn courses_share_the_time() {
    let mut supervisor = Scripted::within(36);
    let found = followed(&mut supervisor);
    let counts: Vec<usize> = found.courses.iter().map(|course| course.captures.len()).collect();
    assert_eq!(supervisor.late.get(), 0);
    assert!(counts.len() == 3 && counts.iter().all(|count| (1..5).contains(count)), "{counts:?}");
    assert_eq!(found.ended, Some(Stop::OutOfTime));
    let cut = found.missing.iter().filter(|missing| missing.reason.contains("ended by the time limit"));
    assert_eq!(cut.map(lacking).sum::<usize>() + counts.iter().sum::<usize>(), 3 * COUNTS.len());
    let text = found.courses[0].line();
    assert!(text.contains("too few numbers of samples") && found.courses[0].slope.is_none(), "{text}");
}
