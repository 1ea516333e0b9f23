//! Disables a Vulkan layer that prints an error on machines without a display.
#![allow(unsafe_code, reason = "the environment is the only way to a layer of Vulkan's loader")]

use std::env;
use std::path::Path;

/// Environment variable that disables the layer.
const SWITCH: &str = "NODEVICE_SELECT";

/// Disables Mesa's device-selection layer on a machine without a display. The layer queries a
/// display server for the device to list first; without `XDG_RUNTIME_DIR`, libwayland then prints
/// "error: XDG_RUNTIME_DIR is invalid or not set in the environment" for each Vulkan instance.
///
/// # Safety
///
/// No other thread may be running.
pub unsafe fn quieten() {
    let is_headless = is_headless(|name| env::var_os(name).map(|value| value.to_string_lossy().into_owned()));
    if cfg!(target_os = "linux") && is_headless && env::var_os(SWITCH).is_none() {
        // SAFETY: no other thread reads the environment meanwhile, as the caller promises.
        unsafe { env::set_var(SWITCH, "1") };
    }
}

/// Returns whether the layer can find no display server, and the user has not named the device that
/// it lists first.
fn is_headless(variable: impl Fn(&str) -> Option<String>) -> bool {
    let is_path = |name: &str| variable(name).is_some_and(|value| Path::new(&value).is_absolute());
    let is_set = |name: &str| variable(name).is_some_and(|value| !value.is_empty());
    let has_wayland = is_path("XDG_RUNTIME_DIR") || is_path("WAYLAND_DISPLAY") || is_set("WAYLAND_SOCKET");
    let is_told = ["DISPLAY", "MESA_VK_DEVICE_SELECT", "DRI_PRIME"].into_iter().any(is_set);
    !has_wayland && !is_told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displays_and_wishes_keep_the_layer() {
        let of = |set: &[(&str, &str)]| {
            is_headless(|name| set.iter().find(|(one, _)| *one == name).map(|(_, value)| (*value).to_owned()))
        };
        for set in [&[][..], &[("XDG_RUNTIME_DIR", "")], &[("XDG_RUNTIME_DIR", "run")], &[("DISPLAY", "")]] {
            assert!(of(set), "{set:?}");
        }
        for set in [
            ("XDG_RUNTIME_DIR", "/run/user/0"),
            ("WAYLAND_DISPLAY", "/run/wayland-0"),
            ("DISPLAY", ":0"),
            ("MESA_VK_DEVICE_SELECT", "10de:2330"),
            ("DRI_PRIME", "1"),
        ] {
            assert!(!of(&[set]), "{set:?}");
        }
        // A relative name is that of a socket in XDG_RUNTIME_DIR, which is not set.
        assert!(of(&[("WAYLAND_DISPLAY", "wayland-0")]));
    }
}
