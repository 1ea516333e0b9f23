//! Environment, sun and ground: options of the commands that read a scene or a model.

use super::switch::Switch;
use clap::Args;
use std::path::{Path, PathBuf};
use trisect::output::exposure::LightLevel;
use trisect::scene::{EnvironmentSource, Sun, Surroundings};

/// Environment, sun and ground.
#[derive(Clone, Debug, Default, Args)]
pub struct SurroundingsArgs {
    /// Light from infinity: studio (built in), sky (clear, with its sun at --sun; default:
    /// 225,40), uniform (radiance 1) or a panorama in .hdr, .exr or .pfm; replaces the sky of a
    /// scene file (default: the scene's; for a model without lights that carry its image, studio).
    #[arg(help_heading = "Scene", long, value_name = "studio|sky|uniform|FILE", value_parser = parse_environment)]
    pub env: Option<EnvironmentSource>,

    /// Sun in addition to all other light: azimuth in degrees, clockwise from -z seen from above,
    /// so 90 is +x; elevation in degrees, 0 to 90; and irradiance of a surface that faces it
    /// (default: no sun; irradiance 2). Without --env it dims the studio of a model to 0.4; with
    /// --env sky it places the sky's sun, and an irradiance scales the whole sky (default: the
    /// sun's own, W/m²/nm).
    #[arg(
        help_heading = "Scene",
        long,
        value_name = "AZIMUTH,ELEVATION[,IRRADIANCE]",
        value_parser = parse_sun,
        allow_hyphen_values = true
    )]
    pub sun: Option<Sun>,

    /// Ground below a model, which catches its shadow and fades out; off also removes that of a
    /// scene file (default: on for a model with neither a camera nor lights that carry its image).
    #[arg(help_heading = "Scene", long, value_enum)]
    pub ground: Option<Switch>,
}

impl SurroundingsArgs {
    /// Returns the choices for the library.
    pub fn surroundings(&self) -> Surroundings {
        let ground = self.ground.map(|ground| ground == Switch::On);
        Surroundings { environment: self.env.clone(), sun: self.sun, ground }
    }

    /// Returns the level of the light around a model.
    pub fn light_level(&self) -> LightLevel {
        match self.env {
            Some(EnvironmentSource::Sky | EnvironmentSource::File(_)) => LightLevel::Other,
            Some(EnvironmentSource::Studio | EnvironmentSource::Uniform) | None => LightLevel::Unit,
        }
    }

    /// Makes the path of a panorama relative to `folder`.
    pub fn in_folder(&mut self, folder: &Path) {
        if let Some(EnvironmentSource::File(path)) = &mut self.env {
            *path = folder.join(&*path);
        }
    }
}

fn parse_environment(text: &str) -> Result<EnvironmentSource, String> {
    match text {
        "studio" => Ok(EnvironmentSource::Studio),
        "sky" => Ok(EnvironmentSource::Sky),
        "uniform" => Ok(EnvironmentSource::Uniform),
        // A panorama has an extension.
        name if !name.contains(['.', '/', '\\']) => {
            Err("must be studio, sky, uniform or a panorama in .hdr, .exr or .pfm".to_owned())
        }
        path => Ok(EnvironmentSource::File(PathBuf::from(path))),
    }
}

fn parse_sun(text: &str) -> Result<Sun, String> {
    let form =
        || "must be AZIMUTH,ELEVATION in degrees, such as 135,40, or with an irradiance, 135,40,5".to_owned();
    let numbers: Vec<f64> = text
        .split(',')
        .map(|word| word.trim().parse::<f64>().map_err(|_| form()))
        .collect::<Result<_, _>>()?;
    let (azimuth, elevation, irradiance) = match numbers[..] {
        [azimuth, elevation] => (azimuth, elevation, None),
        [azimuth, elevation, irradiance] => (azimuth, elevation, Some(irradiance)),
        _ => return Err(form()),
    };
    if !(-360.0..=360.0).contains(&azimuth) {
        return Err(format!("the azimuth is {azimuth}; it must be from -360 to 360 degrees"));
    }
    if !(0.0..=90.0).contains(&elevation) {
        return Err(format!(
            "the elevation is {elevation}; it must be from 0 (the horizon) to 90 degrees (straight up)"
        ));
    }
    if let Some(irradiance) = irradiance.filter(|irradiance| !(0.0..=1e18).contains(irradiance)) {
        return Err(format!("the irradiance is {irradiance}; it must be 0 or more and at most 1e18"));
    }
    Ok(Sun { azimuth, elevation, irradiance })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn environments() {
        assert_eq!(parse_environment("studio"), Ok(EnvironmentSource::Studio));
        assert_eq!(parse_environment("sky"), Ok(EnvironmentSource::Sky));
        assert_eq!(parse_environment("uniform"), Ok(EnvironmentSource::Uniform));
        let file = |path: &str| Ok(EnvironmentSource::File(path.into()));
        assert_eq!(
            (parse_environment("a.hdr"), parse_environment("./studio")),
            (file("a.hdr"), file("./studio"))
        );
        for bad in ["", "studo", "Studio", "nosuch"] {
            assert!(parse_environment(bad).unwrap_err().contains("studio, sky, uniform"), "{bad}");
        }
    }

    #[test]
    fn suns() {
        let sun = |azimuth, elevation, irradiance| Ok(Sun { azimuth, elevation, irradiance });
        assert_eq!(parse_sun("-90,0"), sun(-90.0, 0.0, None));
        assert_eq!(parse_sun("10.5, 90,3"), sun(10.5, 90.0, Some(3.0)));
        for (bad, reason) in [
            ("", "such as 135,40"),
            ("10", "such as 135,40"),
            ("10,20,30,40", "such as 135,40"),
            ("10,x", "such as 135,40"),
            ("10,-1", "from 0"),
            ("10,90.5", "straight up"),
            ("nan,3", "azimuth"),
            ("400,3", "azimuth"),
            ("10,nan", "elevation"),
            ("10,20,-1", "irradiance"),
            ("10,20,inf", "irradiance"),
        ] {
            let said = parse_sun(bad).unwrap_err();
            assert!(said.contains(reason), "{bad}: {said}");
        }
    }
}
