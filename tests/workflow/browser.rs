//! The report in a browser, in light and dark colours and as it is printed: nothing overflows, all text is legible, no
//! texts of a figure overlap, all links and pictures resolve, and nothing is fetched from the network.

use std::path::Path;
use std::process::Command;

use serde::Deserialize;

use super::finished_tiny;

/// Widths of a phone, a tablet and a desktop in px.
const WIDTHS: [u32; 3] = [390, 768, 1400];
/// Width of the text of a printed A4 page in px.
const PAPER_WIDTH: u32 = 718;
/// Smallest size of legible text in px.
const SMALLEST_TEXT: f64 = 9.0;
/// Smallest contrast of legible text with its background: the limit of WCAG 2.1 for large text.
const LOWEST_CONTRAST: f64 = 3.0;

/// Medium and colours of a page. They are emulated by the queries of its style sheet, so that they do not depend on
/// options of the browser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Medium {
    Light,
    Dark,
    Print,
}

impl Medium {
    /// Returns the page with the queries of its style sheet answered.
    fn emulated(self, page: &str) -> String {
        let (dark, print) = match self {
            Self::Light => ("not all", "not all"),
            Self::Dark => ("all", "not all"),
            Self::Print => ("not all", "all"),
        };
        page.replace("@media screen and (prefers-color-scheme: dark)", &format!("@media {dark}"))
            .replace("@media print", &format!("@media {print}"))
    }
}

/// Script that collects errors; it runs before all other scripts of the page.
const FIRST: &str = r#"<script>
window.problems = [];
window.addEventListener("error", e => window.problems.push(e.message || "cannot load " + e.target.outerHTML.slice(0, 80)), true);
console.error = (...what) => window.problems.push(what.join(" "));
</script>"#;

