//! Checks that a page is well-formed and loads nothing.

/// Elements without an end tag.
const VOID: [&str; 7] = ["meta", "img", "br", "input", "link", "hr", "wbr"];

/// Attributes that name something to load.
const LOADING: [&str; 6] = ["src", "href", "srcset", "data", "action", "poster"];

/// Checks a page as report pages are written: tags are balanced, attributes are quoted and none is
/// a handler of events, and nothing is loaded from outside the page. For tests.
///
/// # Errors
///
/// Names the first fault.
pub fn check(page: &str) -> Result<(), String> {
    let rest = page.strip_prefix("<!DOCTYPE html>").ok_or("no <!DOCTYPE html> at the start")?;
    let (mut open, mut ids, mut rest): (Vec<&str>, Vec<&str>, _) = (Vec::new(), Vec::new(), rest);
    while let Some(start) = rest.find('<') {
        if rest[..start].contains('>') {
            return Err(format!("a bare > in {:?}", &rest[..start]));
        }
        let end = tag_end(&rest[start..]).ok_or_else(|| format!("no > after {:.60?}", &rest[start..]))?;
        let tag = &rest[start + 1..start + end];
        rest = &rest[start + end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            let opened = open.pop();
            if opened != Some(name) {
                return Err(format!("</{name}> ends {opened:?}"));
            }
            continue;
        }
        let name = tag.split([' ', '\n', '/']).next().unwrap_or_default();
        let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric());
        if !is_name {
            return Err(format!("<{tag:.60}> is no tag"));
        }
        for (attribute, value) in attributes(&tag[name.len()..])? {
            check_attribute(name, attribute, value)?;
            if attribute == "id" {
                if ids.contains(&value) {
                    return Err(format!("id {value} twice"));
                }
                ids.push(value);
            }
        }
        if matches!(name, "script" | "style") {
            let close = format!("</{name}>");
            let end = rest.find(&close).ok_or_else(|| format!("<{name}> without an end"))?;
            let text = &rest[..end];
            if ["http:", "https:", "@import", "url(", "fetch(", "XMLHttpRequest", "import("]
                .iter()
                .any(|word| text.contains(word))
            {
                return Err(format!("<{name}> loads something"));
            }
            rest = &rest[end + close.len()..];
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    open.pop().map_or(Ok(()), |name| Err(format!("<{name}> without an end")))
}

/// Returns the place of the `>` that ends a tag, outside quotes.
fn tag_end(tag: &str) -> Option<usize> {
    let mut quoted = false;
    tag.char_indices().find_map(|(place, character)| {
        quoted ^= character == '"';
        (character == '>' && !quoted).then_some(place)
    })
}

/// Returns names and values of a tag's attributes; a value is empty if there is none.
fn attributes(text: &str) -> Result<Vec<(&str, &str)>, String> {
    let mut found = Vec::new();
    let mut rest = text.trim_matches(['/', ' ', '\n']);
    while !rest.is_empty() {
        let end = rest.find(['=', ' ', '\n']).unwrap_or(rest.len());
        let name = &rest[..end];
        if let Some(value) = rest[end..].strip_prefix("=\"") {
            let close = value.find('"').ok_or_else(|| format!("a quote of {name} is open"))?;
            found.push((name, &value[..close]));
            rest = value[close + 1..].trim_start();
        } else if rest[end..].starts_with('=') {
            return Err(format!("the value of {name} is not quoted"));
        } else {
            found.push((name, ""));
            rest = rest[end..].trim_start();
        }
    }
    Ok(found)
}

fn check_attribute(tag: &str, name: &str, value: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | ':');
    if name.is_empty() || !name.chars().all(plain) {
        return Err(format!("<{tag}> has an attribute {name:?}"));
    }
    if name.starts_with("on") {
        return Err(format!("<{tag}> has a handler {name}"));
    }
    if value.contains('<') {
        return Err(format!("<{tag}>: {name} is not escaped"));
    }
    let own = value.starts_with("data:image/png;base64,") || value.starts_with('#');
    if LOADING.contains(&name) && !own {
        return Err(format!("<{tag}> loads {value:.60}"));
    }
    if value.contains("url(") && !value.starts_with("url(#") {
        return Err(format!("<{tag}> loads {value:.60}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_named() {
        let page = |body: &str| format!("<!DOCTYPE html>\n<html lang=\"en\"><body>{body}</body></html>\n");
        let good = "<p class=\"a > b\">x &gt; y<br><img src=\"data:image/png;base64,AA==\" alt=\"\"></p>\
                    <svg><path d=\"M0 0\"/></svg><input type=\"range\" hidden>\
                    <script>if (1 < 2 && a > b) x();</script>";
        assert_eq!(check(&page(good)), Ok(()));
        let faults = [
            ("<p>", "</body> ends"),
            ("</p>", "</p> ends"),
            ("<p>a > b</p>", "a bare >"),
            ("<p class=a>x</p>", "is not quoted"),
            ("<p onclick=\"x()\">x</p>", "a handler onclick"),
            ("<img src=\"http://a/b.png\">", "<img> loads http"),
            ("<img src=\"b.png\">", "<img> loads b.png"),
            ("<a href=\"//a\">x</a>", "<a> loads //a"),
            ("<p style=\"background: url(x)\">x</p>", "<p> loads"),
            ("<style>@import 'x';</style>", "<style> loads"),
            ("<script>fetch('x')</script>", "<script> loads"),
            ("<script>", "<script> without an end"),
            ("<p title=\"<b\">x</p>", "is not escaped"),
            ("<p id=\"a\">x</p><p id=\"a\">x</p>", "id a twice"),
            ("<!-- -->", "is no tag"),
        ];
        for (body, fault) in faults {
            let found = check(&page(body)).err().unwrap_or_default();
            assert!(found.contains(fault), "{body}: {found}");
        }
        assert!(check("<html></html>").is_err());
        assert!(check("<!DOCTYPE html><html>").is_err());
    }
}
