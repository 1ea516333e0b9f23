//! The command line of `cargo mutation-gate`.

use crate::error::Error;

/// Options of the command line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Prints the mutants and runs nothing.
    pub list: bool,
    /// Names of the mutants to run; empty for all.
    pub only: Vec<String>,
    /// Starts no mutant after this many seconds.
    pub seconds: Option<u64>,
    /// Number of the first mutant; by default 0, or for a time-limited run a number from the
    /// commit.
    pub start: Option<usize>,
    /// Runs the k-th of n parts, k from 1.
    pub shard: Option<(usize, usize)>,
}

/// Text for `--help` and errors.
pub const USAGE: &str = "usage: cargo mutation-gate [OPTIONS]

Plants each mutant of tests/mutation/mutants.toml in a copy of the workspace, and checks that its tests fail.

  --list         print the mutants and the tests that catch them; run nothing
  --only NAME    this mutant only; may be given several times
  --seconds N    start no mutant after N seconds (without the first compilation), and print those not run
  --start K      begin with mutant K, counted from 0 (default: 0; with --seconds, a number from the commit)
  --shard K/N    run the K-th of N parts, K from 1";

impl Options {
    /// Parses the arguments after the program's name.
    ///
    /// # Errors
    ///
    /// If one is unknown or has no value.
    pub fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Self, Error> {
        let mut options = Self::default();
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            let (name, mut value) = match argument.split_once('=') {
                Some((name, value)) => (name.to_owned(), Some(value.to_owned())),
                None => (argument.clone(), None),
            };
            let mut text = || value.take().or_else(|| arguments.next());
            let wrong = |wanted: &str| Error::Usage(format!("{name} takes {wanted}\n\n{USAGE}"));
            match name.as_str() {
                "--list" => options.list = true,
                "--only" => options.only.push(text().ok_or_else(|| wrong("a mutant's name"))?),
                "--seconds" => options.seconds = Some(number(text()).ok_or_else(|| wrong("a number"))?),
                "--start" => options.start = Some(number(text()).ok_or_else(|| wrong("a number"))?),
                "--shard" => {
                    let part = text().and_then(|text| shard(&text));
                    options.shard = Some(part.ok_or_else(|| wrong("K/N, K from 1 to N"))?);
                }
                _ => return Err(Error::Usage(format!("{argument}: no such option\n\n{USAGE}"))),
            }
        }
        Ok(options)
    }

    /// Returns the numbers of the mutants to run, in order. `seed` is the default start of a
    /// time-limited run.
    ///
    /// # Errors
    ///
    /// If `only` has an unknown name.
    pub fn choose(&self, names: &[&str], seed: usize) -> Result<Vec<usize>, Error> {
        if let Some(unknown) = self.only.iter().find(|only| !names.contains(&only.as_str())) {
            return Err(Error::Usage(format!("unknown mutant {unknown}; --list prints all mutants")));
        }
        let first = self.start.unwrap_or(if self.seconds.is_some() { seed } else { 0 });
        let turned = (0..names.len()).map(|i| (first % names.len() + i) % names.len());
        let wanted = |&i: &usize| self.only.is_empty() || self.only.iter().any(|only| only == names[i]);
        let part = |&i: &usize| self.shard.is_none_or(|(k, n)| i % n == k - 1);
        Ok(turned.filter(wanted).filter(part).collect())
    }
}

fn number<T: std::str::FromStr>(text: Option<String>) -> Option<T> {
    text?.parse().ok()
}

fn shard(text: &str) -> Option<(usize, usize)> {
    let (k, n) = text.split_once('/')?;
    let (k, n) = (k.parse().ok()?, n.parse().ok()?);
    (1 <= k && k <= n).then_some((k, n))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Options, Error> {
        Options::parse(text.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn arguments() {
        let options = parse("--only a --only=b --seconds 90 --start 3 --shard 2/4").unwrap();
        assert_eq!(
            options,
            Options {
                list: false,
                only: vec!["a".into(), "b".into()],
                seconds: Some(90),
                start: Some(3),
                shard: Some((2, 4)),
            }
        );
        for wrong in
            ["--nonsense", "--only", "--seconds many", "--shard 0/2", "--shard 3/2", "--shard 1", "x"]
        {
            assert!(matches!(parse(wrong), Err(Error::Usage(_))), "{wrong}");
        }
    }

    #[test]
    fn choices() {
        let names = ["a", "b", "c", "d"];
        let choose = |text: &str, seed| parse(text).unwrap().choose(&names, seed);
        assert_eq!(choose("", 3).unwrap(), [0, 1, 2, 3]);
        assert_eq!(choose("--seconds 1", 4_000_000_003).unwrap(), [3, 0, 1, 2]);
        assert_eq!(choose("--seconds 1 --start 2", 3).unwrap(), [2, 3, 0, 1]);
        assert_eq!(choose("--only c --only a", 0).unwrap(), [0, 2]);
        // The parts together have all mutants.
        assert_eq!(
            (choose("--shard 1/3", 0).unwrap(), choose("--shard 2/3", 0).unwrap()),
            (vec![0, 3], vec![1])
        );
        assert!(choose("--only e", 0).is_err());
    }
}
