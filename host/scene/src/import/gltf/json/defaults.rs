//! Numbers that stand for members which a file leaves out.

pub fn one() -> f64 {
    1.0
}

pub fn film() -> f64 {
    1.3
}

pub fn thin() -> f64 {
    100.0
}

pub fn thick() -> f64 {
    400.0
}

pub fn yes() -> bool {
    true
}

pub fn white() -> [f64; 3] {
    [1.0; 3]
}

pub fn opaque_white() -> [f64; 4] {
    [1.0; 4]
}

pub fn unscaled() -> [f64; 2] {
    [1.0; 2]
}

/// Returns the default index of refraction.
pub fn glass() -> f64 {
    1.5
}

pub fn quarter_pi() -> f64 {
    std::f64::consts::FRAC_PI_4
}

pub fn triangles() -> u32 {
    super::TRIANGLES
}

pub fn repeat() -> u32 {
    super::REPEAT
}
