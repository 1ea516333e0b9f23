//! Dielectric boundaries: Fresnel's equations (15) and the critical angle (16).

use crate::materials;
use crate::scattering::{answer, question, with_materials};
use glam::{UVec4, Vec3};
use trisect_probes::fresnel::{CANCELLING, DIELECTRIC, SCHLICK};
use trisect_probes::record::{Input, Output, row4};
use trisect_probes::scatter::SAMPLE;
use trisect_tests::probe::Prober;
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Returns reflectance and cos² of the refracted angle by Fresnel's equations in f64.
fn exactly(cos: f64, eta: f64) -> (f64, f64) {
    let square = (1.0 - eta) * (1.0 + eta) + (eta * cos).powi(2);
    if square <= 0.0 {
        return (1.0, square);
    }
    let refracted = square.sqrt();
    let parallel = (cos - eta * refracted) / (cos + eta * refracted);
    let perpendicular = (eta * cos - refracted) / (eta * cos + refracted);
    (0.5 * (parallel.powi(2) + perpendicular.powi(2)), square)
}

/// Returns the maximum errors of the reflectance: away from the critical angle, and near it, where
/// |cos²| of the refracted angle is at most 0.03 max(eta², 1). Panics for a reflectance outside [0,
/// 1].
fn errors(questions: &[Input], outputs: &[Output]) -> (f64, f64) {
    let (mut away, mut near) = (0.0f64, 0.0f64);
    for (q, o) in questions.iter().zip(outputs) {
        let (cos, eta) = (f64::from(f32::from_bits(q.a.x)), f64::from(f32::from_bits(q.a.y)));
        let got = f32::from_bits(o.a.x);
        assert!((0.0..=1.0).contains(&got), "{got} at {cos}, {eta}");
        let (want, square) = exactly(cos, eta);
        let error = (f64::from(got) - want).abs();
        let slot = if square.abs() > 0.03 * (eta * eta).max(1.0) { &mut away } else { &mut near };
        *slot = slot.max(error);
    }
    (away, near)
}

fn questions() -> Vec<Input> {
    let mut all = Vec::new();
    for ior in [1.0f32, 1.0001, 1.5, 4.0, 100.0] {
        for eta in [ior, 1.0 / ior] {
            // Cosines in equal steps, and a geometric series down to grazing angles.
            let cosines = (1..=8192).map(|i| i as f32 / 8192.0).chain((0..200).map(|i| 0.9f32.powi(i)));
            all.extend(cosines.map(|cos| Input { a: row4(cos, eta, 0.0, 0.0), ..Input::default() }));
        }
    }
    all
}

/// Reflectance is within 1e-6 of f64, except near the critical angle.
///
/// It is 0.5 (p² + s²), where p and s are quotients of sums of two terms: at most 8 roundings of
/// 2⁻²⁴, which is 5e-7, and on Vulkan 2 quotients within 2.5 ULP, so that 1e-6 holds there, too.
/// Near the critical angle the square root turns an error e of cos² into sqrt(e).
fn t15_fresnel(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let questions = questions();
    let (away, near) = errors(&questions, &prober.ask("probe_fresnel", DIELECTRIC, &questions));
    assert!(away <= 1e-6, "{away}");
    // The error of cos² is a few eps of its terms, at most eta²; the error of its root is the root
    // of that.
    let worst = (8.0 * f64::from(f32::EPSILON)).sqrt() * 4.0;
    assert!(near <= worst, "{near}, {worst} allowed");
    let (schlick, _) = errors(&questions, &prober.ask("probe_fresnel", SCHLICK, &questions));
    assert!(schlick > 0.1, "negative control not detected: {schlick}");
    let figure = format!(
        "at most {away:.1e}; {near:.1e} nearer to the critical angle than cos² = 0.03; Schlick's {schlick:.2}"
    );
    report(15, subject, Outcome::Passed, figure);
}

/// Total reflection begins where f64 says, except within 2 ULP of the cosine of the critical angle,
/// and each direction has unit length. The questions are 129 cosines in steps of an ULP.
fn t16_critical_angle(subject: BackendUnderTest) {
    let indices = [1.0001f32, 1.1, 1.33, 1.5, 2.4, 4.0];
    let setups = indices.map(|ior| materials::glass(ior, false));
    let Some(mut prober) = with_materials(subject, &setups) else { return };
    let (mut questions, mut expected) = (Vec::new(), Vec::new());
    for (index, &ior) in indices.iter().enumerate() {
        let eta = f64::from(ior);
        let critical = (1.0 - 1.0 / (eta * eta)).sqrt();
        let mut cos = critical as f32;
        (0..64).for_each(|_| cos = cos.next_down());
        for _ in 0..129 {
            let square = exactly(f64::from(cos), eta).1;
            let ulps = (f64::from(cos) - critical) / trisect_tests::ulp::ulp(critical);
            let viewer = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            // A few ULP from the angle the reflectance is below 1 - 2^-24: this word transmits if
            // any word does.
            questions.push(question(index, viewer, Vec3::Z, false, UVec4::new(0, 0, u32::MAX, 0)));
            expected.push((ior, ulps, square > 0.0));
            cos = cos.next_up();
        }
    }
    let outputs = prober.ask("probe_scatter", SAMPLE, &questions);
    let mut agreed_from = 0.0f64;
    for (output, &(ior, ulps, passes)) in outputs.iter().zip(&expected) {
        let a = answer(output);
        let length = f64::from(a.direction.length());
        assert!(a.direction.is_finite() && (length - 1.0).abs() < 1e-6, "{ior}, {ulps} ulp: {a:?}");
        if a.transmitted != passes {
            agreed_from = agreed_from.max(ulps.abs());
        }
    }
    assert!(agreed_from <= 2.0, "another branch than f64's at {agreed_from} ulp");
    // Negative control: the sign of cos² by the form that cancels, against f64's sign.
    let rows: Vec<Input> = questions
        .iter()
        .zip(&expected)
        .map(|(q, e)| Input { a: row4(-f32::from_bits(q.a.z), e.0, 0.0, 0.0), ..Input::default() })
        .collect();
    let wrong = |outputs: &[Output]| {
        let off = outputs.iter().zip(&expected).filter(|(o, e)| (f32::from_bits(o.a.z) > 0.0) != e.2);
        off.map(|(_, e)| e.1.abs()).fold(0.0, f64::max)
    };
    let (ours, cancelling) = (
        wrong(&prober.ask("probe_fresnel", DIELECTRIC, &rows)),
        wrong(&prober.ask("probe_fresnel", CANCELLING, &rows)),
    );
    assert!(ours <= 2.0 && cancelling > 2.0, "negative control not detected: {ours}, {cancelling}");
    let figure = format!(
        "f64's branch beyond {agreed_from:.1} ulp of the angle; the cancelling form: beyond {cancelling:.0}"
    );
    report(16, subject, Outcome::Passed, figure);
}

for_each_route!(t15_fresnel, t16_critical_angle);
