//! Handshake at the start of a job: each rank sends its host, device and fingerprint, and the root
//! checks that all ranks would render the same image.

use super::ClusterError;
use super::heartbeat::Heartbeat;
use super::network::{Network, Tag};
use serde::{Deserialize, Serialize};
use trisect::error::Difference;
use trisect::render::Fingerprint;

/// Properties that must be equal on all ranks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RankFacts {
    /// Fingerprint of the image.
    pub fingerprint: Fingerprint,
    /// Further properties: names and values.
    pub others: Vec<(String, String)>,
}

/// Message of a rank to the root.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Handshake {
    host: String,
    device: String,
    /// Facts, or the error because of which the rank cannot render: exit code and message.
    facts: Result<RankFacts, (u8, String)>,
}

impl RankFacts {
    /// Returns the first property in which another rank differs, with a readable name, its value
    /// here and there.
    fn difference(&self, theirs: &Self) -> Option<Difference> {
        if let Some(Difference { field, one, other }) = self.fingerprint.difference(&theirs.fingerprint) {
            let field = match field.as_str() {
                "version" => "the program's version".to_owned(),
                "kernels" => "the kernels' hash".to_owned(),
                "scene" => "the scene's hash".to_owned(),
                setting => format!("the {}", setting.replace('_', " ")),
            };
            return Some(Difference { field, one, other });
        }
        self.others.iter().find_map(|(name, ours)| {
            let other = theirs.others.iter().find(|fact| fact.0 == *name);
            let other = other.map_or("missing", |fact| fact.1.as_str());
            (other != ours).then(|| Difference {
                field: name.clone(),
                one: ours.clone(),
                other: other.to_owned(),
            })
        })
    }
}

/// Sends this rank's host, device and fingerprint to the root, which compares all ranks with
/// itself. Returns the devices of all ranks on the root, an empty list on the others.
///
/// # Errors
///
/// All ranks report the first rank with an error: [`ClusterError::Rank`] if it cannot render. If it
/// differs, the root returns [`ClusterError::Mismatch`], and the others [`ClusterError::Rank`] with
/// the same message. Also [`ClusterError::Protocol`] for an invalid message, and the errors of
/// [`Heartbeat::receive`].
pub fn handshake<N: Network>(
    link: &mut Heartbeat<N>,
    device: &str,
    facts: Result<RankFacts, (u8, String)>,
) -> Result<Vec<String>, ClusterError> {
    let hello = Handshake { host: link.host_of(link.rank()), device: device.to_owned(), facts };
    let encode = |hello: &Handshake| serde_json::to_vec(hello).unwrap_or_default();
    if !link.is_root() {
        link.send(0, Tag::Handshake, encode(&hello))?;
        let answer = link.expect(Tag::Start)?;
        return match serde_json::from_slice(&answer.bytes) {
            Ok(Answer { host, refusal: None }) => {
                link.hosts[0] = host;
                Ok(Vec::new())
            }
            Ok(Answer { refusal: Some(Refusal { rank, host, code, message }), .. }) => {
                Err(ClusterError::Rank { rank, host, message, code })
            }
            Err(error) => Err(ClusterError::Protocol { rank: 0, message: error.to_string() }),
        };
    }
    let ranks = link.ranks() as usize;
    let mut hellos: Vec<Option<Handshake>> = vec![None; ranks];
    if let Some(own) = hellos.first_mut() {
        *own = Some(hello.clone());
    }
    while hellos.iter().any(Option::is_none) {
        let message = link.expect(Tag::Handshake)?;
        let theirs: Handshake = serde_json::from_slice(&message.bytes).map_err(|error| {
            ClusterError::Protocol { rank: message.from, message: format!("an invalid handshake: {error}") }
        })?;
        if let Some(host) = link.hosts.get_mut(message.from as usize) {
            *host = theirs.host.clone();
        }
        if let Some(place) = hellos.get_mut(message.from as usize) {
            *place = Some(theirs);
        }
    }
    let hellos: Vec<Handshake> = hellos.into_iter().flatten().collect();
    let wrong = (0..).zip(&hellos).find_map(|(rank, theirs)| differs(rank, &hello, theirs));
    let answer = wrong.as_ref().map(|error| {
        let (rank, host) = match error {
            ClusterError::Rank { rank, host, .. } | ClusterError::Mismatch { rank, host, .. } => {
                (*rank, host.clone())
            }
            _ => (0, String::new()),
        };
        let message = match error {
            ClusterError::Rank { message, .. } => message.clone(),
            other => other.to_string(),
        };
        Refusal { rank, host, code: error.exit_code(), message }
    });
    let answer = Answer { host: hello.host.clone(), refusal: answer };
    link.send_all(Tag::Start, &serde_json::to_vec(&answer).unwrap_or_default())?;
    link.flush()?;
    wrong.map_or_else(|| Ok(hellos.into_iter().map(|hello| hello.device).collect()), Err)
}

