//! Checks of a report's page in a browser.

use std::fs;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

use crate::browser::Browser;

/// Tooltips appear on hovering and on focus, and disappear afterwards.
pub fn tooltips(browser: &mut Browser) {
    let hint = "(() => { const h = document.getElementById('hint'); return h.hidden ? '' : \
        h.textContent; })()";
    assert_eq!(browser.eval(hint), json!(""));
    let at = browser.eval(
        "(() => { const m = document.querySelector('#run-2 .mark'); m.scrollIntoView({ block: \
         'center' }); \
         const b = m.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()",
    );
    let at = [0, 1].map(|i| at[i].as_f64().expect("a number"));
    browser.point_at(at[0], at[1]);
    let text = browser.eval(hint);
    let text = text.as_str().expect("text");
    // The fastest configuration of the front is first.
    assert!(
        text.contains("draw.resolution=0.25, draw.threshold=0.05")
            && text.contains("GPU time of a frame: 4 (3.8 to 4.2) ms"),
        "{text}"
    );
    assert!(text.contains("RMSE from the reference \"thin\": 0.06 (0.048 to 0.072)"), "{text}");
    browser.point_at(1.0, 1.0);
    assert_eq!(browser.eval(hint), json!(""));
    browser.eval("document.querySelector('#run-2 .mark').focus()");
    assert!(browser.eval(hint).as_str().is_some_and(|s| s.contains("draw.resolution=0.25")));
    browser.key("Tab", 9);
    assert!(
        browser.eval(hint).as_str().is_some_and(|s| s.contains("draw.resolution=0.5")),
        "the next configuration of the front"
    );
    browser.key("Escape", 27);
    assert_eq!(browser.eval(hint), json!(""));
    let inside = "(() => { document.querySelector('#run-2 .mark').focus(); const b = \
        document.getElementById('hint').getBoundingClientRect(); \
                  document.activeElement.blur(); return b.left >= 0 && b.right <= innerWidth; })()";
    assert_eq!(browser.eval(inside), json!(true));
}

/// Sliders compare two benches, and three configurations with their reference.
pub fn sliders(browser: &mut Browser) {
    let sliders = "document.querySelectorAll('.slider').length";
    assert_eq!(browser.eval(sliders), json!(4));
    let cut = |browser: &mut Browser| {
        browser.eval(
            "(() => { const s = document.querySelector('#versus-0 .slider'); return \
            [s.querySelector('input').value, s.querySelectorAll('img')[1].style.clipPath]; })()",
        )
    };
    assert_eq!(cut(browser), json!(["50", "inset(0px 0px 0px 50%)"]));
    browser.eval("document.querySelector('#versus-0 .slider input').focus()");
    browser.key("ArrowRight", 39);
    assert_eq!(cut(browser), json!(["51", "inset(0px 0px 0px 51%)"]));
    // Two different pictures and the map of their difference.
    let captions = browser.eval(
        "[...document.querySelectorAll('#versus-0 .pair figcaption')].map(c => c.textContent)",
    );
    assert_eq!(captions.as_array().map(Vec::len), Some(3));
    assert!(
        captions[2].as_str().is_some_and(|c| c.contains("FLIP") && !c.contains("mean 0;")),
        "{captions}"
    );
}

