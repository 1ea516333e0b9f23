//! JSON Schemas (draft 2020-12) of the reports, made of the types that are written.

use crate::bench::cluster::ClusterBench;
use crate::bench::report::{Complexity, Spp, VsCpu};
use crate::bench::{Benchmark, ViewReport};
use crate::evaluate::{Evaluation, FramesEvaluation};
use crate::machine::{Finding, Info};
use crate::tradeoff::{Convergence, Tradeoff};
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde_json::{Value, json};
use trisect::metrics::Comparison;
use trisect::precision;
use trisect::stats::RenderStats;

/// Returns the schema of each report, with its name.
pub fn schemas() -> Vec<(&'static str, Schema)> {
    vec![
        ("bench", of::<Benchmark>("trisect bench --json")),
        ("bench_cluster", of::<ClusterBench>("trisect bench cluster: cluster.json")),
        ("bench_report_methods", of::<Complexity>("trisect bench report: methods_against_spheres.json")),
        ("bench_report_threads", of::<VsCpu>("trisect bench report: device_against_one_thread.json")),
        ("bench_report_time", of::<Spp>("trisect bench report: time_against_spp.json")),
        ("check", of::<precision::Report>("trisect check --json")),
        ("compare", of::<Comparison>("trisect compare --json")),
        ("converge", of::<Convergence>("trisect converge --json")),
        ("doctor", of::<Vec<Finding>>("trisect doctor --json")),
        ("evaluate", of::<Evaluation>("trisect evaluate --json")),
        ("evaluate_frames", of::<FramesEvaluation>("trisect evaluate --frames --json")),
        ("info", of::<Info>("trisect info --json")),
        ("render_stats", of::<RenderStats>("trisect render --stats")),
        ("tradeoff", of::<Tradeoff>("trisect tradeoff --json, tradeoff.json")),
        ("view", of::<ViewReport>("trisect view --json")),
    ]
}

/// Returns the schema of a type as it is written, with the title of its report.
fn of<T: JsonSchema>(title: &str) -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let settings = settings.with_transform(RecursiveTransform(as_written));
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.insert("title".to_owned(), title.into());
    schema
}

/// Lets numbers be null, as NaN and infinity are written, and describes in plain text.
fn as_written(schema: &mut Schema) {
    if schema.get("type") == Some(&json!("number")) {
        schema.insert("type".to_owned(), json!(["number", "null"]));
    }
    // Names of Rust's types, which no draft defines.
    schema.remove("format");
    if let Some(Value::String(text)) = schema.get("description") {
        let text = plain(text);
        schema.insert("description".to_owned(), text.into());
    }
}

/// Returns documentation as one line without links: `[text](target)` and `[text]` become the text.
fn plain(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let (mut plain, mut rest) = (String::new(), &line[..]);
    while let Some((before, linked)) = rest.split_once('[')
        && let Some((words, after)) = linked.split_once(']')
    {
        plain += before;
        plain += words;
        rest = match after.strip_prefix('(').and_then(|target| target.split_once(')')) {
            Some((_, after)) => after,
            None => after,
        };
    }
    plain + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_become_their_text() {
        for (text, wanted) in [
            (
                "As in [`Point::knob`](super::Point::knob),\nand [`FORMAT`].",
                "As in `Point::knob`, and `FORMAT`.",
            ),
            ("From 0 to 1", "From 0 to 1"),
            ("a [b", "a [b"),
        ] {
            assert_eq!(plain(text), wanted);
        }
    }

    /// Each schema is of the draft that it names, and its numbers may be null.
    #[test]
    fn schemas_are_of_one_draft() {
        for (name, schema) in schemas() {
            let text = schema.as_value().to_string();
            assert!(text.contains("https://json-schema.org/draft/2020-12/schema"), "{name}");
            assert!(!text.contains("\"type\":\"number\"") && !text.contains("\"format\":\""), "{name}");
            assert!(!text.contains("]("), "{name}: {text}");
        }
    }
}
