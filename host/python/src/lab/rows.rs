//! Results as rows of a table: dicts of numbers, words and None.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use trisect_lab::accuracy::Errors;
use trisect_lab::statistics::Interval;
use trisect_lab::tradeoff::{Capture, ErrorCurve, Point};

/// Row of a table.
struct Row<'py>(Bound<'py, PyDict>);

impl<'py> Row<'py> {
    fn set(&self, name: &str, value: impl IntoPyObject<'py>) -> PyResult<()> {
        self.0.set_item(name, value)
    }

    /// Sets a number, and None for NaN and infinity.
    fn number(&self, name: &str, value: f64) -> PyResult<()> {
        self.set(name, Some(value).filter(|value| value.is_finite()))
    }

    /// Sets an estimate and the ends of its interval.
    fn interval(&self, name: &str, of: Option<Interval>) -> PyResult<()> {
        let of = of.unwrap_or(Interval { value: f64::NAN, low: f64::NAN, high: f64::NAN });
        self.number(name, of.value)?;
        self.number(&format!("{name}_low"), of.low)?;
        self.number(&format!("{name}_high"), of.high)
    }

    fn errors(&self, errors: &Errors) -> PyResult<()> {
        // The estimate of relMSE may be negative by chance.
        let root = |value: f64| if value < 0.0 { 0.0 } else { value.sqrt() };
        self.interval("error", Some(errors.rel_mse.map(root)))?;
        let intervals = [
            ("rel_mse", errors.rel_mse),
            ("variance", errors.variance),
            ("squared_bias", errors.squared_bias),
            ("rmse", errors.rmse),
            ("flip", errors.flip),
            ("brightness", errors.brightness),
        ];
        for (name, interval) in intervals {
            self.interval(name, Some(interval))?;
        }
        self.number("bias_p", errors.bias_p)?;
        self.number("means_p", errors.means_p)?;
        self.set("biased", errors.biased)
    }
}

/// Returns the row of a point.
pub fn of_point<'py>(py: Python<'py>, point: &Point) -> PyResult<Bound<'py, PyDict>> {
    let row = Row(PyDict::new(py));
    row.set("knob", &point.knob)?;
    row.set("level", &point.level)?;
    row.set("spp", point.spp)?;
    let (seconds, all) = (&point.seconds, &point.seconds.all);
    row.number("seconds", all.median)?;
    row.number("seconds_lower_quartile", all.lower_quartile)?;
    row.number("seconds_upper_quartile", all.upper_quartile)?;
    row.number("render_seconds", seconds.render)?;
    row.number("denoise_seconds", seconds.denoise)?;
    row.number("scale_seconds", seconds.scale)?;
    row.errors(&point.errors)?;
    row.interval("efficiency", Some(point.efficiency))?;
    row.interval("against_base", point.against.as_ref().map(|against| against.efficiency))?;
    row.set("on_front", point.on_front)?;
    row.set("exact", point.exact)?;
    row.set("verdict", point.verdict())?;
    row.set("command", point.command.as_deref())?;
    Ok(row.0)
}

/// Returns the row of one number of samples of an error curve.
pub fn of_capture<'py>(
    py: Python<'py>,
    course: &ErrorCurve,
    capture: &Capture,
) -> PyResult<Bound<'py, PyDict>> {
    let row = Row(PyDict::new(py));
    row.set("mode", &course.mode)?;
    row.set("spp", capture.spp)?;
    row.errors(&capture.errors)?;
    row.interval("slope", course.slope)?;
    row.set("plateau", course.plateau)?;
    row.set("verdict", &course.verdict)?;
    Ok(row.0)
}
