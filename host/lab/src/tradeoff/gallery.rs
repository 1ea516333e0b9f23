//! Images of a report page: which of them, side by side, with a slider.

use super::picture::{BRIGHTEST, Pictures, Shown};
use super::point::{Point, Purpose, Tradeoff};
use crate::page::{Document, Gallery, INFERNO, MAGMA, slider};

/// Maximum bytes of the embedded images of a page.
const MAX_BYTES: usize = 8 << 20;

/// Returns the pictures in the order of their importance: of the recommended points, of the base
/// with its most samples, of the Pareto front, and of every other configuration with its most.
fn ranked<'a>(found: &Tradeoff, pictures: &'a Pictures) -> Vec<&'a Shown> {
    let mut points: Vec<&Point> = Vec::new();
    let purposes = [Purpose::Best, Purpose::Fast, Purpose::Balanced];
    for wanted in purposes {
        let of = found.recommended_points().filter(|(purpose, _)| *purpose == wanted);
        points.extend(of.map(|(_, point)| point));
    }
    let most = |point: &&Point| {
        let others = found.points.iter().filter(|other| other.name() == point.name());
        others.map(|other| other.spp).max() == Some(point.spp)
    };
    points.extend(found.points.iter().filter(|point| point.knob == "base").filter(most));
    points.extend(found.points.iter().filter(|point| point.on_front));
    points.extend(found.points.iter().filter(most));
    let mut ranked: Vec<&Shown> = Vec::new();
    for point in points {
        let is_it = |shown: &&Shown| shown.name == point.name() && shown.spp == point.spp;
        let is_new = !ranked.iter().any(&is_it);
        ranked.extend(pictures.shown.iter().find(is_it).filter(|_| is_new));
    }
    ranked
}

/// Writes the images, as many as fit, and the slider.
pub(super) fn write(found: &Tradeoff, pictures: &Pictures, page: &mut Document) -> Result<(), String> {
    let Some(reference) = &pictures.reference else { return Ok(()) };
    let mut gallery = Gallery::default();
    gallery.add("image-reference", "Reference", reference, "Reference", "")?;
    let all = ranked(found, pictures);
    let mut shown = 0;
    for one in &all {
        if gallery.bytes() > MAX_BYTES {
            break;
        }
        let name = format!("{}, {} spp", one.name, one.spp);
        let uses: Vec<&str> = found
            .recommended_points()
            .filter(|(_, point)| point.name() == one.name && point.spp == one.spp)
            .map(|(purpose, _)| purpose.name())
            .collect();
        let caption = if uses.is_empty() { name.clone() } else { format!("{name} ({})", uses.join(", ")) };
        let maps = [
            one.picture.difference.img(&format!("Relative difference of {name}"))?,
            one.picture.flip.img(&format!("FLIP errors of {name}"))?,
        ];
        let maps = format!("<div class=\"maps\">{}</div>", maps.concat());
        gallery.add(&format!("image-{shown}"), &caption, &one.picture.image, &caption, &maps)?;
        shown += 1;
    }
    page.section("Images");
    let exposure = match pictures.stops {
        0.0 => String::new(),
        stops => format!(" Shown with an exposure of {stops:+.1} EV, from the reference's median luminance."),
    };
    let left_out = match all.len() - shown {
        0 => String::new(),
        count => format!(" {count} more are left out, because images may take {} MiB here.", MAX_BYTES >> 20),
    };
    page.paragraph(
        "note",
        &format!(
            "Images of the first seed, for a large image at a lower resolution. Below each: its difference from the \
             reference, relative to the root of the reference's square plus 0.01, and its FLIP errors.{exposure}{left_out}"
        ),
    );
    page.add(&INFERNO.legend("scale-difference", [0.0, 100.0 * BRIGHTEST], " % difference and more"));
    page.add(&MAGMA.legend("scale-flip", [0.0, 1.0], " FLIP"));
    page.add(&slider("image-reference", if shown > 0 { "image-0" } else { "image-reference" }));
    page.add(&gallery.html(false));
    Ok(())
}
