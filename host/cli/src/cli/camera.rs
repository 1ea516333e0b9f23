//! Options of the camera.

use clap::Args;
use trisect::glam::DVec3;
use trisect::scene::CameraChoice;

/// Camera in place of the scene's own.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Name or number, from 0 on, of one of the scene's cameras (default: the first).
    #[arg(help_heading = "Camera", long, value_name = "NAME")]
    pub camera: Option<String>,

    /// Centre of the lens, in scene units (default: the scene's).
    #[arg(help_heading = "Camera", long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_point)]
    pub look_from: Option<DVec3>,

    /// Point in the middle of the image, in scene units (default: the scene's).
    #[arg(help_heading = "Camera", long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_point)]
    pub look_at: Option<DVec3>,

    /// Direction that is up in the image (default: the scene's).
    #[arg(help_heading = "Camera", long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = parse_point)]
    pub up: Option<DVec3>,

    /// Vertical angle of the image in degrees, of a perspective (default: the scene's).
    #[arg(help_heading = "Camera", long, value_name = "DEGREES", value_parser = parse_view_angle)]
    pub fov: Option<f64>,

    /// Cone angle in degrees from a point in focus to the lens; 0 is a pinhole (default: the
    /// scene's).
    #[arg(help_heading = "Camera", long, value_name = "DEGREES", value_parser = parse_angle)]
    pub defocus_angle: Option<f64>,

    /// Distance from the lens to the plane in focus, in scene units (default: the scene's).
    #[arg(help_heading = "Camera", long, value_name = "LENGTH", value_parser = parse_length)]
    pub focus_distance: Option<f64>,
}

impl CameraArgs {
    /// Returns whether any of the options is given.
    pub fn is_given(&self) -> bool {
        self.choice() != CameraChoice::default()
    }

    /// Returns the choice for the library.
    pub fn choice(&self) -> CameraChoice {
        let Self { camera, look_from, look_at, up, fov, defocus_angle, focus_distance } = self;
        CameraChoice {
            name: camera.clone(),
            look_from: *look_from,
            look_at: *look_at,
            up: *up,
            vertical_fov: fov.map(f64::to_radians),
            defocus_angle: defocus_angle.map(f64::to_radians),
            focus_distance: *focus_distance,
        }
    }
}

fn parse_point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let numbers: Option<[f64; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let point = numbers.map(DVec3::from).filter(|point| point.is_finite());
    point.ok_or_else(|| "must be three numbers, such as 0,1.5,-3".to_owned())
}

fn parse_view_angle(text: &str) -> Result<f64, String> {
    let angle = parse_angle(text).ok().filter(|angle| *angle > 0.0);
    angle.ok_or_else(|| "must be above 0 degrees, and below 180".to_owned())
}

fn parse_angle(text: &str) -> Result<f64, String> {
    let angle = text.parse().ok().filter(|angle| (0.0..180.0).contains(angle));
    angle.ok_or_else(|| "must be 0 or more degrees, and below 180".to_owned())
}

fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|length: &f64| *length > 0.0 && length.is_finite());
    length.ok_or_else(|| "must be a length above 0".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_angles() {
        assert_eq!(parse_point("0, 1.5,-3"), Ok(DVec3::new(0.0, 1.5, -3.0)));
        for bad in ["", "1,2", "1,2,3,4", "a,b,c", "1,2,inf", "1 2 3"] {
            assert!(parse_point(bad).is_err(), "{bad}");
        }
        assert_eq!((parse_angle("0"), parse_angle("39.3")), (Ok(0.0), Ok(39.3)));
        assert!(parse_angle("180").is_err() && parse_angle("-1").is_err() && parse_angle("nan").is_err());
        assert!(parse_length("0").is_err() && parse_length("inf").is_err() && parse_length("2").is_ok());
    }
}