/// Script that measures the page and sends the result to the surrounding page.
const LAST: &str = r##"<script>
window.addEventListener("load", () => {
  const found = { width: innerWidth, overflow: document.scrollingElement.scrollWidth - innerWidth, beyond: [], small: [],
    faint: [], overlapping: [], anchors: [], pictures: [], fetched: [], errors: window.problems, texts: 0, images: 0 };
  const start = node => node.textContent.trim().slice(0, 40);
  const colour = text => text.match(/[\d.]+/g).map(Number);
  const luminance = rgb => {
    const [r, g, b] = rgb.slice(0, 3).map(c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const background = element => {
    for (; element; element = element.parentElement) {
      const rgba = colour(getComputedStyle(element).backgroundColor);
      if (rgba.length < 4 || rgba[3] > 0.5) return rgba;
    }
    return [255, 255, 255];
  };
  const inFigures = new Map();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode, parent = text.parentElement;
    if (!text.textContent.trim() || ["SCRIPT", "STYLE"].includes(parent.tagName) || !parent.checkVisibility()) continue;
    const range = document.createRange();
    range.selectNodeContents(text);
    const box = range.getBoundingClientRect();
    if (box.width === 0) continue;
    found.texts += 1;
    const matrix = parent instanceof SVGElement ? parent.getScreenCTM() : { a: 1, b: 0 };
    const size = parseFloat(getComputedStyle(parent).fontSize) * Math.hypot(matrix.a, matrix.b);
    if (size < SMALLEST) found.small.push(start(text) + ": " + size.toFixed(1) + " px");
    if (box.right > innerWidth + 1 && !parent.closest(SCROLLED)) found.beyond.push(start(text));
    const style = getComputedStyle(parent);
    const both = [colour(parent instanceof SVGElement ? style.fill : style.color), background(parent)].map(luminance);
    const contrast = (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05);
    if (contrast < CONTRAST) found.faint.push(start(text) + ": " + contrast.toFixed(1));
    const figure = parent.closest("svg");
    if (figure) {
      // letters fill the middle of the box of a line
      const [dx, dy] = [1, 0.2 * Math.min(box.width, box.height)];
      const letters = { text: start(text), left: box.left + dx, right: box.right - dx, top: box.top + dy,
        bottom: box.bottom - dy };
      inFigures.set(figure, [...(inFigures.get(figure) || []), letters]);
    }
  }
  for (const texts of inFigures.values())
    texts.forEach((a, i) => texts.slice(i + 1).forEach(b => {
      if (a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
        found.overlapping.push(a.text + " / " + b.text);
    }));
  for (const link of document.querySelectorAll("a[href^='#']"))
    if (!document.getElementById(link.getAttribute("href").slice(1))) found.anchors.push(link.getAttribute("href"));
  for (const image of document.images) {
    found.images += 1;
    if (!image.complete || image.naturalWidth === 0) found.pictures.push(image.alt);
  }
  const remote = /^(https?:)?\/\//;
  for (const element of document.querySelectorAll("[src], link[href], object[data], image[href], use[href]"))
    for (const name of ["src", "href", "data"])
      if (remote.test(element.getAttribute(name) || "")) found.fetched.push(element.getAttribute(name));
  for (const entry of performance.getEntriesByType("resource"))
    if (remote.test(entry.name)) found.fetched.push(entry.name);
  parent.postMessage(JSON.stringify(found), "*");
});
</script>"##;

/// Result of the measurement of a page.
#[derive(Debug, Deserialize)]
struct Found {
    width: f64,
    /// Number of px by which the page is wider than the window.
    overflow: f64,
    /// Text beyond the right edge of the window that no scroll bar reveals.
    beyond: Vec<String>,
    /// Visible text that is too small.
    small: Vec<String>,
    /// Text that hardly differs from its background.
    faint: Vec<String>,
    /// Pairs of texts of a figure that overlap.
    overlapping: Vec<String>,
    /// Links to anchors that do not exist.
    anchors: Vec<String>,
    /// Pictures that the browser does not draw.
    pictures: Vec<String>,
    /// Resources that are not part of the page.
    fetched: Vec<String>,
    errors: Vec<String>,
    /// Number of pieces of visible text.
    texts: usize,
    images: usize,
}

impl Found {
    fn is_good(&self) -> bool {
        let of_text = [&self.beyond, &self.small, &self.faint, &self.overlapping];
        let of_links = [&self.anchors, &self.pictures, &self.fetched, &self.errors];
        let mut lists = of_text.into_iter().chain(of_links);
        self.overflow <= 0.0 && lists.all(|list| list.is_empty())
    }
}

fn has_browser() -> bool {
    Command::new("chromium").arg("--version").output().is_ok_and(|output| output.status.success())
}

/// Opens a page in a window of a given width. The page is in a frame, because the windows of a browser have a minimum
/// width.
fn open(page: &str, width: u32, medium: Medium) -> Found {
    let dir = tempfile::tempdir().unwrap();
    let scrolled = match medium {
        Medium::Light | Medium::Dark => ".scroll, .pairs, pre",
        // paper cannot be scrolled; an element of this name does not exist
        Medium::Print => "none",
    };
    let last = LAST
        .replace("SMALLEST", &SMALLEST_TEXT.to_string())
        .replace("CONTRAST", &LOWEST_CONTRAST.to_string())
        .replace("SCROLLED", &format!("{scrolled:?}"));
    let page = medium.emulated(page);
    let page = page.replacen("<head>", &format!("<head>{FIRST}"), 1);
    let page = page.replacen("</body>", &format!("{last}</body>"), 1);
    assert!(page.contains("window.problems = []") && page.contains("postMessage"), "no HTML page");
    std::fs::write(dir.path().join("page.html"), page).unwrap();
    let around = format!(
        "<!DOCTYPE html><meta charset=\"utf-8\"><script>addEventListener('message', e => {{\
         document.getElementById('found').textContent = encodeURIComponent(e.data);}});</script>\
         <pre id=\"found\"></pre>\
         <iframe src=\"page.html\" style=\"border: 0; width: {width}px; height: 900px\"></iframe>"
    );
    std::fs::write(dir.path().join("around.html"), around).unwrap();
    let text = dump(dir.path(), width);
    let found =
        text.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let found = decoded(found.unwrap_or_else(|| panic!("nothing was measured: {text}")).0);
    let found: Found =
        serde_json::from_str(&found).unwrap_or_else(|e| panic!("{e}: {found}; {text}"));
    assert_eq!(found.width, f64::from(width), "the frame has another width");
    found
}

/// Returns the document `around.html` after the page in its frame was measured.
fn dump(dir: &Path, width: u32) -> String {
    let output = Command::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", "--hide-scrollbars"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--virtual-time-budget=10000"])
        .arg(format!("--user-data-dir={}", dir.join("profile").display()))
        .arg(format!("--window-size={},1000", width.max(600) + 50))
        .arg(format!("file://{}", dir.join("around.html").display()))
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Inverse of the browser's `encodeURIComponent`.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let hex = after.get(..2).filter(|_| first == b'%');
        let byte = hex.and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        bytes.push(byte.unwrap_or(first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Opens a page at all widths and in all media, and checks that it has no fault and at least as many texts and images as
/// stated.
pub(super) fn check_page(page: &str, texts: usize, images: usize) {
    if !has_browser() {
        eprintln!("SKIPPED: chromium is not installed, so that no report is opened in a browser");
        return;
    }
    let on_screen = WIDTHS.map(|width| [(width, Medium::Light), (width, Medium::Dark)]);
    for (width, medium) in on_screen.into_iter().flatten().chain([(PAPER_WIDTH, Medium::Print)]) {
        let found = open(page, width, medium);
        assert!(found.is_good(), "{width} px, {medium:?}: {found:#?}");
        assert!(
            found.texts >= texts && found.images >= images,
            "{width} px, {medium:?}: {found:?}"
        );
    }
}

#[test]
fn the_report_fits_every_width_and_everything_on_it_resolves() {
    let page = finished_tiny().dir.path().join("results/report.html");
    check_page(&std::fs::read_to_string(page).unwrap(), 200, 4);
}

/// Checks that the measurement finds each kind of fault.
#[test]
fn faults_of_a_page_are_found() {
    if !has_browser() {
        eprintln!("SKIPPED: chromium is not installed, so that no page is opened in a browser");
        return;
    }
    let page = |body: &str| {
        format!(
            "<!DOCTYPE html><html><head></head><body style=\"margin: 0\"><p>text</p>{body}</body></html>"
        )
    };
    let open = |page: &str, width: u32| open(page, width, Medium::Light);
    assert!(open(&page(""), 390).is_good());
    let wide = open(&page("<div style=\"width: 500px; text-align: right\">far</div>"), 390);
    assert!(wide.overflow == 110.0 && wide.beyond == ["far"], "{wide:?}");
    let svg = "<svg viewBox=\"0 0 780 10\" width=\"390\"><text y=\"9\" font-size=\"16\">tiny</text></svg>";
    assert_eq!(open(&page(svg), 390).small, ["tiny: 8.0 px"]);
    assert_eq!(open(&page("<a href=\"#nowhere\">link</a>"), 390).anchors, ["#nowhere"]);
    let broken = open(&page("<img alt=\"broken\" src=\"data:image/png;base64,AAAA\">"), 390);
    assert!(broken.pictures == ["broken"] && !broken.errors.is_empty(), "{broken:?}");
    let remote = open(&page("<img alt=\"remote\" src=\"http://localhost:9/a.png\">"), 390);
    assert!(remote.fetched.iter().any(|name| name.contains("localhost:9")), "{remote:?}");
    let error = open(&page("<script>console.error('said')</script>"), 390);
    assert_eq!(error.errors, ["said"]);
    let faint = open(&page("<p style=\"color: #eee\">faint</p>"), 390);
    assert_eq!(faint.faint, ["faint: 1.2"]);
    let texts = |x: u32| {
        format!(
            "<svg viewBox=\"0 0 300 40\" width=\"300\"><text y=\"20\">one</text><text x=\"{x}\" y=\"22\">two</text></svg>"
        )
    };
    assert_eq!(open(&page(&texts(10)), 390).overlapping, ["one / two"]);
    assert!(open(&page(&texts(100)), 390).is_good());
}

/// Checks that every query of the report's style sheet is emulated, and that each query has an effect.
#[test]
fn media_of_the_report_are_emulated() {
    let page = finished_tiny().dir.path().join("results/report.html");
    let page = std::fs::read_to_string(page).unwrap();
    let [light, dark, print] =
        [Medium::Light, Medium::Dark, Medium::Print].map(|medium| medium.emulated(&page));
    for (emulated, all) in [(&light, 0), (&dark, 1), (&print, 1)] {
        assert!(!emulated.contains("prefers-color-scheme") && !emulated.contains("@media print"));
        assert_eq!(emulated.matches("@media all").count(), all);
    }
}
