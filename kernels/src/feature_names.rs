//! Names of features, for options, messages and statistics.

use trisect_shared::bsdf;
use trisect_shared::features::{Features, NAMES, of_material};

/// Returns all features that have a name, with it.
fn names() -> impl Iterator<Item = (Features, &'static str)> {
    NAMES.into_iter().chain(bsdf::NAMES.into_iter().map(|(kind, name)| (of_material(kind), name)))
}

/// Returns the names of features, with commas between them.
pub fn feature_names(features: Features) -> String {
    let named = names().filter(|(feature, _)| features & feature != 0);
    named.map(|(_, name)| name).collect::<Vec<_>>().join(",")
}

/// Returns the features with these names, which commas separate.
///
/// # Errors
///
/// The first name that no feature has.
pub fn features_by_names(list: &str) -> Result<Features, &str> {
    list.split(',').map(str::trim).filter(|name| !name.is_empty()).try_fold(0, |features, name| {
        let named = names().find(|(_, known)| *known == name);
        named.map(|(feature, _)| features | feature).ok_or(name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::features::{AOVS, HOLES};

    /// Each feature with a name has one of its own, and names read as they are written.
    #[test]
    fn names_and_back() {
        let all = names().fold(0, |all, (feature, _)| all | feature);
        assert_eq!(features_by_names(&feature_names(all)), Ok(all));
        for (feature, name) in names() {
            assert_eq!((feature.count_ones(), features_by_names(name)), (1, Ok(feature)));
        }
        assert_eq!(features_by_names("aovs, holes"), Ok(AOVS | HOLES));
        assert_eq!((features_by_names(""), features_by_names("aovs,none")), (Ok(0), Err("none")));
    }
}
