//! The first part of the report page: what to use for the scene.

use super::point::{Point, Purpose, Tradeoff};
use super::recommend::{MAX_ERROR, RULES};
use crate::page::{Document, command, escape};
use crate::plot::number;
use std::fmt::Write;

impl Point {
    /// Returns name and samples, such as "depth 8, 16 spp".
    pub(super) fn title(&self) -> String {
        format!("{}, {} spp", self.name(), self.spp)
    }

    /// Returns time and error with its interval, and a bias that was seen.
    pub(super) fn cost(&self) -> String {
        let root = self.errors.rel_mse.map(|value| 100.0 * value.max(0.0).sqrt());
        let bias = self.errors.bias();
        let bias = if bias.is_seen() { format!(", {bias}") } else { String::new() };
        format!(
            "{} s, error {:.2} % ({:.2} to {:.2}){bias}",
            number(self.seconds.all.median),
            root.value,
            root.low,
            root.high
        )
    }
}

impl Tradeoff {
    /// Returns the advice as plain text: what to use for the scene and what it costs, or why
    /// nothing can be recommended. The sentences name options of the program.
    pub fn advice(&self) -> String {
        [Some(sentence(self)), size(self)].into_iter().flatten().collect::<Vec<_>>().join(" ")
    }
}

/// Returns the sentence on what to use, as plain text.
fn sentence(found: &Tradeoff) -> String {
    let all: Vec<(Purpose, &Point)> = found.recommended_points().collect();
    let [(_, fast), (_, balanced), (_, best)] = all[..] else {
        let least = found.points.iter().min_by(|a, b| a.relative_error().total_cmp(&b.relative_error()));
        let why = match least {
            None => "nothing was measured".to_owned(),
            Some(point) if point.max_relative_error() > MAX_ERROR => format!(
                "the lowest error is that of {} ({}), and it should be at most {:.0} %",
                point.title(),
                point.cost(),
                100.0 * MAX_ERROR
            ),
            Some(_) => "none of the measured settings meets the rules below".to_owned(),
        };
        return format!(
            "No setting can be recommended: {why}. Measure with more samples \
             (--levels), more time (--time-limit) or a smaller --resolution."
        );
    };
    let of = |point: &Point| format!("{} ({})", point.title(), point.cost());
    let same = |a: &Point, b: &Point| (a.name(), a.spp) == (b.name(), b.spp);
    match (same(fast, balanced), same(balanced, best)) {
        (true, true) => format!("For this scene use {}: of what was measured it is fast and best.", of(fast)),
        (true, false) => format!(
            "For this scene use {} for a fast image, which is the balanced choice, too, and {} for the best one measured.",
            of(fast),
            of(best)
        ),
        (false, true) => format!(
            "For this scene use {} for a fast image, and {} for a balanced one, which is the best measured, too.",
            of(fast),
            of(best)
        ),
        (false, false) => format!(
            "For this scene use {} for a fast image, {} for a balanced one, and {} for the best one measured.",
            of(fast),
            of(balanced),
            of(best)
        ),
    }
}

/// Returns a sentence on the size of the measured images, if the commands render another one.
fn size(found: &Tradeoff) -> Option<String> {
    let Tradeoff { reduction, width, height, .. } = *found;
    (reduction > 1).then(|| {
        format!(
            "To fit the time limit, all was measured at {width}×{height} pixels, 1/{reduction} of the size: the \
             commands take about {} times as long, and filters gain more. For the whole size, measure with more time \
             (--time-limit), or name a --resolution.",
            u64::from(reduction).pow(2)
        )
    })
}

/// Returns the advice as lines for people.
pub(super) fn lines(found: &Tradeoff) -> String {
    let mut text = String::new();
    for (purpose, point) in found.recommended_points() {
        let _ = writeln!(text, "  {}: {}: {}", purpose.name(), point.title(), point.cost());
        if let Some(command) = &point.command {
            let _ = writeln!(text, "    {command}");
        }
    }
    let size = size(found).map_or(String::new(), |line| line + "\n");
    match text.is_empty() {
        true => format!("{}\n{size}", sentence(found)),
        false => format!("Use for this scene:\n{text}{size}"),
    }
}

/// Writes the advice with its commands, and the rules by which it was chosen.
pub(super) fn write(found: &Tradeoff, page: &mut Document) {
    page.paragraph("lead", &found.advice());
    let mut uses = String::from("<div class=\"uses\">\n");
    for (purpose, point) in found.recommended_points() {
        let (name, title, cost) = (purpose.name(), escape(&point.title()), escape(&point.cost()));
        let code = point.command.as_deref().map_or(String::new(), command);
        let heading: String =
            name.chars().take(1).flat_map(char::to_uppercase).chain(name.chars().skip(1)).collect();
        let _ = writeln!(uses, "<div><h3>{heading}: {title}</h3><p>{cost}</p>{code}</div>");
    }
    uses.push_str("</div>");
    if found.recommended_points().next().is_some() {
        page.add(&uses);
    }
    page.add("<details>\n<summary>How these were chosen</summary>");
    page.list(RULES.map(str::to_owned));
    page.add("</details>");
}
