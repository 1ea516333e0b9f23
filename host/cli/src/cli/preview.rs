//! Options that show a render while it runs, and render again after changes.

use clap::Args;

/// Port on which tev listens.
const TEV_PORT: u16 = 14158;

/// Options of a live preview.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Preview")]
pub struct PreviewArgs {
    /// Show the image in the viewer tev while it is rendered (default: no; tev is
    /// tev://127.0.0.1:14158).
    #[arg(help_heading = "Preview", long, value_name = "tev[://HOST[:PORT]]", value_parser = parse_display)]
    pub display: Option<DisplayAddress>,

    /// Render again whenever the scene, or a file that it names, is written; an interrupt ends the
    /// command.
    #[arg(help_heading = "Preview", long)]
    pub watch: bool,
}

/// Host and port of tev.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DisplayAddress {
    /// Name or number of the host.
    pub host: String,
    /// TCP port.
    pub port: u16,
}

fn parse_display(text: &str) -> Result<DisplayAddress, String> {
    let hint = || "must be tev, tev://HOST or tev://HOST:PORT, such as tev://127.0.0.1:14158".to_owned();
    if text == "tev" {
        return Ok(DisplayAddress { host: "127.0.0.1".to_owned(), port: TEV_PORT });
    }
    let place = text.strip_prefix("tev://").ok_or_else(hint)?;
    // Numbers of IPv6 hold colons, and are in brackets.
    let (host, port) = match place.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((host, "")) => (host, None),
        Some((host, rest)) => (host, Some(rest.strip_prefix(':').ok_or_else(hint)?)),
        None => place.split_once(':').map_or((place, None), |(host, port)| (host, Some(port))),
    };
    let port = port.map_or(Ok(TEV_PORT), |port| port.parse().map_err(|_| hint()))?;
    if host.is_empty() || port == 0 {
        return Err(hint());
    }
    Ok(DisplayAddress { host: host.to_owned(), port })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses() {
        let of = |text| parse_display(text).map(|DisplayAddress { host, port }| (host, port));
        for (text, host, port) in [
            ("tev", "127.0.0.1", 14158),
            ("tev://desk", "desk", 14158),
            ("tev://desk:99", "desk", 99),
            ("tev://[::1]", "::1", 14158),
            ("tev://[::1]:7", "::1", 7),
        ] {
            assert_eq!(of(text), Ok((host.to_owned(), port)), "{text}");
        }
        for bad in [
            "",
            "TEV",
            "tev:",
            "tev://",
            "tev://:1",
            "tev://a:0",
            "tev://a:70000",
            "tev://[::1]7",
            "http://a",
        ] {
            assert!(of(bad).is_err(), "{bad}");
        }
    }
}
