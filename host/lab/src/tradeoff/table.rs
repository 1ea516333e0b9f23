//! Results of a trade-off measurement as lines for people and as CSV.

use super::advice;
use super::point::{Point, Tradeoff};
use super::reference::ReferenceInfo;
use crate::accuracy::Bias;
use crate::statistics::Interval;

impl Point {
    /// Returns one line for people.
    pub fn line(&self) -> String {
        let errors = &self.errors;
        let bias = match errors.bias() {
            Bias::Suspected if self.exact => {
                format!("{} (without bias by construction: paths too rare for the samples)", Bias::Suspected)
            }
            bias if self.exact && bias.is_seen() => {
                let off = bias.to_string().replacen("bias", "off by", 1);
                format!("{off} (without bias by construction: paths too rare for the samples)")
            }
            bias => bias.to_string(),
        };
        let against = self.against.as_ref().map_or(String::new(), |against| {
            let efficiency = against.efficiency;
            format!(
                ", efficiency {:.2} ({:.2} to {:.2}) of the base",
                efficiency.value, efficiency.low, efficiency.high
            )
        });
        format!(
            "{}, {} spp: {:.4} s, error {}, {bias}, FLIP {:.4}{against}: {}",
            self.name(),
            self.spp,
            self.seconds.all.median,
            errors.rel_mse.root_percent(),
            errors.flip.value,
            self.verdict(),
        )
    }
}

/// Returns a CSV table with one row per point.
pub(super) fn csv(found: &Tradeoff) -> String {
    let mut text = "knob,level,spp,seconds,seconds_lower_quartile,seconds_upper_quartile,render_seconds,denoise_seconds,scale_seconds,\
        rel_mse,rel_mse_low,rel_mse_high,variance,variance_low,variance_high,squared_bias,squared_bias_low,squared_bias_high,\
        rmse,rmse_low,rmse_high,flip,flip_low,flip_high,brightness,brightness_low,brightness_high,bias_p,means_p,biased,\
        efficiency,efficiency_low,efficiency_high,against_base,against_base_low,against_base_high,on_front,verdict\n"
        .to_owned();
    for point in &found.points {
        let (errors, seconds) = (&point.errors, &point.seconds);
        let mut cells = vec![point.knob.clone(), format!("\"{}\"", point.level), point.spp.to_string()];
        let mut add =
            |value: f64| cells.push(if value.is_finite() { value.to_string() } else { String::new() });
        let all = &seconds.all;
        [all.median, all.lower_quartile, all.upper_quartile, seconds.render, seconds.denoise, seconds.scale]
            .into_iter()
            .for_each(&mut add);
        let intervals = [
            errors.rel_mse,
            errors.variance,
            errors.squared_bias,
            errors.rmse,
            errors.flip,
            errors.brightness,
        ];
        let parts = |interval: Interval| [interval.value, interval.low, interval.high];
        intervals.into_iter().flat_map(parts).for_each(&mut add);
        [errors.bias_p, errors.means_p].into_iter().for_each(&mut add);
        cells.push(errors.biased.to_string());
        let nothing = Interval { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        let against = point.against.as_ref().map_or(nothing, |against| against.efficiency);
        for value in [point.efficiency, against].into_iter().flat_map(parts) {
            cells.push(if value.is_finite() { value.to_string() } else { String::new() });
        }
        cells.extend([point.on_front.to_string(), point.verdict().to_owned()]);
        text += &(cells.join(",") + "\n");
    }
    text
}

impl Tradeoff {
    /// Returns a summary for people: the Pareto front, what to use, and what was not measured.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{}, {}x{} on {}: {} points in {:.0} s; {}\nPareto front, from fast to accurate:\n",
            self.scene,
            self.width,
            self.height,
            self.device,
            self.points.len(),
            self.seconds,
            ReferenceInfo::summary(self.reference.as_ref()),
        );
        let mut front: Vec<&Point> = self.points.iter().filter(|point| point.on_front).collect();
        front.sort_by(|a, b| a.seconds.all.median.total_cmp(&b.seconds.all.median));
        for point in front {
            text += &format!("  {}\n", point.line());
        }
        text += &advice::lines(self);
        if !self.others.is_empty() {
            text += "Images of other renderers:\n";
        }
        for other in &self.others {
            text += &format!("  {}\n", other.line());
        }
        for missing in &self.missing {
            text += &(missing.line() + "\n");
        }
        text
    }
}

#[cfg(test)]
mod tests;
