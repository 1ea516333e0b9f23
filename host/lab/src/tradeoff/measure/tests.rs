//! Sweeps that end early: what was measured is kept, what was not is named, and nothing begins
//! after the end.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::super::supervisor::tests::Scripted;
use super::*;
use crate::tradeoff::configurations;
use std::fs;
use trisect::adaptive::Goal;
use trisect::device::cpu::Cpu;
use trisect::render::Settings;
use trisect::scene::Scene;

const LEVELS: [u32; 2] = [1, 4];

const GOAL: Goal = Goal::Error { target: 1e-9, max_samples: 32 };

/// Returns a scene, and its base with all configurations of a few knobs.
fn ready() -> (Scene, Vec<Configuration>) {
    let scene = Scene::hello_world().unwrap();
    let settings = Settings { width: 16, height: 9, depth: 3, ..Settings::of(&scene) };
    let knobs = ["sampler", "adaptive", "denoiser", "depth"].map(str::to_owned);
    let modes = configurations(&scene, &Configuration::base(&settings, None), &knobs, false).unwrap();
    (scene, modes)
}

/// Returns a lab whose renders take one submission each, however fast the machine is.
fn lab<'a>(scene: &'a Scene, base: &Configuration) -> Lab<'a> {
    let mut lab = Lab::new(scene, Box::new(Cpu::open(Some(1)).unwrap()));
    lab.renderer(base).unwrap().limit_submissions(Some(u64::MAX));
    lab
}

fn measured(supervisor: &mut Scripted) -> (Tradeoff, Pictures) {
    let (scene, modes) = ready();
    let mut lab = lab(&scene, &modes[0]);
    let settings = &modes[0].settings;
    let reference =
        Reference::render(lab.renderer(&modes[0]).unwrap(), &scene, settings, None, GOAL, &mut ()).unwrap();
    let sweep = Sweep {
        configurations: &modes,
        levels: &LEVELS,
        seeds: 4,
        flips: 1,
        command: &RenderCommand::default(),
        reduction: 1,
    };
    lab.measure(&sweep, Some(&reference), supervisor).unwrap()
}

#[test]
fn a_sweep_ends_where_it_is_told_to() {
    let mut whole = Scripted::new(u32::MAX);
    let (all, _) = measured(&mut whole);
    let adaptive = all.missing.iter().all(|missing| missing.knob == "adaptive");
    assert!(adaptive && all.missing.len() == LEVELS.len() && all.ended.is_none(), "{:?}", all.missing);
    let of_modes = ready().1.len() - 1;
    assert_eq!(all.points.len(), LEVELS.len() * of_modes);

    for submissions in [0, 1, whole.done / 3, 3 * whole.done / 4, whole.done - 1] {
        let mut supervisor = Scripted::new(submissions);
        let (found, _) = measured(&mut supervisor);
        assert_eq!(supervisor.late.get(), 0, "{submissions}: something began after the end");
        // Each measured point equals that of the complete sweep.
        for point in &found.points {
            let is_same = |other: &&Point| (other.name(), other.spp) == (point.name(), point.spp);
            let other = all.points.iter().find(is_same).unwrap();
            assert_eq!(point.errors.each, other.errors.each);
        }
        // Each point that was not measured is named.
        let named = |missing: &&Missing| missing.reason.ends_with("ended by an interrupt");
        let levels = |missing: &Missing| missing.reason.split(';').next().unwrap().split(',').count();
        let lacking: usize = found.missing.iter().filter(named).map(levels).sum();
        assert_eq!(found.points.len() + lacking, all.points.len(), "{submissions}: {:?}", found.missing);
        assert_eq!(found.ended, (lacking > 0).then_some(Stop::Interrupted), "{submissions}");
        assert!(submissions + 1 == whole.done || lacking > 0, "{submissions}");
        assert_eq!(found.points.is_empty(), submissions < 2, "{submissions}");
        // All configurations have the lower number of samples before any has the higher.
        let at = |spp| found.points.iter().filter(|point| point.spp == spp).count();
        assert!(at(LEVELS[1]) == 0 || at(LEVELS[0]) == of_modes, "{submissions}");
    }
    // Negative control: a stage that begins after the end is counted.
    let mut supervisor = Scripted::new(0);
    supervisor.begin(0, 1, "late");
    assert_eq!(supervisor.late.get(), 1);
}