/// A click on a column's header sorts the table.
pub fn sorting(browser: &mut Browser) {
    let rmse = "[...document.querySelectorAll('#run-2 table')].find(t => t.rows.length === 24)";
    let column = |browser: &mut Browser| -> Vec<f64> {
        let all = browser.eval(&format!(
            "[...{rmse}.tBodies[0].rows].map(r => Number(r.cells[6].dataset.value))"
        ));
        all.as_array().expect("rows").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let before = column(browser);
    browser.eval(&format!("{rmse}.tHead.rows[0].cells[6].querySelector('button').click()"));
    let sorted = column(browser);
    assert!(sorted.is_sorted() && !before.is_sorted() && sorted.len() == before.len());
    browser.eval(&format!("{rmse}.tHead.rows[0].cells[6].querySelector('button').click()"));
    assert!(column(browser).iter().rev().is_sorted());
}

/// Text is legible on light and dark screens and on paper, and the three look different.
pub fn contrasts(browser: &mut Browser) {
    let mut shown = Vec::new();
    for (name, scheme, media) in
        [("light", "light", "screen"), ("dark", "dark", "screen"), ("print", "dark", "print")]
    {
        browser.media(scheme, media);
        let contrasts = browser.eval(&format!("({CONTRAST})({LUMINANCE})"));
        let contrasts = contrasts.as_array().expect("a list");
        assert!(contrasts.len() > 100, "{} texts", contrasts.len());
        for of in contrasts {
            // WCAG 2.1, 1.4.3.
            assert!(of[0].as_f64().is_some_and(|c| c >= 4.5), "{name}: {of}");
        }
        let dark = browser.eval(&format!(
            "({LUMINANCE})(getComputedStyle(document.documentElement).backgroundColor) < 0.2"
        ));
        assert_eq!(dark, json!(name == "dark"), "{name}");
        let picture = browser.picture();
        let bytes = STANDARD.decode(&picture).expect("base64");
        if let Ok(kept) = std::env::var("NIMBUS_TEST_KEEP_PAGE") {
            fs::write(format!("{kept}.{name}.png"), &bytes).expect("a file");
        }
        assert!(!shown.contains(&picture));
        shown.push(picture);
    }
    browser.media("light", "screen");
}

/// Relative luminance of "rgb(…)" (WCAG 2.1).
const LUMINANCE: &str = "c => { const v = c.match(/[0-9.]+/g).slice(0, 3).map(x => x / 255).map(x \
    => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4); return 0.2126 * v[0] + 0.7152 * \
    v[1] + 0.0722 * v[2]; }";

/// Contrast of every element with text against its background, by the function `lum`.
const CONTRAST: &str = "lum => {\
  const behind = e => { for (; e; e = e.parentElement) { const c = \
  getComputedStyle(e).backgroundColor; if (!c.endsWith(', 0)') && c !== 'transparent') return c; } \
  return 'rgb(255, 255, 255)'; };\
  const out = [];\
  for (const e of document.querySelectorAll('body *')) {\
    if (!e.checkVisibility() || e.closest('script, style, title')) continue;\
    const own = [...e.childNodes].filter(n => n.nodeType === 3).map(n => \
    n.textContent.trim()).join('');\
    if (own === '') continue;\
    const style = getComputedStyle(e);\
    const [a, b] = [lum(e.namespaceURI.endsWith('svg') ? style.fill : style.color), \
    lum(behind(e))];\
    out.push([(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), own.slice(0, 40)]);\
  } return out; }";

/// Without scripts the page has all tables and pictures, but no sliders.
pub fn without_scripts(browser: &mut Browser) {
    let document = browser.call("DOM.getDocument", json!({ "depth": 0 }))["root"]["nodeId"].clone();
    let mut n = |selector: &str| {
        let found = browser
            .call("DOM.querySelectorAll", json!({ "nodeId": document, "selector": selector }));
        found["nodeIds"].as_array().map(Vec::len).expect("a list")
    };
    assert_eq!(n(".slider"), 0);
    assert_eq!(n("thead button"), 0);
    assert_eq!(n("figure.chart svg"), 10);
    // Per bench: loops, cases, passes, floors, state; of the study: configurations and budgets; the
    // ledger; of the comparison: differences, ratios, errors and memory.
    assert_eq!(n("table"), 2 * 5 + 2 + 1 + 4);
    assert_eq!(n(".mark title"), n(".mark"));
    assert!(n(".mark") > 23);
    // The benches' last frames; the study's reference, three pictures and three error maps; two
    // pictures and their difference.
    assert_eq!(n("img"), 2 + 7 + 3);
}
