//! Text of files in messages.

/// Returns a file's text for messages: at most 100 characters, without control characters, which
/// could act on a terminal.
pub(crate) fn shown(text: &str) -> String {
    let mut shown: String =
        text.chars().take(100).map(|letter| if letter.is_control() { '\u{fffd}' } else { letter }).collect();
    if text.chars().nth(100).is_some() {
        shown.push('…');
    }
    shown
}