/// A sweep without time gives a report that names what it lacks.
#[test]
fn a_report_of_nothing_names_everything() {
    let (scene, modes) = ready();
    let folder = std::env::temp_dir().join(format!("trisect-lab-{}-nothing", std::process::id()));
    let mut lab = lab(&scene, &modes[0]);
    let mut supervisor = Scripted::within(0);
    assert_eq!(lab.pace(&modes[0], &mut supervisor).unwrap(), (f64::INFINITY, 0.0));
    let reference = lab.reference(&modes[0], (GOAL, 0.5), &folder, &mut supervisor).unwrap();
    assert!(reference.is_none());
    let sweep = Sweep {
        configurations: &modes,
        levels: &LEVELS,
        seeds: 4,
        flips: 1,
        command: &RenderCommand::default(),
        reduction: 1,
    };
    let (found, pictures) = lab.measure(&sweep, None, &mut supervisor).unwrap();
    assert_eq!((found.points.len(), found.ended), (0, Some(Stop::OutOfTime)));
    assert_eq!(supervisor.done, 0, "something was rendered");
    found.write(&pictures, &folder).unwrap();
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    let summary = found.summary();
    for name in modes.iter().filter(|mode| !mode.adaptive).map(|mode| format!("{} {}", mode.knob, mode.level))
    {
        let line = format!("{name}: 1, 4 samples a pixel; ended by the time limit");
        assert!(page.contains(&line) && summary.contains(&line), "{line}: {summary}");
    }
    let text = fs::read_to_string(folder.join("tradeoff.json")).unwrap();
    assert_eq!(serde_json::from_str::<Tradeoff>(&text).unwrap(), found);
    fs::remove_dir_all(folder).unwrap();
}

/// A reference takes its share of the time, and does not replace a better one.
#[test]
fn references_share_the_time() {
    let (scene, modes) = ready();
    let folder = std::env::temp_dir().join(format!("trisect-lab-{}-shares", std::process::id()));
    let mut lab = lab(&scene, &modes[0]);
    let most = 2048;
    let goal = Goal::Error { target: 1e-9, max_samples: most };
    let mut samples = |goal, share, seconds| {
        let mut supervisor = Scripted::within(seconds);
        let reference = lab.reference(&modes[0], (goal, share), &folder, &mut supervisor).unwrap();
        (reference.unwrap().facts.samples, supervisor)
    };
    let (some, supervisor) = samples(goal, 0.25, 40);
    assert!(some < f64::from(most) && (10..30).contains(&supervisor.done), "{some}, {}", supervisor.done);
    // With less time there would be fewer samples, so the kept reference stays.
    let (same, supervisor) = samples(goal, 0.25, 8);
    assert!(same == some && supervisor.said.iter().any(|line| line.contains("kept in")), "{same}");
    let (more, _) = samples(goal, 1.0, u32::MAX);
    assert!(more >= f64::from(most), "{more}");
    fs::remove_dir_all(folder).unwrap();
}

/// The whole measurement, with its reference, ends within 10 % of its time, by a clock that counts
/// submissions: for limits within the measurement of the speed, the reference and the sweep.
#[test]
fn the_limit_holds_for_all_of_it() {
    let (scene, modes) = ready();
    let folder = std::env::temp_dir().join(format!("trisect-lab-{}-limit", std::process::id()));
    let whole = |mut supervisor: Scripted, goal: Goal| {
        let mut lab = lab(&scene, &modes[0]);
        let _ = fs::remove_dir_all(&folder);
        lab.pace(&modes[0], &mut supervisor).unwrap();
        let reference = lab.reference(&modes[0], (goal, 0.35), &folder, &mut supervisor).unwrap();
        let command = RenderCommand::default();
        let sweep = Sweep {
            configurations: &modes,
            levels: &LEVELS,
            seeds: 4,
            flips: 1,
            command: &command,
            reduction: 1,
        };
        let (found, _) = lab.measure(&sweep, reference.as_ref(), &mut supervisor).unwrap();
        (supervisor, found)
    };
    // A goal of a time that the clock reaches long before, as on a device that is too slow.
    let slow = Goal::Time(std::time::Duration::from_secs(3600));
    for goal in [slow, Goal::Error { target: 1e-9, max_samples: u32::MAX / 2 }] {
        for limit in [2, 10, 40] {
            let (supervisor, found) = whole(Scripted::within(limit), goal);
            // A stage may report once more before it notices the end.
            let late = supervisor.late.get();
            assert!(late <= (limit / 10).max(1), "{limit}: {late} late, {goal:?}");
            assert_eq!(found.ended, Some(Stop::OutOfTime), "{limit}");
        }
    }
    // Negative control: without a limit, the same takes longer.
    let (free, found) = whole(Scripted::new(u32::MAX), GOAL);
    assert!(free.done > 44 && found.ended.is_none(), "{}", free.done);
    fs::remove_dir_all(folder).unwrap();
}
