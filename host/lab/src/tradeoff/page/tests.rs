#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::super::point::{FORMAT, Missing, Point};
use super::super::recommend::{recommend, tests::point};
use super::super::{front, picture::Picture, picture::Shown};
use super::*;
use crate::page::{Raster, check};
use crate::statistics::Interval;

/// Name of a scene that would be markup.
const BAD: &str = "<script>alert(\"1\")</script>' & co.ron";

fn tradeoff(mut points: Vec<Point>) -> Tradeoff {
    front::mark(&mut points);
    Tradeoff {
        format: FORMAT,
        version: "0".to_owned(),
        scene: BAD.to_owned(),
        device: BAD.to_owned(),
        width: 4,
        height: 3,
        reduction: 1,
        depth: 5,
        reference: None,
        seeds: 4,
        drift: 0.01,
        recommended: recommend(&points),
        others: Vec::new(),
        slopes: front::slopes(&points),
        points,
        missing: vec![Missing { knob: BAD.to_owned(), level: BAD.to_owned(), reason: BAD.to_owned() }],
        ended: None,
        seconds: 1.0,
    }
}

fn raster(edge: u32) -> Raster {
    // Noise, so that PNG does not make it small.
    let bytes = (0..edge * edge * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    Raster { width: edge, height: edge, bytes }
}

fn pictures(points: &[Point], edge: u32) -> Pictures {
    let picture = || Picture { image: raster(edge), difference: raster(2), flip: raster(2) };
    let shown = |point: &Point| Shown { name: point.name(), spp: point.spp, picture: picture() };
    Pictures { reference: Some(raster(edge)), stops: 0.0, shown: points.iter().map(shown).collect() }
}

fn page_of(found: &Tradeoff, edge: u32) -> String {
    let page = found.page(&pictures(&found.points, edge)).unwrap();
    check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    page
}

#[test]
fn the_page_says_first_what_to_use() {
    let mut points = vec![
        point("base", 4, 1.0, 0.2),
        point("base", 64, 16.0, 0.05),
        point("sampler sobol", 16, 3.0, 0.08),
        point("depth <2>", 4, 0.1, 0.94),
    ];
    points[1].command = Some("trisect render 'a <b>.ron' --spp 64".to_owned());
    let found = tradeoff(points);
    let page = page_of(&found, 4);
    let lead = page.split("class=\"lead\">").nth(1).unwrap().split("</p>").next().unwrap();
    assert!(lead.starts_with("For this scene use base, 4 spp (1 s, error 20.00 % ("), "{lead}");
    assert!(lead.contains("sampler sobol, 16 spp (3 s, error 8.00 %"), "{lead}");
    assert!(lead.contains("base, 64 spp (16 s, error 5.00 %"), "{lead}");
    assert!(page.find("class=\"lead\"").unwrap() < page.find("<svg").unwrap());
    let code = page.split("<code>").find(|code| code.contains("64</span></code>")).unwrap();
    let code = code.split("</code>").next().unwrap().replace("<span>", "").replace("</span>", "");
    assert_eq!(code, "trisect render &#39;a &lt;b&gt;.ron&#39; --spp 64");
    // Names of the scene and of settings are text.
    assert_eq!(page.matches("<script>").count(), 1);
    assert!(page.contains("&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&#39; &amp; co.ron"));
    // The point that is 94 % wrong is on the front, but neither recommended nor called better.
    let rows = page.split("<tr class=\"front\">").skip(1).map(|row| row.split("</tr>").next().unwrap());
    let row = rows.into_iter().find(|row| row.contains("depth &lt;2&gt;")).unwrap();
    assert!(row.contains("<td>too inaccurate</td>") && !row.contains("better"), "{row}");
    assert!(found.points[3].on_front && !lead.contains("depth"));
    let summary = found.summary();
    assert!(summary.contains("Use for this scene:\n  fast: base, 4 spp: 1 s"), "{summary}");
    assert!(summary.contains("    trisect render 'a <b>.ron' --spp 64"), "{summary}");
}

#[test]
fn nothing_good_is_said() {
    let found = tradeoff(vec![point("base", 1, 1.0, 0.94)]);
    let page = page_of(&found, 4);
    assert!(
        page.contains("No setting can be recommended: the lowest error is that of base, 1 spp (1 s"),
        "{page}"
    );
    assert!(!page.contains("class=\"uses\""));
    assert!(found.summary().contains("No setting can be recommended"));
    let page = page_of(&tradeoff(Vec::new()), 4);
    assert!(page.contains("No setting can be recommended: nothing was measured."));
}

/// A bias that rounds to nothing is called none on the page.
#[test]
fn a_bias_of_nothing_is_not_biased() {
    let of = |value: f64| Interval { value, low: value, high: value };
    let with = |squared: f64| {
        let mut one = point("clamp 16", 4, 1.0, 0.1);
        (one.errors.means_p, one.errors.squared_bias, one.errors.brightness) = (1e-9, of(squared), of(1e-7));
        page_of(&tradeoff(vec![one]), 4)
    };
    let tiny = with(1e-12);
    assert!(tiny.contains("below 0.001</td>") && !tiny.contains(">biased<"), "{tiny}");
    // Negative control.
    let large = with(1e-4);
    assert!(large.contains("<td>biased</td>") && large.contains("</svg>biased</li>"));
}

/// Large images leave others out, and the page says how many.
#[test]
fn images_are_bounded() {
    let points: Vec<Point> =
        (0..40).map(|i| point(&format!("depth {i}"), 4, f64::from(i + 1), 0.1)).collect();
    let small = page_of(&tradeoff(points.clone()), 4);
    assert!(!small.contains("left out") && small.matches("data-name=").count() == 41);
    let large = page_of(&tradeoff(points), 480);
    let shown = large.matches("data-name=").count();
    assert!((5..40).contains(&shown), "{shown}");
    assert!(large.contains(&format!(" {} more are left out", 41 - shown)) && large.len() < 12 << 20);
}