/// Answer of the root to the other ranks.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Answer {
    host: String,
    refusal: Option<Refusal>,
}

/// First rank that cannot render or differs, with its error.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Refusal {
    rank: u32,
    host: String,
    code: u8,
    message: String,
}

fn differs(rank: u32, root: &Handshake, theirs: &Handshake) -> Option<ClusterError> {
    let host = theirs.host.clone();
    let (ours, facts) = match (&root.facts, &theirs.facts) {
        (_, Err((code, message))) => {
            return Some(ClusterError::Rank { rank, host, message: message.clone(), code: *code });
        }
        (Err(_), Ok(_)) => return None, // the root's own error is reported
        (Ok(ours), Ok(facts)) => (ours, facts),
    };
    let Difference { field: what, one: ours, other: theirs } = ours.difference(facts)?;
    Some(ClusterError::Mismatch { rank, host, what, theirs, ours })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::super::heartbeat::DEFAULT_PATIENCE;
    use super::super::local::Local;
    use super::*;
    use trisect::bvh::BvhQuality;
    use trisect::render::Settings;
    use trisect::scene::Scene;

    fn facts(scene: &Scene, settings: &Settings, quality: Option<BvhQuality>) -> RankFacts {
        let fingerprint = Fingerprint::new(&scene.digest(), settings, quality);
        RankFacts { fingerprint, others: vec![("the plan".to_owned(), "rows".to_owned())] }
    }

    fn meet(of: Vec<Result<RankFacts, (u8, String)>>) -> Vec<Result<Vec<String>, ClusterError>> {
        let ranks = Local::ranks(of.len() as u32).into_iter().zip(of).map(|(local, facts)| {
            std::thread::spawn(move || {
                handshake(&mut Heartbeat::new(local, DEFAULT_PATIENCE), "a device", facts)
            })
        });
        let ranks: Vec<_> = ranks.collect();
        ranks.into_iter().map(|rank| rank.join().unwrap()).collect()
    }

    #[test]
    fn who_differs_is_named() {
        let scene = Scene::hello_world().unwrap();
        let same = facts(&scene, &Settings::of(&scene), None);
        let all = meet(vec![Ok(same.clone()), Ok(same.clone()), Ok(same.clone())]);
        assert_eq!(all[0], Ok(vec!["a device".to_owned(); 3]));
        assert!(all[1..].iter().all(|rank| *rank == Ok(Vec::new())));

        let other = facts(&scene, &Settings { seed: 7, ..Settings::of(&scene) }, None);
        let mixed = meet(vec![Ok(same.clone()), Ok(same.clone()), Ok(other)]);
        let text = mixed[0].as_ref().unwrap_err().to_string();
        assert!(text.contains("rank 2 on thread-2: the seed is 7, rank 0 has 0"), "{text}");
        assert!(mixed.iter().all(|rank| rank.as_ref().unwrap_err().exit_code() == 2));

        // BVHs of another quality decide ties differently.
        let tree = facts(&scene, &Settings::of(&scene), Some(BvhQuality::Fast));
        let mixed = meet(vec![Ok(same.clone()), Ok(tree)]);
        let text = mixed[0].as_ref().unwrap_err().to_string();
        assert!(text.contains("the bvh quality is fast, rank 0 has not given"), "{text}");

        let mut moved = scene.clone();
        moved.spheres[0].center.x += 1e-3;
        let mixed = meet(vec![Ok(same.clone()), Ok(facts(&moved, &Settings::of(&scene), None))]);
        assert!(mixed[0].as_ref().unwrap_err().to_string().contains("the scene's hash"));

        let mut tiles = same.clone();
        tiles.others[0].1 = "tiles".to_owned();
        let text = meet(vec![Ok(same.clone()), Ok(tiles)])[0].as_ref().unwrap_err().to_string();
        assert!(text.contains("the plan is tiles, rank 0 has rows"), "{text}");

        let missing = (4, "a.ron: no such file".to_owned());
        for broken in [0, 1] {
            let mut all = vec![Ok(same.clone()), Ok(same.clone())];
            all[broken] = Err(missing.clone());
            for rank in meet(all) {
                let error = rank.unwrap_err();
                assert_eq!(error.exit_code(), 4);
                let text = error.to_string();
                assert!(text.contains(&format!("rank {broken} on thread-{broken}: a.ron")), "{text}");
            }
        }
    }
}
